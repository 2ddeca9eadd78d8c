import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from derivatives import both_ways

from rotorjax.errors import InputError
from rotorjax.ground import Plane, plane
from rotorjax.potential import loading
from rotorjax.potential.contraction import Contraction
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.model import (
    FiniteState,
    FiniteStateModel,
    disk_inflow,
    finite_state_model,
    ground_normal_velocity_rms,
    inflow,
    mass_flow_parameters,
    mean_inflow,
    steady_state,
    velocity,
)
from rotorjax.potential.modes import rotor_modes

CT = 0.006
ONE_TERM = jnp.array([np.sqrt(3) / 4 * CT])
THREE_TERMS = jnp.array([np.sqrt(3) / 4 * CT, 5e-4, 2e-4])
R, PSI = jnp.array([0.3, 0.6, 0.9]), jnp.array([0.0, np.pi / 2, np.pi])


CYLINDER = {"printed": True, "strengths": "closed"}  # the paper's choices, but for strengths that close the plane


def ratio(height, **settings):
    model = finite_state_model(plane(height), radial_terms=1, **CYLINDER | settings)
    return float(mean_inflow(steady_state(model, ONE_TERM), model) / np.sqrt(CT / 2))


def test_one_term_gives_momentum_theory():
    model = finite_state_model(radial_terms=1)
    np.testing.assert_allclose(mean_inflow(steady_state(model, ONE_TERM), model), np.sqrt(CT / 2), rtol=1e-14)


@pytest.mark.parametrize(
    ("height", "paper", "no_factor"),
    [
        (0.5, 0.302, 0.107),
        (0.75, 0.525, 0.222),
        (1, 0.699, 0.323),
        (1.5, 0.895, 0.474),
        (2, 0.963, 0.577),
        (3, 0.991, 0.700),
    ],
)
def test_mean_inflow_ratio_of_the_printed_equations(height, paper, no_factor):
    """Computed independently with mpmath and the trapezoidal rule, j = 0, 2, 4; rounded to three digits."""
    assert abs(ratio(height, ground_radial_terms=3) - paper) < 6e-4
    assert abs(ratio(height, ground_radial_terms=3, b=1.0) - no_factor) < 6e-4


@pytest.mark.parametrize(
    ("height", "without"), [(0.5, 0.822), (0.75, 0.875), (1, 0.913), (1.5, 0.955), (2, 0.975), (3, 0.991)]
)
def test_mean_inflow_ratio_without_the_diagonal_terms(height, without):
    model = finite_state_model(plane(height), radial_terms=1, ground_radial_terms=3, **CYLINDER)
    state = steady_state(model, ONE_TERM)
    state = eqx.tree_at(lambda s: s.c, state, jnp.where(model.sources.diagonal, 0.0, state.c))
    assert abs(float(mean_inflow(state, model) / np.sqrt(CT / 2)) - without) < 6e-4
    assert ground_normal_velocity_rms(state, model) > 0.5


@pytest.mark.parametrize(
    ("height", "slope"), [(0.5, 0), (1, 0), (3, 0), (1, 15), (1, 30), (1, 40), (0.9, 30), (1.5, 30)]
)
def test_ground_condition_holds_to_three_percent(height, slope):
    model = finite_state_model(plane(height, slope), ground_harmonics=1)
    assert 1e-4 < ground_normal_velocity_rms(steady_state(model, ONE_TERM_OF_THREE), model) < 0.03


ONE_TERM_OF_THREE = jnp.array([np.sqrt(3) / 4 * CT, 0, 0])


def test_more_source_terms_leave_less():
    left = []
    for terms in (2, 4, 7):
        model = finite_state_model(plane(1.0), ground_radial_terms=terms)
        left.append(ground_normal_velocity_rms(steady_state(model, THREE_TERMS), model))
    assert left[0] > 1.5 * left[1] > 2 * left[2]


def test_odd_sources_need_no_factor():
    """Closing the plane outside the disk too brings the cylinder to its exact image without calibration."""
    exact = {0.5: 0.3435, 1.0: 0.6086, 2.0: 0.8373, 3.0: 0.9161}
    for height, value in exact.items():
        assert abs(ratio(height, ground_parity="odd", ground_radial_terms=4) - value) < 0.05


def test_far_ground_is_no_ground():
    for height, choices in ((30.0, CYLINDER), (300.0, {})):  # odd sources have a mean flux, felt as 1/h²
        model, free = finite_state_model(plane(height), **choices), finite_state_model(**choices)
        pair = [inflow(steady_state(m, THREE_TERMS), R, PSI, m) for m in (model, free)]
        np.testing.assert_allclose(pair[0], pair[1], rtol=1e-4)


def test_parities_must_match_their_use():
    model = finite_state_model(printed=True)
    with pytest.raises(InputError, match=r"`modes` .* but has none"):
        FiniteStateModel(model.sources, model.sources, None, model.correction, model.quadrature, "paper")
    both = rotor_modes(0, 2, 1)
    with pytest.raises(InputError, match="parity 'both'"):
        FiniteStateModel(model.modes, both, None, model.correction, model.quadrature, "paper")


def test_mass_flow_options():
    tau = jnp.full(9, 1e-3).at[0].set(THREE_TERMS[0])
    v = np.sqrt(CT / 2)
    for mass_flow, factor in {"paper": [1] + [2] * 8, "linear": [1] * 9, "harmonics": [1] * 3 + [2] * 6}.items():
        model = finite_state_model(harmonics=1, **CYLINDER | {"mass_flow": mass_flow})
        np.testing.assert_allclose(mass_flow_parameters(model, tau), v * np.array(factor), rtol=1e-14)


@pytest.mark.parametrize("height", [0.05, 0.2])
def test_the_default_keeps_its_inflow_downward_near_the_ground(height):
    model = finite_state_model(plane(height))
    assert 0.1 < float(mean_inflow(steady_state(model, UH60), model)) / np.sqrt(CT / 2) < 0.5


@pytest.mark.parametrize("climb", [0.0, 0.03])
@pytest.mark.parametrize("choices", [{}, CYLINDER | {"ground_in_mass_flow": True}], ids=["default", "cylinder"])
def test_the_mass_flow_is_that_of_the_inflow_that_the_disk_has(choices, climb):
    model = finite_state_model(plane(0.8, 20.0), 1, ground_harmonics=1, **choices)
    tau = jnp.array([2.6e-3, -1.6e-3, 6e-4, 2e-4, 1e-4, -1e-4, 3e-5, 0, 0])
    v, state = mass_flow_parameters(model, tau, climb), steady_state(model, tau, climb)
    induced = float(mean_inflow(state, model))
    np.testing.assert_allclose(v[0], climb + induced, rtol=1e-9)
    np.testing.assert_allclose(v[-1], climb + 2 * induced, rtol=1e-9)


def test_a_wake_that_contracts_keeps_momentum_theorys_mean_inflow():
    model = finite_state_model(radial_terms=1)
    state = steady_state(model, ONE_TERM)
    np.testing.assert_allclose(mean_inflow(state, model), np.sqrt(CT / 2), rtol=1e-12)
    x, y, nu, weights = (jnp.asarray(v) for v in DiskQuadrature(200, 1).rule())
    np.testing.assert_allclose(2 * nu * weights @ disk_inflow(state, x, y, model), np.sqrt(CT / 2), rtol=1e-4)


def test_the_mean_inflow_is_that_of_the_disk():
    model = finite_state_model(plane(0.8, 20.0), 1, ground_harmonics=1)
    state = steady_state(model, jnp.zeros(9).at[:4].set(jnp.array([2.6e-3, -1.6e-3, 6e-4, 2e-4])))
    x, y, nu, weights = (jnp.asarray(v) for v in DiskQuadrature(60, 16).rule())
    mean = 2 * nu * weights @ disk_inflow(state, x, y, model)
    np.testing.assert_allclose(mean_inflow(state, model), mean, rtol=1e-4)


@pytest.mark.parametrize("thrust", [0.0, -1e-3, 1e-12])
def test_a_loading_without_thrust_gives_finite_numbers(thrust):
    """A Newton step may pass there; under a downward thrust the mirrored rotor's mass flow is taken."""
    model = finite_state_model()
    tau = jnp.array([thrust, 1e-4, 0.0])
    value, slopes = steady_state(model, tau).a, jax.jacrev(lambda tau: steady_state(model, tau).a)(tau)
    assert np.all(np.isfinite(value))
    assert np.all(np.isfinite(slopes))
    if thrust < 0:
        down = steady_state(model, -tau).a
        np.testing.assert_allclose(value, -down, rtol=1e-6)


# of the free wake's loads of the UH-60 out of ground effect at 18°
UH60 = jnp.array([2.632e-3, -1.652e-3, 6.03e-4])
TABLE = {0.5: 0.676, 0.75: 0.786, 1.0: 0.872, 1.5: 0.967, 2.0: 0.996, 3.0: 1.001}


@pytest.mark.parametrize("height", TABLE)
def test_the_printed_strengths_meet_hayden_at_one_radius(height):
    """Eqs. 38 to 41 as printed, with the printed π/7: an independent code's numbers, and Hayden's 0.874 at h = 1."""
    model, free = (finite_state_model(g, printed=True) for g in (plane(height), None))
    found = float(mean_inflow(steady_state(model, UH60), model) / mean_inflow(steady_state(free, UH60), free))
    assert abs(found - TABLE[height]) < 0.005
    if height == 1.0:
        assert abs(found - 0.874) < 0.01
        assert ground_normal_velocity_rms(steady_state(model, UH60), model) > 0.3  # the price


@pytest.mark.parametrize("height", [0.5, 1.0])
def test_level_sources_do_not_care_whether_a_slope_would_tilt_or_shear_them(height):
    """To the last bit but for two orders of the same sums."""
    pair = [finite_state_model(plane(height), 1, ground_harmonics=1, slope=s) for s in ("tilted", "sheared")]
    tau = jnp.zeros(9).at[:3].set(UH60)
    lam = [inflow(steady_state(m, tau), R, PSI, m) for m in pair]
    np.testing.assert_allclose(lam[0], lam[1], rtol=1e-13)


def test_mountain_side_has_less_inflow_and_the_difference_grows():
    tau, differences = ONE_TERM_OF_THREE, []
    for slope in (0.0, 5.0, 8.0, 10.0, 15.0, 30.0):
        model = finite_state_model(plane(1.0, slope), ground_harmonics=1)
        lam = inflow(steady_state(model, tau), R, jnp.array([0.0, np.pi]), model)
        differences.append(lam[1] - lam[0])
    differences = np.array(differences)
    np.testing.assert_allclose(differences[0], 0, atol=1e-15)
    assert np.all(np.diff(differences, axis=0) > 0)


def test_slope_is_symmetric_about_its_own_plane():
    model = finite_state_model(plane(1.0, 20.0), ground_harmonics=2)
    state = steady_state(model, THREE_TERMS)
    psi = jnp.array([0.4, 1.3, 2.5])
    np.testing.assert_allclose(inflow(state, R, psi, model), inflow(state, R, -psi, model), rtol=1e-13)


def test_velocity_on_the_disk_is_minus_the_inflow_and_continuous_below():
    model = finite_state_model(plane(1.0, 10.0), harmonics=1, ground_harmonics=1)
    state = steady_state(model, jnp.full(9, 2e-4).at[0].set(2.6e-3))
    points = jnp.array([[0.5, 0.2, 0.0], [0.5, 0.2, -1e-9], [0.5, 0.2, 1e-9]])
    v = velocity(state, points, model)
    r, psi = jnp.hypot(0.5, 0.2)[None], jnp.arctan2(0.2, 0.5)[None]
    np.testing.assert_allclose(-v[0, 2], inflow(state, r, psi, model)[0, 0], rtol=1e-13)
    np.testing.assert_allclose(v[1:], v[:1].repeat(2, axis=0), atol=1e-9)


def test_velocity_at_the_ground_sums_to_the_residual():
    model = finite_state_model(plane(1.0), ground_radial_terms=7)
    state = steady_state(model, ONE_TERM_OF_THREE)
    r = jnp.linspace(0.05, 0.65, 9)  # inside the wake, contracted or not
    v = velocity(state, jnp.stack([r, 0 * r, 0 * r - 1.0], axis=-1), model)
    far = velocity(state, jnp.stack([r, 0 * r, 0 * r - 1.0], axis=-1), finite_state_model())
    assert np.all(np.abs(v[:, 2]) < 0.04 * np.abs(far[:, 2]))


def printed_outcome(v, tau):
    """Inflow at nine points from (height, slope, b, p) and τ, as printed."""
    model = finite_state_model(plane(1.0), ground_harmonics=1, printed=True)
    model = eqx.tree_at(lambda m: (m.ground, m.correction.b, m.correction.p), model, (Plane(v[0], v[1]), v[2], v[3]))
    return inflow(steady_state(model, tau), R, PSI, model).ravel()


def outcome(v, tau):
    """Inflow at nine points from (height, slope, and the wake's radius, length and clearance) and τ."""
    model = finite_state_model(plane(1.0), ground_harmonics=1)
    model = eqx.tree_at(lambda m: (m.ground, m.wake), model, (Plane(v[0], v[1]), Contraction(v[2], v[3], v[4])))
    return inflow(steady_state(model, tau), R, PSI, model).ravel()


@pytest.mark.parametrize(
    ("outcome", "v"), [(outcome, [1.1, 0.3, 0.75, 0.2, 0.9]), (printed_outcome, [1.1, 0.3, 0.4, 1.6])]
)
def test_derivative_ladder(outcome, v):
    count = len(v)
    f, x = jax.jit(lambda x: outcome(x[:count], x[count:])), jnp.concatenate([jnp.array(v), THREE_TERMS])
    forward, reverse = both_ways(f)(x)
    steps = np.diag([1e-5] * count + [1e-8] * 3)
    near = np.stack([(f(x + step) - f(x - step)) / (2 * step.sum()) for step in steps], -1)
    np.testing.assert_allclose(forward[:, :count], near[:, :count], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(forward[:, count:], near[:, count:], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(forward[:, :count], reverse[:, :count], rtol=1e-11, atol=1e-14)
    np.testing.assert_allclose(forward[:, count:], reverse[:, count:], rtol=1e-11, atol=1e-12)


def test_many_grounds_in_one_call():
    heights, slopes = jnp.meshgrid(jnp.linspace(0.8, 3.0, 8), jnp.linspace(0, 0.6, 5), indexing="ij")
    wake = jnp.broadcast_to(jnp.array([0.75, 0.2, 0.9]), (40, 3))
    v = jnp.concatenate([jnp.stack([heights.ravel(), slopes.ravel()], axis=-1), wake], axis=-1)
    batch = jax.jit(jax.vmap(lambda v: outcome(v, THREE_TERMS)))(v)
    assert batch.shape == (40, 9)
    for i in (0, 23, 39):
        np.testing.assert_allclose(batch[i], outcome(v[i], THREE_TERMS), rtol=1e-12)


def test_no_ground_has_no_sources():
    model = finite_state_model()
    state = steady_state(model, THREE_TERMS)
    assert isinstance(state, FiniteState)
    assert not np.any(state.c)
    np.testing.assert_allclose(loading.thrust_coefficient(THREE_TERMS, model.modes), CT, rtol=1e-14)


def test_bad_input_is_refused():
    with pytest.raises(InputError, match="mass_flow"):
        finite_state_model(mass_flow="twice")  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="ground_parity"):
        finite_state_model(ground_parity="both")  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="`b` must come with ground_parity='even'"):
        finite_state_model(b=0.4)
    with pytest.raises(InputError, match=r"`height` must be at least 0\.2 .* inflow is negative below, but is 0\.1"):
        finite_state_model(plane(0.1), **CYLINDER)
    with pytest.raises(InputError, match="`slope` must be 'sheared'"):
        finite_state_model(ground_parity="even")
    with pytest.raises(InputError, match="tau"):
        steady_state(finite_state_model(), jnp.ones(4))
    model = finite_state_model()
    with pytest.raises(InputError, match="ground"):
        ground_normal_velocity_rms(steady_state(model, THREE_TERMS), model)
