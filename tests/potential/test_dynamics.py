from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from derivatives import both_ways

from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.potential.dynamics import (
    InflowInputs,
    axial_velocity,
    costates,
    flow_matrices,
    hover_inputs,
    mean_induced_inflow,
    rhs,
    with_ground,
)
from rotorjax.potential.field import axial_functions, pressure_functions
from rotorjax.potential.matrices import apparent_mass, damping, influence
from rotorjax.potential.model import finite_state_model, mean_inflow, steady_state
from rotorjax.potential.modes import rotor_modes
from rotorjax.potential.skewed import skewed_functions

cylinder_model = partial(finite_state_model, printed=True, strengths="closed")  # the linear flow of a cylinder

CT = 0.006
V0 = np.sqrt(CT / 2)


def tau_of(model, ct=CT):
    return jnp.zeros(len(model.modes)).at[0].set(np.sqrt(3) / 4 * ct)


@partial(jax.jit, static_argnums=(3,))
def march(model, inputs, psi, skewed=False):
    """Fourth-order Runge–Kutta from rest, inputs linear between the instants."""

    def slope(a, i):
        return rhs(jnp.array(0.0), with_ground(a, model), i, model, skewed).a

    def step(a, row):
        h, first, last = row
        middle = jax.tree.map(lambda p, q: (p + q) / 2, first, last)
        k1 = slope(a, first)
        k2 = slope(a + h / 2 * k1, middle)
        k3 = slope(a + h / 2 * k2, middle)
        k4 = slope(a + h * k3, last)
        a = a + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return a, a

    first, last = (jax.tree.map(lambda v, s=s: v[s], inputs) for s in (slice(None, -1), slice(1, None)))
    start = jnp.zeros(inputs.tau.shape[1])
    return jnp.concatenate([start[None], jax.lax.scan(step, start, (jnp.diff(psi), first, last))[1]])


@pytest.mark.parametrize("mass_flow", ["paper", "linear"])
@pytest.mark.parametrize("skewed", [False, True])
@pytest.mark.parametrize("even_terms", [0, 2])
def test_equilibrium_in_hover_is_the_steady_model(mass_flow, skewed, even_terms):
    model = cylinder_model(
        plane(1.0, 15.0), harmonics=1, ground_harmonics=1, mass_flow=mass_flow, even_terms=even_terms
    )
    tau = jnp.where(model.modes.odd, 1e-4, 0.0).at[0].set(2.6e-3)
    state = steady_state(model, tau)
    rate = rhs(jnp.array(0.0), state, hover_inputs(tau), model, skewed)
    np.testing.assert_allclose(rate.a, 0, atol=1e-15)  # each term is about 4e-3
    np.testing.assert_allclose(rate.c, 0, atol=1e-15)
    np.testing.assert_allclose(with_ground(state.a, model).c, state.c, rtol=1e-14)


def test_mass_flow_in_forward_flight():
    model = cylinder_model(harmonics=1, radial_terms=2)
    a = jnp.zeros(6).at[0].set(0.03)
    inputs = InflowInputs(jnp.zeros(6), jnp.array(0.15), jnp.array(0.01))
    v, inverse = flow_matrices(a, inputs, model)
    induced = 2 / np.sqrt(3) * float((inverse @ a)[0])
    through = 0.01 + induced
    speed = np.hypot(0.15, through)
    np.testing.assert_allclose(v[0], speed, rtol=1e-14)
    np.testing.assert_allclose(v[1:], (0.15**2 + through * (through + induced)) / speed, rtol=1e-13)
    straight, identity = flow_matrices(a, inputs, model, skewed=False)
    np.testing.assert_allclose(identity, np.eye(6))
    assert np.all(straight > 0)


def test_frequency_response_of_one_state_is_first_order():
    """dλ₀/dτ₁ = (2/√3)/(2V₀ + iω M/D) with V = V₀ + δλ: the linearised scalar equation."""
    model = cylinder_model(radial_terms=1)
    tau = tau_of(model)
    state = steady_state(model, tau)

    def f(a, tau):
        return rhs(jnp.array(0.0), with_ground(a, model), hover_inputs(tau), model).a

    by_a, by_tau = jax.jacfwd(f)(state.a, tau)[0, 0], jax.jacfwd(f, argnums=1)(state.a, tau)[0, 0]
    ratio = 0.75 / (np.pi / 2)  # M/D
    np.testing.assert_allclose(by_a, -2 * V0 / ratio, rtol=1e-12)
    np.testing.assert_allclose(by_tau, 1 / ratio, rtol=1e-12)


@pytest.mark.parametrize("mass_flow", ["paper", "linear"])
def test_step_response_against_carpenter_and_fridovich(mass_flow):
    """0.849 λ' + 2λ² = C_T from rest: λ = v₀ tanh(2v₀ψ/0.849); within 5 % of v₀ at all times (NACA TN 3044)."""
    model = cylinder_model(radial_terms=4, mass_flow=mass_flow)
    psi = jnp.linspace(0, 60, 1201)
    a = march(model, hover_inputs(jnp.broadcast_to(tau_of(model), (1201, 4))), psi)
    lam = jax.vmap(lambda a: mean_inflow(with_ground(a, model), model))(a)
    exact = V0 * np.tanh(2 * V0 / (8 / (3 * np.pi)) * np.array(psi))
    assert np.abs(lam - exact).max() < 0.05 * V0
    np.testing.assert_allclose(lam[-1], V0, rtol=1e-3)


def test_first_acceleration_is_that_of_an_impermeable_disk():
    """The apparent mass 8/3π, approached from below as radial terms are added."""
    errors = []
    for terms in (1, 3, 7):
        model = cylinder_model(radial_terms=terms)
        rate = rhs(jnp.array(0.0), with_ground(jnp.zeros(terms), model), hover_inputs(tau_of(model)), model)
        errors.append(1 - float(mean_inflow(rate, model)) / (3 * np.pi / 8 * CT))
    assert errors[0] > 4 * errors[1] > 8 * errors[2] > 0
    assert errors[2] < 0.006


WINDOW = jnp.linspace(0, 200, 4001)


def oscillation(model, omega):
    """States and costates of τ₁ = sin ωψ in a climb of 1, where the induced flow does not matter."""
    d, mass = damping(model.modes, model.modes), apparent_mass(model.modes, model.modes)
    response = np.linalg.solve(1j * omega * mass + d, d[:, 0]) * 1e-7
    a = jnp.array((np.exp(1j * omega * np.array(WINDOW))[:, None] * response).imag)
    tau = jnp.zeros_like(a).at[:, 0].set(1e-7 * jnp.sin(omega * WINDOW))
    inputs = InflowInputs(tau, jnp.zeros_like(WINDOW), jnp.ones_like(WINDOW))
    return a, costates(WINDOW, a, inputs, model, skewed=False)


def along_streamline(model, x, z, omega, time):
    """∫ ∂Φ₁/∂z̄ sin ω(t−s) ds along the path of the fluid particle: the exact linear flow at unit speed."""
    node, weight = np.polynomial.legendre.leggauss(40)
    node, weight = (node + 1) / 2, weight / 2
    edges = np.concatenate([np.linspace(0, 5 + abs(z), 11), np.linspace(5 + abs(z), 180, 60)[1:]])
    edges = np.sort(np.append(edges, max(-z, 0)))
    s = (edges[:-1, None] + np.diff(edges)[:, None] * node).ravel()
    step = (np.diff(edges)[:, None] * weight).ravel()
    points = jnp.stack([jnp.full(s.size, x), jnp.zeros(s.size), jnp.array(z + s)], axis=-1)
    up = jnp.zeros_like(points).at[:, 2].set(1.0)
    slope = -jax.jvp(lambda p: pressure_functions(model.modes, p)[0], (points,), (up,))[1]
    return float(slope @ (step * np.sin(omega * (time - s))))


@pytest.mark.parametrize("omega", [0.3, 1.0])
def test_unsteady_flow_everywhere_against_integration_along_streamlines(omega):
    time, places = 120.0, [(0.4, 0.5), (0.4, -0.5), (0.4, -2.0), (1.5, -1.0)]
    exact = [along_streamline(cylinder_model(radial_terms=1), x, z, omega, time) for x, z in places]
    points, errors = jnp.array([[x, 0.0, z] for x, z in places]), []
    for odd, even in ((4, 0), (4, 3), (7, 7)):
        model = cylinder_model(radial_terms=odd, even_terms=even)
        a, delta = oscillation(model, omega)
        mine = axial_velocity(jnp.array(time), points, WINDOW, a, delta, jnp.array(1.0), model) * 1e7
        errors.append(np.abs(mine - np.array(exact)).max())
    assert errors[2] < errors[1] < errors[0]
    assert errors[2] < 0.04  # of an amplitude of about 2.5


def test_steady_unsteady_flow_is_the_steady_field():
    model = cylinder_model(harmonics=1)
    tau = jnp.full(9, 1e-4).at[0].set(2.6e-3)
    a = jnp.broadcast_to(steady_state(model, tau).a, (50, 9))
    psi = jnp.linspace(0, 30, 50)
    delta = costates(psi, a, hover_inputs(jnp.broadcast_to(tau, (50, 9))), model)
    np.testing.assert_allclose(delta, a, rtol=1e-12)
    points = jnp.array([[0.3, 0.2, 0.4], [0.3, 0.2, -0.7], [1.4, 0.0, -0.3]])
    mine = axial_velocity(jnp.array(25.0), points, psi, a, delta, jnp.array(V0), model)
    np.testing.assert_allclose(mine, a[0] @ axial_functions(model.modes, points), rtol=1e-11)


@pytest.mark.slow
def test_skewed_steady_flow_below_the_disk_against_the_exact_one():
    """Costates in the reversed stream; with the skew not reversed the error is many times larger."""
    chi, errors = np.deg2rad(30.0), []
    points = jnp.array([[0.3, 0.2, -0.4], [0.6, -0.3, -1.0], [0.2, 0.4, -0.7], [-1.4, 0.0, -0.3]])
    exact = -skewed_functions(rotor_modes(0, 1), points, jnp.array(chi))[2, 0]
    for harmonics, terms in ((1, 1), (3, 2), (5, 3)):
        model = cylinder_model(harmonics=harmonics, radial_terms=terms, mass_flow="linear")
        count = len(model.modes)
        tau = jnp.zeros(count).at[0].set(1e-7)
        inputs = InflowInputs(jnp.zeros((2, count)) + tau, jnp.full(2, np.sin(chi)), jnp.full(2, np.cos(chi)))
        l = influence(model.modes, model.modes, jnp.array(np.tan(chi / 2)))
        mass = jnp.array(apparent_mass(model.modes, model.modes))
        a = jnp.broadcast_to(jnp.linalg.solve(mass, l @ tau), (2, count))
        psi = jnp.array([0.0, 9.0])
        delta = costates(psi, a, inputs, model)
        flow = [axial_velocity(psi[1], points, psi, a, d, jnp.array(1.0), model, chi) * 1e7 for d in (delta, a)]
        errors.append([float(jnp.sqrt(jnp.mean((f - exact) ** 2))) for f in flow])
    right, wrong = np.array(errors).T
    assert right.max() < 0.08  # of 3
    assert wrong[2] > 3 * right[2]


def test_costates_forget_the_end_of_the_window_and_stay_bounded_for_fifty_revolutions():
    model = cylinder_model()
    psi = jnp.linspace(0, 100 * np.pi, 2001)
    tau = tau_of(model) * (1 + 0.3 * jnp.sin(0.1 * psi))[:, None]
    inputs = hover_inputs(tau)
    a = march(model, inputs, psi)
    whole, half = costates(psi, a, inputs, model), costates(psi[:1001], a[:1001], hover_inputs(tau[:1001]), model)
    assert np.abs(whole[100:]).max() < 1.5 * np.abs(a).max()  # after the start from rest, where nothing decays
    np.testing.assert_allclose(whole[:150], half[:150], atol=1e-8)  # 130 rad before the nearer end: e^{−15}
    d, mass = damping(model.modes, model.modes), apparent_mass(model.modes, model.modes)
    v = flow_matrices(a[-1], jax.tree.map(lambda x: x[-1], inputs), model)[0]
    growth = np.linalg.eigvals(np.linalg.solve(mass, d * np.array(v)[None]))
    assert np.exp(growth.real.min() * 100 * np.pi) > 1e12  # the same march forward in time


def test_costates_are_second_order():
    model, errors = cylinder_model(), []

    def run(steps):
        psi = jnp.linspace(0, 40, steps + 1)
        tau = tau_of(model) * (1 + 0.3 * jnp.sin(0.5 * psi))[:, None]
        a = jnp.broadcast_to(steady_state(model, tau_of(model)).a, tau.shape)
        return costates(psi, a, hover_inputs(tau), model)[0]

    fine = run(3200)
    errors = np.array([np.abs(run(n) - fine).max() for n in (50, 100, 200)])
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 2, atol=0.2)


@pytest.mark.parametrize("mu", [0.0, 0.1])
def test_derivative_ladder(mu):
    model = cylinder_model(plane(1.0, 10.0), harmonics=1, radial_terms=2, ground_harmonics=1)
    tau = jnp.full(6, 2e-4).at[0].set(2.6e-3)

    @jax.jit
    def f(v):
        inputs = InflowInputs(v[6:12], v[12], v[13])
        return rhs(jnp.array(0.0), with_ground(v[:6], model), inputs, model).a

    v = jnp.concatenate([jnp.linspace(0.05, 0.01, 6), tau, jnp.array([mu, 0.01])])
    forward, reverse = both_ways(f)(v)
    step = 1e-6
    differences = np.stack([(f(v + step * e) - f(v - step * e)) / (2 * step) for e in np.eye(14)], axis=-1)
    np.testing.assert_allclose(forward, differences, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(forward, reverse, rtol=1e-10, atol=1e-13)


def test_rest_has_finite_derivatives():
    model = cylinder_model()
    tau = tau_of(model)
    slope = jax.jacrev(lambda a: rhs(jnp.array(0.0), with_ground(a, model), hover_inputs(tau), model).a)(jnp.zeros(3))
    assert np.all(np.isfinite(slope))
    assert mean_induced_inflow(jnp.zeros(3), model) == 0


def test_bad_shapes_are_refused():
    model = cylinder_model()
    with pytest.raises(InputError, match="share T and M"):
        costates(jnp.arange(4.0), jnp.zeros((5, 3)), hover_inputs(jnp.zeros((5, 3))), model)
