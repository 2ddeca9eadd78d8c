"""The linear rotor against closed forms, and derivatives of its exponents and responses against differences."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import jv

from rotorjax.coupled import coupled_rotor, still_state
from rotorjax.inflow.momentum import Uniform
from rotorjax.inflow.pitt_peters import pitt_peters
from rotorjax.linearisation.drive import drive_of
from rotorjax.linearisation.modes import modes
from rotorjax.linearisation.rotor import Base, SteadyState, base_of, linear_rotor
from rotorjax.linearisation.sensitivity import sensitivity
from rotorjax.ode.harmonic import average
from rotorjax.ode.orbit import make_orbit
from rotorjax.ode.outcome import Outcome
from rotorjax.operating import operating_point
from rotorjax.rotor import geometry
from rotorjax.rotor.airfoil import linear_airfoil
from rotorjax.rotor.flap_lag import flap_frequency, lag_frequency
from rotorjax.rotor.hub import rotor_inputs
from rotorjax.trim.run import request, run
from rotorjax.trim.solve import trim

SLOPE, CHORD, RADIUS, INERTIA = 5.73, 0.5, 8.0, 2000.0
LOCK = 1.225 * SLOPE * CHORD * RADIUS**4 / INERTIA
SOLIDITY = 4 * CHORD / (np.pi * RADIUS)


class NoInflow(Uniform):
    """Air that the rotor leaves alone."""

    def rate(self, state, loads, inputs):
        return 0.0 * state


def plain(lag_spring=2e7):
    """Linear sections without drag and twist from the axis to the tip, stiff in lag."""
    hinge = geometry.hinge(0.0, 100.0, 380.0, INERTIA, lag_spring=lag_spring)
    rotor = geometry.rotor("plain", 4, RADIUS, 0.0, CHORD, linear_airfoil(SLOPE), hinge=hinge, tip_loss=1.0)
    return rotor, operating_point(27.0)


def at_rest(p):
    """The rotor with straight blades in still air: an equilibrium without pitch and weight."""
    u = rotor_inputs()
    x = still_state(p, u, 0.0)
    state = jax.tree.map(lambda v: jnp.zeros_like(v)[None], SteadyState(x.rotor, x.inflow))
    found = Outcome(None, 0.0, (0.0,), 0, True, "at rest", 0.0)
    return Base(p, drive_of(u, p), make_orbit(0.0, state, np.pi / 2, found), "no inflow")


def weightless(p):
    return eqx.tree_at(lambda q: q.blade.gravity, p, jnp.zeros(()))


def test_flap_damping_and_the_gyroscopic_response():
    """Decay γ/16; a steady pitch rate leaves the disk behind by 16/γ of it."""
    model = linear_rotor(at_rest(weightless(coupled_rotor(*plain(), NoInflow(jnp.ones(())), 96))), ["q"], ["beta_1c"])
    found = {mode.name: mode.exponent for mode in modes(model)}
    np.testing.assert_allclose(found["coning"], -LOCK / 16 + 1j * np.sqrt(1 - (LOCK / 16) ** 2), rtol=5e-4)
    np.testing.assert_allclose(found["differential flap"], found["coning"], rtol=1e-9)
    linear = average(model)
    slow = linear.response(np.array([1e-5]))[0, 0, 0]  # the air that is left alone has a pole at zero
    np.testing.assert_allclose(slow.real, 16 / LOCK, rtol=5e-4)


def test_a_gust_of_one_wave_across_the_disk_flaps_the_blades():
    """Of w = sin πx, x = r cos ψ, the first harmonic is 2 J₁(πr): β̈ = γ/2 ∫ r² w dr has γ J₂(π)/π of it, on average."""
    base = at_rest(weightless(coupled_rotor(*plain(), NoInflow(jnp.ones(())), 96)))
    model = linear_rotor(base, ["gust_aft", "gust_starboard"], ["CT"])
    rows = [model.states.index(f"beta_{name}_rate") for name in ("1c", "1s")]
    np.testing.assert_allclose(average(model).b[rows], LOCK * jv(2, np.pi) / np.pi * np.eye(2), atol=5e-4)


def test_blades_without_air_have_their_own_frequencies(uh60):
    """Flap at 1.035 and lag at .268 per revolution; cyclic modes a revolution away."""
    p = weightless(coupled_rotor(*uh60, NoInflow(jnp.ones(()))))
    p = eqx.tree_at(lambda q: (q.blade.air, q.blade.precone), p, (jnp.asarray(1e-9), jnp.zeros(())))
    p = eqx.tree_at(lambda q: (q.blade.damper_rate, q.blade.damper_force), p, (None, None))
    found = {mode.name: mode.exponent.imag for mode in modes(linear_rotor(at_rest(p), ["q"], ["CT"]))}
    flap, lag = float(flap_frequency(p.blade)), float(lag_frequency(p.blade))
    assert (flap, lag) == (pytest.approx(1.035, abs=5e-4), pytest.approx(0.268, abs=2e-3))
    wanted = {
        "coning": flap,
        "regressing flap": flap - 1,
        "progressing flap": flap + 1,
        "collective lag": lag,
        "regressing lag": 1 - lag,
        "progressing lag": 1 + lag,
    }
    assert {name: found[name] for name in wanted} == pytest.approx(wanted, abs=1e-5)


def test_coning_and_inflow_have_the_analytic_roots():
    """β̈ + γ/8 β̇ + β = −γ/6 λ and 8/3π λ̇ = −4λ̄ λ + σa/2 (−λ/2 − β̇/3), of Pitt and Peters' mean inflow in hover."""
    mean, mass, lift = 0.03, 8 / (3 * np.pi), SOLIDITY * SLOPE / 2
    base = at_rest(weightless(coupled_rotor(*plain(), pitt_peters(), 96)))
    orbit = eqx.tree_at(lambda o: o.x.inflow, base.orbit, jnp.array([[mean, 0.0, 0.0]]))
    pitch = {"theta_0": jnp.asarray(1.5 * mean + 3 * 2 * mean**2 / (SOLIDITY * SLOPE) * 2)}
    found = linear_rotor(base._replace(orbit=orbit, u=base.u | pitch), ["q"], ["CT"])
    matrix = np.array([[0, 1, 0], [-1, -LOCK / 8, -LOCK / 6], [0, -lift / 3 / mass, -(4 * mean + lift / 2) / mass]])
    for root in np.linalg.eigvals(matrix):
        assert np.abs(np.linalg.eigvals(found.a[0]) - root).min() < 0.005 * abs(root)


@pytest.fixture(scope="module")
def hover():
    return run(request("uh60", 0.00575, "pitt-peters")).trimmed


PARAMETERS = {
    "hinge offset": (lambda design: design[1].blade.offset, 1e-5),
    "thrust": (lambda design: design[0].thrust, 1e-7),
    "density over inertia": (lambda design: design[1].blade.air, 1e-4),
}


@pytest.mark.parametrize("name", PARAMETERS)
def test_exponents_and_responses_by_design_parameters(hover, name):
    """Exact: against central differences of rotors trimmed and linearised anew."""
    where, step = PARAMETERS[name]
    found = sensitivity(hover, where)
    ends = []
    for change in (step, -step):
        design = (hover.flight, hover.p)
        flight, p = eqx.tree_at(where, design, where(design) + change)
        ends.append(sensitivity(trim(p, flight, hover.residual, hover.z), where))
    near = [np.array([e.exponents[np.argmin(np.abs(e.exponents - v))] for v in found.exponents]) for e in ends]
    slopes = (near[0] - near[1]) / (2 * step)
    np.testing.assert_allclose(found.exponents_by, slopes, atol=1e-6 * np.abs(slopes).max())
    frequencies = np.array([0.1, 1.0])
    value, slope = found.response(frequencies)
    far = (ends[0].response(frequencies)[0] - ends[1].response(frequencies)[0]) / (2 * step)
    np.testing.assert_allclose(slope, far, atol=1e-6 * np.abs(far).max())
    np.testing.assert_allclose(value, average(linear_rotor(base_of(hover), ["theta_0"], ["CT"])).response(frequencies))
