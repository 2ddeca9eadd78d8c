import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.model import finite_state_model, inflow, mean_inflow, steady_state
from rotorjax.potential.rotors import inflow_at, inflows, mean_inflows, rates, rotors, steady, velocity

CT = 0.006
V0 = np.sqrt(CT / 2)
SIZE = {"harmonics": 1, "radial_terms": 1, "quadrature": DiskQuadrature(12, 16)}
CYLINDER = {"printed": True, "strengths": "closed"}  # wakes that do not contract
MODEL = finite_state_model(**SIZE, **CYLINDER)
TAU = jnp.zeros(3).at[0].set(np.sqrt(3) / 4 * CT)


def solve(positions, model=MODEL, tau=TAU, **settings):
    system = rotors(model, positions, **settings)
    return system, steady(system, jnp.broadcast_to(tau, (len(positions), tau.size)))


def test_one_rotor_is_momentum_theory():
    system, a = solve([(0, 0, 0)])
    np.testing.assert_allclose(mean_inflows(a, system), V0, rtol=1e-12)


def test_coaxial_pair_together_is_one_rotor_of_twice_the_thrust():
    system, a = solve([(0, 0, 0), (0, 0, -1e-4)])
    np.testing.assert_allclose(mean_inflows(a, system), np.sqrt(2) * V0, rtol=1e-3)


def test_coaxial_pair_far_apart():
    """The upper rotor is on its own; the lower climbs at 2 v₀ in its uncontracted far wake: λ_i (2v₀ + λ_i) = v₀²."""
    system, a = solve([(0, 0, 0), (0, 0, -40.0)])
    upper, lower = mean_inflows(a, system)
    np.testing.assert_allclose(upper, V0, rtol=1e-3)
    np.testing.assert_allclose(lower, (1 + np.sqrt(2)) * V0, rtol=1e-3)


def test_a_contracted_wake_brings_half_of_the_flow():
    """Momentum theory's slipstream: 2 v₀ over half of the lower disk, λ (λ − v₀) = v₀²."""
    system, a = solve([(0, 0, 0), (0, 0, -40.0)], finite_state_model(**SIZE))
    upper, lower = mean_inflows(a, system)
    np.testing.assert_allclose(upper, V0, rtol=2e-3)
    np.testing.assert_allclose(lower, (1 + np.sqrt(5)) / 2 * V0, rtol=1e-2)


def test_coaxial_pair_between():
    """Inflow of the upper rotor falls, of the lower one grows with their distance."""
    means = np.array(
        [mean_inflows(solve([(0, 0, 0), (0, 0, -d)])[1], solve([(0, 0, 0), (0, 0, -d)])[0]) for d in (0.1, 0.5, 2.0)]
    )
    assert np.all(np.diff(means[:, 0]) < 0)
    assert np.all(np.diff(means[:, 1]) > 0)


def test_side_by_side_in_one_plane_do_not_feel_each_other():
    """A straight wake has no axial flow in its disk's plane outside the disk."""
    system, a = solve([(0, 0, 0), (0, 2.05, 0)])
    np.testing.assert_allclose(mean_inflows(a, system), V0, rtol=1e-12)


def test_side_by_side_at_two_heights_tend_to_isolated_ones():
    """The lower one sits in the weak upwash beside the wake, the upper one above it; both die out with the distance."""
    less = []
    for gap in (2.1, 3.0, 5.0, 9.0, 17.0):
        system, a = solve([(0, 0, 0), (0, gap, -0.5)])
        less.append(np.array(mean_inflows(a, system)) / V0 - 1)
    upper, lower = np.array(less).T
    assert np.all(upper > 0)
    assert np.all(lower < 0)
    assert np.all(np.diff(upper) < 0)
    assert np.all(np.diff(lower) > 0)
    assert lower[0] < -0.005
    assert abs(lower[-1]) < 1e-4


def test_quadrotor_has_its_symmetry_and_senses_mirror():
    places = [(1.2, 1.2, 0), (1.2, -1.2, 0), (-1.2, 1.2, 0.3), (-1.2, -1.2, 0.3)]
    tau = TAU.at[2].set(2e-4)  # sine harmonic: advancing against retreating side
    system, a = solve(places, tau=tau, senses=[1, -1, -1, 1])
    np.testing.assert_allclose(a[0], a[1], rtol=1e-9)
    np.testing.assert_allclose(a[2], a[3], rtol=1e-9)
    flow = velocity(a, jnp.array([[0.5, 0.7, -0.5], [0.5, -0.7, -0.5]]), system)
    np.testing.assert_allclose(flow[0], flow[1] * np.array([1, -1, 1]), atol=1e-12)
    assert inflows(a, system).shape == (4, 12 * 16)


def test_whole_system_tilted_is_the_same_system():
    level, a = solve([(0, 0, 0), (0, 0, -0.7)])
    angle = np.deg2rad(20)
    system, b = solve([(0, 0, 0), (-0.7 * np.sin(angle), 0, -0.7 * np.cos(angle))], tilts_deg=[(0, 20), (0, 20)])
    np.testing.assert_allclose(b, a, rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(mean_inflows(b, system), mean_inflows(a, level), rtol=1e-10)


@pytest.mark.parametrize(("choices", "tolerance"), [({}, 1e-6), (CYLINDER, 1e-12)], ids=["default", "cylinder"])
def test_one_rotor_over_ground_is_the_steady_model(choices, tolerance):
    ground = plane(1.2)
    size = SIZE if choices else SIZE | {"quadrature": DiskQuadrature(24, 16)}  # a contracting wake asks for more nodes
    model = finite_state_model(ground, ground_harmonics=1, **size, **choices)
    system, a = solve([(0, 0, 0.2)], model, ground=plane(1.0))
    state = steady_state(model, TAU)
    np.testing.assert_allclose(mean_inflows(a, system)[0], mean_inflow(state, model), rtol=tolerance)
    r, psi = jnp.array([0.3, 0.7, 0.95]), jnp.array([0.0, 2.0])
    np.testing.assert_allclose(inflow_at(a, r, psi, system)[0], inflow(state, r, psi, model), rtol=tolerance)


def test_rates_vanish_in_steady_state_and_differentiate():
    system, a = solve([(0, 0, 0), (1.5, 0, -0.5)])
    tau, climb = jnp.broadcast_to(TAU, (2, 3)), jnp.zeros(2)
    np.testing.assert_allclose(rates(jnp.zeros(()), a, tau, climb, system), 0, atol=1e-12)

    def f(v):
        return rates(jnp.zeros(()), v.reshape(2, 3), tau, climb + 0.01, system).ravel()

    v, step = a.ravel(), 1e-6
    differences = np.stack([(f(v + step * e) - f(v - step * e)) / (2 * step) for e in np.eye(6)], axis=-1)
    np.testing.assert_allclose(jax.jacfwd(f)(v), differences, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(jax.jacrev(f)(v), jax.jacfwd(f)(v), atol=1e-13)


@pytest.mark.parametrize(
    ("settings", "match"),
    [
        ({"positions": [(0, 0, 0), (1.9, 0, 0)]}, "rotors 0 and 1 .* overlap"),
        ({"positions": [(0, 0, 0), (0.5, 0, 0.1)], "tilts_deg": [(0, 0), (0, 30)]}, "overlap"),
        ({"positions": [(0, 0)]}, r"have \(1, 2\)"),
        ({"positions": [(0, 0, 0)], "senses": [0]}, r"but is \[0\.0\]"),
        ({"positions": [(0, 0, -1.5)], "ground": plane(1.0)}, r"rotor 0 is -0\.5 R over it"),
        ({"positions": [(0, 0, 0)], "ground": plane(1.0), "tilts_deg": [(5, 0)]}, "must be zero over ground"),
    ],
)
def test_bad_input(settings, match):
    with pytest.raises(InputError, match=match):
        rotors(MODEL, **settings)


def test_loads_of_another_shape_are_refused():
    with pytest.raises(InputError, match=r"must have shape \(1, 3\)"):
        steady(rotors(MODEL, [(0, 0, 0)]), jnp.zeros((2, 3)))
