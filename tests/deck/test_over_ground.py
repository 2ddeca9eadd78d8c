from itertools import pairwise

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rotorjax.deck.blades import Blades, linear_blades, stations
from rotorjax.deck.march import simulate
from rotorjax.deck.over_ground import DiskState, controls, output, over_ground, rhs, trim
from rotorjax.deck.state_space import heave_response, state_space
from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.ode.export import to_control, to_dataset
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.ground_table import ground_table
from rotorjax.potential.model import finite_state_model, mean_inflow, steady_state, wake_over
from rotorjax.potential.moving_ground import GroundMotion, prescribed, still
from rotorjax.potential.wake_edge import left_of_tilt
from rotorjax.potential.wake_transport import wake_transport

TRANSPORT = wake_transport(2.2, 8)
ROTOR = finite_state_model(harmonics=1, radial_terms=2, ground_harmonics=1, quadrature=DiskQuadrature(12, 16))
VARIANTS = ("static", "quasi-steady", "dynamic")


def make(variant, blades=True, slope=(-6.0, 6.0), rotor=ROTOR, table=None):
    transport = TRANSPORT if variant == "dynamic" else None
    table = ground_table(rotor, (0.5, 2.0), slope, transport=transport) if table is None else table
    return over_ground(rotor, table, linear_blades(0.08) if blades else None, variant, transport, stations(0.1, 8, 6))


@pytest.fixture(scope="module")
def models():
    static = make("static")
    return {"static": static, "quasi-steady": make("quasi-steady", table=static.table), "dynamic": make("dynamic")}


def at_rest(collective=8.0, height=1.0, slope_deg=5.0, climb=0.0):
    return controls(still(plane(height, slope_deg)), ROTOR, jnp.deg2rad(collective), climb)


@pytest.mark.parametrize("variant", VARIANTS)
def test_trim_over_ground_at_rest_is_the_steady_model(variant, models):
    """The ground in the mass flow comes from the table, and has its accuracy."""
    left = left_of_tilt(wake_over(ROTOR, plane(1.0)), jnp.zeros(()), jnp.ones(()))
    check_trim(models[variant], {}, tilt=(-0.0005, -0.0005 * left), atol=5e-7)  # a rigid edge: below -0.0005


def test_trim_without_the_ground_in_the_mass_flow_is_the_steady_model():
    choices = {"printed": True, "strengths": "closed"}
    rotor = finite_state_model(harmonics=1, radial_terms=2, ground_harmonics=1, quadrature=ROTOR.quadrature, **choices)
    check_trim(make("static", rotor=rotor), choices, tilt=(-np.inf, -0.0015), atol=1e-10)


def check_trim(model, choices, tilt, **tolerance):
    now = at_rest()
    state = trim(model, now)
    found = output(jnp.zeros(()), state, now, model)
    steady = finite_state_model(
        plane(1.0, 5.0), harmonics=1, radial_terms=2, ground_harmonics=1, quadrature=ROTOR.quadrature, **choices
    )
    expected = steady_state(steady, found.tau)
    np.testing.assert_allclose(state.a, expected.a, rtol=0.0, **tolerance)
    np.testing.assert_allclose(found.uniform, mean_inflow(expected, steady), rtol=1e-5)  # the table's accuracy
    assert (
        tilt[0] < found.cosine < tilt[1]
    )  # less inflow where the ground is near; sheared sources make it three times as much
    assert abs(found.sine) < 1e-12


@pytest.mark.parametrize("variant", VARIANTS)
def test_equilibrium_stays(variant, models):
    model, now = models[variant], at_rest()
    state, psi = trim(model, now), jnp.linspace(0, 20, 101)
    many = jax.tree.map(lambda v: jnp.broadcast_to(v, (101, *v.shape)), now)
    history = simulate(model, state, psi, many)
    np.testing.assert_allclose(history.states.a[-1], state.a, atol=1e-10)


def heave(model, omega, amplitude=0.02, steps_a_cycle=120, cycles=6):
    """Complex amplitude of λ₀ over that of the height, after the transient."""
    psi = 2 * np.pi * jnp.arange(steps_a_cycle * cycles + 1) / (omega * steps_a_cycle)
    moving = GroundMotion(
        1 + amplitude * jnp.sin(omega * psi), 0 * psi, amplitude * omega * jnp.cos(omega * psi), 0 * psi
    )
    inputs = controls(moving, ROTOR, jnp.deg2rad(8.0))
    history = simulate(model, trim(model, at_rest(slope_deg=0.0)), psi, inputs)
    last = slice(-steps_a_cycle, None)
    return 2j * jnp.mean(history.outputs.uniform[last] * jnp.exp(-1j * omega * psi[last])) / amplitude


@pytest.mark.parametrize("variant", ["quasi-steady", "dynamic"])
def test_march_has_the_frequency_response_of_the_linear_model(variant, models):
    model, now, omega = models[variant], at_rest(slope_deg=0.0), 0.05
    linear = state_space(model, trim(model, now), now)
    assert abs(heave(model, omega) / heave_response(linear, np.array([omega]))[0, 0] - 1) < 0.01


def test_slow_heave_is_quasi_steady_and_fast_heave_is_not(models):
    """Amplitude and phase of λ₀ against the steady model's at each height, over the reduced frequency ω/λ₀."""
    now = at_rest(slope_deg=0.0)
    found = {}
    for variant, model in models.items():
        state = trim(model, now)
        mean = float(output(jnp.zeros(()), state, now, model).uniform)
        response = heave_response(state_space(model, state, now), np.array([0.001, 0.01, 0.1, 1, 3]) * mean)
        found[variant] = response[:, 0]
    for variant in ("quasi-steady", "dynamic"):
        ratio = found[variant] / found["static"][0]
        assert abs(ratio[0] - 1) < 1e-3
        phase = np.rad2deg(np.angle(ratio))
        assert np.all(np.diff(np.abs(phase)) > 0)
        assert abs(phase[3]) > 10
        assert abs(ratio[4] - found["static"][4] / found["static"][0]) > 0.3


@pytest.mark.slow
def test_order_of_accuracy(models):
    model, finals = models["quasi-steady"], []
    start = trim(model, at_rest(slope_deg=0.0))

    def final(steps):
        psi = jnp.linspace(0, 8, steps + 1)
        moving = GroundMotion(1 + 0.2 * jnp.sin(psi), 0 * psi, 0.2 * jnp.cos(psi), 0 * psi)
        return simulate(model, start, psi, controls(moving, ROTOR, jnp.deg2rad(8.0))).states.a[-1]

    finals = [final(n) for n in (40, 80, 160, 320)]
    errors = np.array([float(jnp.abs(a - b).max()) for a, b in pairwise(finals)])
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 2, atol=0.2)


def test_many_rotors_by_vmap(models):
    model, psi = models["quasi-steady"], jnp.linspace(0, 4, 21)
    moving = prescribed(psi, 1 + 0.1 * jnp.sin(psi), 0 * psi)
    start = trim(model, at_rest(slope_deg=0.0))

    def last(collective):
        return simulate(model, start, psi, controls(moving, ROTOR, collective)).outputs.thrust[-1]

    pitches = jnp.linspace(0.1, 0.2, 7)
    np.testing.assert_allclose(eqx.filter_vmap(last)(pitches)[3], last(pitches[3]), rtol=1e-12)


def test_linear_model_is_named_and_exported(models):
    model, now = models["dynamic"], at_rest()
    linear = state_space(model, trim(model, now), now)
    assert linear.order == 6 * 9
    assert linear.states[:2] == ("a[0]", "a[1]")
    assert linear.inputs[3:5] == ("ground.height", "ground.height_rate")
    assert linear.output_units == ("ΩR", "ΩR", "ΩR", "-")
    assert linear.poles().real.max() < -0.01
    assert to_control(linear).nstates == 54
    assert to_dataset(linear)["A"].shape == (54, 54)


@pytest.mark.slow
def test_linear_model_predicts_a_step_of_collective(models):
    model, now = models["quasi-steady"], at_rest()
    state, psi, jump = trim(model, now), jnp.linspace(0, 30, 301), 0.001
    linear = state_space(model, state, now)
    many = jax.tree.map(lambda v: jnp.broadcast_to(v, (301, *v.shape)), at_rest(8.0 + np.rad2deg(jump)))
    history = simulate(model, state, psi, many)
    expected = linear.step(np.array(psi))[:, 0, linear.inputs.index("collective")]
    change = (history.outputs.uniform - output(jnp.zeros(()), state, now, model).uniform) / jump
    np.testing.assert_allclose(change, expected, atol=0.01 * np.abs(expected).max())


def test_bad_input(models):
    model, now = models["quasi-steady"], at_rest()
    state = trim(model, now)
    many = jax.tree.map(lambda v: jnp.broadcast_to(v, (5, *v.shape)), now)
    with pytest.raises(InputError, match="share their instants"):
        simulate(model, state, jnp.arange(4.0), many)
    with pytest.raises(InputError, match="must divide the 4 intervals, but is 3"):
        simulate(model, state, jnp.arange(5.0), many, 3)
    with pytest.raises(InputError, match="tabulate with the same model"):
        over_ground(ROTOR, model.table, variant="dynamic", transport=TRANSPORT)
    with pytest.raises(InputError, match="must be an equilibrium"):
        state_space(model, eqx.tree_at(lambda s: s.a, state, 2 * state.a), now)
    with pytest.raises(InputError, match="'angle'"):
        state_space(model, state, now, inputs=["angle"])
    assert rhs(jnp.zeros(()), state, now, model).a.shape == (6,)


def free_rotor(solidity=0.0423, radial_terms=4, blades=True, **choices):
    """A rotor far above ground."""
    rotor = finite_state_model(radial_terms=radial_terms, quadrature=DiskQuadrature(12, 4), **choices)
    loads = linear_blades(solidity) if blades else None
    return over_ground(rotor, ground_table(rotor, (60.0, 60.0)), loads, at=stations(0.0, 10, 1))


def test_frequency_response_of_one_state_is_the_analytic_one():
    """dλ₀/dτ₁ = (2/√3)/(2v₀ + iω M/D): first order, with the corner at 2v₀ D/M."""
    model = free_rotor(radial_terms=1, blades=False)
    tau = jnp.array([np.sqrt(3) / 4 * 0.006])
    now = controls(still(plane(60.0)), model.rotor, tau=tau)
    linear = state_space(model, trim(model, now, jnp.array([0.05])), now, inputs=["tau"], outputs=["uniform"])
    omega, v0 = np.array([0.001, 0.05, 0.2, 1.0]), np.sqrt(0.003)
    expected = 2 / np.sqrt(3) / (2 * v0 + 1j * omega * 0.75 / (np.pi / 2))
    np.testing.assert_allclose(linear.response(omega)[:, 0, 0], expected, rtol=1e-3)


class UniformlyAccelerating(Blades):
    """The blades of Carpenter and Fridovich: uniform inflow, so a loading ∝ √(1−r²) that accelerates the disk so."""

    def loading(self, down, pitch, mu, at):
        mean = jnp.sum(2 * at.r * at.widths * down.mean(axis=0))
        thrust = 0.0423 * 5.73 / 2 * (pitch / 3 - mean / 2)
        return jnp.broadcast_to(3 * at.r * jnp.sqrt(1 - at.r**2) * thrust, down.shape)


@pytest.mark.parametrize(("degrees", "ratio"), [(6, 1.91), (8, 1.75), (12, 1.58)])
def test_step_of_collective_against_carpenter_and_fridovich(degrees, ratio):
    """0.849 λ' + 2λ² = C_T(θ, λ) without flapping (NACA TN 3044): inflow within 5 % of its end value at all times.

    Real linear blades load the tip more, where the air has less inertia: their inflow rises 18 % sooner to 63 %.
    Thrust at once over thrust at rest: theirs is that of a cylinder's inflow; where the wake contracts, inflow gathers
    at the tip and takes 3 % more of the thrust.
    """
    psi, theta = jnp.linspace(0, 60, 1201), np.deg2rad(degrees)
    free = free_rotor()
    model = over_ground(free.rotor, free.table, UniformlyAccelerating(), at=stations(0.0, 24, 1))
    now = controls(still(plane(60.0)), model.rotor, theta)
    many = jax.tree.map(lambda v: jnp.broadcast_to(v, (1201, *v.shape)), now)
    at_rest_ = DiskState(jnp.zeros(4), jnp.zeros((0, 4)), jnp.zeros(0), jnp.zeros(0))
    exact = solve_ivp(
        lambda _, lam: (0.0423 * 5.73 / 2 * (theta / 3 - lam / 2) - 2 * lam**2) / 0.849, (0, 60), [0.0], t_eval=psi
    ).y[0]
    lam = np.array(simulate(model, at_rest_, psi, many).outputs.uniform)
    assert np.abs(lam - exact).max() < 0.05 * exact[-1]
    for rotor, tolerance in ((free_rotor(printed=True), 0.01), (free, 0.04)):
        thrust = np.array(simulate(rotor, at_rest_, psi, many).outputs.thrust)
        np.testing.assert_allclose(thrust[0] / thrust[-1], ratio, rtol=tolerance)
