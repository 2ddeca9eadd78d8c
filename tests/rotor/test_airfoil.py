"""Airfoil tables: exact at nodes, C1, periodic, bounded, differentiable; the Prandtl-Glauert rule."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.rotor import airfoil, airfoil_io, catalogue
from rotorjax.rotor.airfoil import airfoil_table, linear_airfoil, prandtl_glauert_factor
from rotorjax.rotor.catalogue import _folder

lift_drag = jax.jit(airfoil.lift_drag)  # eager, every test would compile dozens of small operations
SC1095 = catalogue.load("uh60")[0].airfoil
NACA0012 = catalogue.load("caradonna_tung")[0].airfoil


def derivative(table, argument):
    """[alpha, mach] -> derivative of (cl, cd) in alpha (argument 0) or Mach (1)."""

    def at(alpha, mach):
        return jnp.stack(lift_drag(table, alpha, mach))

    return jax.jit(jax.vmap(jax.jacfwd(at, argument)))


def test_sc1095_is_exact_at_every_node_of_its_files():
    for name, index in (("sc1095_cl.csv", 0), ("sc1095_cd.csv", 1)):
        alpha, mach, values = airfoil_io.read_alpha_mach(_folder() / name)
        read = lift_drag(SC1095, jnp.deg2rad(alpha)[:, None], mach[None, :])[index]
        assert values.shape == (33, 11)
        np.testing.assert_allclose(read, values, rtol=0, atol=1e-14)


@pytest.mark.parametrize("mach", [0.0, 0.37, 1.3])
def test_sc1095_is_exact_at_the_full_range_nodes_beyond_32_degrees(mach):
    alpha, cl, cd = airfoil_io.read_polar(_folder() / "sc1095_full_range.csv")
    outside = np.abs(alpha) > 32
    read = lift_drag(SC1095, jnp.deg2rad(alpha[outside]), jnp.asarray(mach))
    np.testing.assert_allclose(read[0], cl[outside], atol=1e-13)
    np.testing.assert_allclose(read[1], cd[outside], atol=1e-13)


def test_naca0012_is_exact_at_its_nodes_and_symmetric():
    alpha, cl, cd = airfoil_io.read_polar(_folder() / "naca0012_sandia.csv")
    for sign in (1, -1):
        read = lift_drag(NACA0012, sign * jnp.deg2rad(alpha), jnp.asarray(0.0))
        np.testing.assert_allclose(read[0], sign * cl, atol=1e-13)
        np.testing.assert_allclose(read[1], cd, atol=1e-13)


def test_naca0012_attached_flow_has_the_slope_and_drag_of_the_section():
    """Measured: 0.106 to 0.110 per degree (Abbott & von Doenhoff), drag near 0.0065 at 2 to 3 million."""
    alpha = jnp.deg2rad(jnp.arange(0.0, 9.0))
    cl, cd = lift_drag(NACA0012, alpha, jnp.asarray(0.0))
    assert 0.106 <= np.polyfit(np.arange(9), cl, 1)[0] <= 0.1101
    assert np.all((cd > 0.006) & (cd < 0.0095))


@pytest.mark.parametrize("table", [SC1095, NACA0012], ids=["sc1095", "naca0012"])
@pytest.mark.parametrize("argument", [0, 1])
def test_first_derivatives_are_continuous_across_every_node(table, argument):
    slope = derivative(table, argument)
    a, m = (x.ravel() for x in np.meshgrid(table.alpha, [0.13, 0.4, 0.55, 1.0], indexing="ij"))
    np.testing.assert_allclose(slope(a - 1e-9, m), slope(a + 1e-9, m), atol=2e-5)
    a, m = (x.ravel() for x in np.meshgrid(np.linspace(-3.1, 3.1, 41), table.mach, indexing="ij"))
    np.testing.assert_allclose(slope(a, m - 1e-9), slope(a, m + 1e-9), atol=2e-5)


def test_first_derivative_is_not_constant_so_that_continuity_means_something():
    slope = derivative(SC1095, 0)(np.deg2rad([9.0, 13.0]), np.full(2, 0.3))
    assert slope[0, 0] > 1
    assert slope[1, 0] < -1


@pytest.mark.parametrize("table", [SC1095, NACA0012], ids=["sc1095", "naca0012"])
def test_table_is_periodic(table):
    alpha = jnp.linspace(-3.1, 3.1, 57)
    for turns in (-2, 1, 3):
        for here, there in zip(
            lift_drag(table, alpha, 0.4), lift_drag(table, alpha + 2 * np.pi * turns, 0.4), strict=True
        ):
            np.testing.assert_allclose(here, there, atol=1e-12)


def test_constant_beyond_the_mach_numbers():
    for edge, beyond in ((0.0, -0.2), (1.0, 1.4)):
        at = jnp.deg2rad(jnp.array([-11.0, 3.0, 9.0]))
        np.testing.assert_array_equal(lift_drag(SC1095, at, edge), lift_drag(SC1095, at, beyond))
        np.testing.assert_allclose(derivative(SC1095, 1)(at, np.full(3, edge)), 0, atol=1e-14)


def test_monotone_in_angle_so_the_drag_never_undershoots():
    for table in (SC1095, NACA0012):
        cd = lift_drag(table, jnp.linspace(-np.pi, np.pi, 20_001), jnp.asarray(0.0))[1]
        assert cd.min() >= table.cd[:, 0].min() - 1e-15
        assert cd.max() <= table.cd[:, 0].max() + 1e-15


def test_linear_data_are_reproduced_exactly():
    table = linear_airfoil(slope=5.73, cd=0.01, zero_lift=-0.02)
    alpha = jnp.linspace(-0.48, 0.48, 101)
    cl, cd = lift_drag(table, alpha, jnp.asarray(0.3))
    np.testing.assert_allclose(cl, 5.73 * (alpha + 0.02), atol=1e-13)
    np.testing.assert_allclose(cd, 0.01, rtol=1e-13)


def test_bilinear_surface_is_reproduced_between_mach_columns():
    """cl = α(2 + M): the mixed derivative carries the slope from one Mach column to the next."""
    mach = np.linspace(0, 1, 6)
    alpha = np.concatenate([[-180], np.arange(-30, 31, 3.0), [180]])
    cl = np.where(np.abs(alpha) < 90, np.deg2rad(alpha), 0.0)[:, None] * (2 + mach)
    table = airfoil_table(alpha, mach, cl, np.ones_like(cl))
    a, m = jnp.meshgrid(jnp.linspace(-0.4, 0.4, 31), jnp.linspace(0.2, 0.8, 31))
    np.testing.assert_allclose(lift_drag(table, a, m)[0], a * (2 + m), atol=1e-13)


def test_interpolation_is_third_order_or_better_on_smooth_monotone_data():
    errors = []
    for n in (10, 20, 40):
        alpha = np.concatenate([[-180.0], np.linspace(-80, 80, 2 * n + 1), [180.0]])
        smooth = np.where(np.abs(alpha) < 90, np.tanh(np.deg2rad(alpha)), 0.0)
        table = airfoil_table(alpha, 0.0, smooth, np.ones_like(smooth))
        at = jnp.deg2rad(jnp.linspace(-60, 60, 997))
        errors.append(float(jnp.max(jnp.abs(lift_drag(table, at, jnp.asarray(0.0))[0] - jnp.tanh(at)))))
    order = np.polyfit(np.log([10, 20, 40]), np.log(errors), 1)[0]
    assert -4.3 < order < -2.7


@pytest.mark.parametrize("table", [SC1095, NACA0012], ids=["sc1095", "naca0012"])
def test_derivative_ladder(table):
    """Forward against central differences and reverse, away from the nodes, where the second derivative jumps."""
    rng = np.random.default_rng(3)
    alpha = jnp.asarray(np.deg2rad(np.floor(rng.uniform(-170, 170, 200)) + 0.37))
    mach = jnp.asarray(np.floor(rng.uniform(0, 9, 200)) / 10 + 0.043)

    def both(x):
        return jnp.stack(lift_drag(table, x[0], x[1]))

    x, step = jnp.stack([alpha, mach], -1), 1e-5
    forward = jax.jit(jax.vmap(jax.jacfwd(both)))(x)
    reverse = jax.jit(jax.vmap(jax.jacrev(both)))(x)
    values = jax.jit(jax.vmap(both))
    numeric = jnp.stack([(values(x + step * e) - values(x - step * e)) / (2 * step) for e in jnp.eye(2)], -1)
    np.testing.assert_allclose(forward, numeric, rtol=1e-6, atol=2e-7)
    np.testing.assert_allclose(forward, reverse, rtol=1e-12, atol=1e-13)


def test_derivatives_are_finite_everywhere_even_at_nodes_and_far_out():
    angles = np.concatenate([SC1095.alpha, np.deg2rad([-14, -6, 6, 14, 1000])])
    alpha, mach = (x.ravel() for x in np.meshgrid(angles, [0.0, 0.7, 1.0, 2.0]))
    for table in (SC1095, NACA0012):
        for argument in (0, 1):
            assert np.all(np.isfinite(derivative(table, argument)(alpha, mach)))


@pytest.mark.parametrize("mach", [0.0, 0.3, 0.439, 0.7])
def test_prandtl_glauert_in_attached_flow(mach):
    alpha = jnp.deg2rad(jnp.array([-6.0, -3.3, 0.5, 4.0, 6.0]))
    ratio = lift_drag(NACA0012, alpha, mach)[0] / lift_drag(NACA0012, alpha, 0.0)[0]
    np.testing.assert_allclose(ratio, 1 / np.sqrt(1 - mach**2), rtol=1e-13)


def test_prandtl_glauert_leaves_separated_flow_and_drag_alone():
    alpha = jnp.deg2rad(jnp.array([-90.0, -14.0, 14.0, 20.0, 179.0]))
    np.testing.assert_allclose(lift_drag(NACA0012, alpha, 0.5)[0], lift_drag(NACA0012, alpha, 0.0)[0], atol=1e-14)
    alpha = jnp.linspace(-3, 3, 101)
    np.testing.assert_allclose(lift_drag(NACA0012, alpha, 0.5)[1], lift_drag(NACA0012, alpha, 0.0)[1], atol=1e-14)


def test_prandtl_glauert_factor_grows_smoothly_and_stays_finite_through_mach_one():
    mach = jnp.linspace(0, 3, 3001)
    factor, slope = prandtl_glauert_factor(mach), jax.vmap(jax.grad(prandtl_glauert_factor))(mach)
    assert jnp.all(slope[1:1000] > 0)
    assert float(factor[-1]) < 1 / np.sqrt(1 - 0.85**2) + 1e-12
    around = jnp.array([0.7 - 1e-7, 0.7 + 1e-7])
    for order in (jax.grad(prandtl_glauert_factor), jax.grad(jax.grad(prandtl_glauert_factor))):
        left, right = jax.vmap(order)(around)
        np.testing.assert_allclose(left, right, rtol=1e-4)


def test_single_precision_keeps_its_own_accuracy():
    table = jax.tree.map(lambda x: x.astype(jnp.float32), SC1095)
    alpha, mach = np.linspace(-3, 3, 301), np.full(301, 0.45)
    low = lift_drag(table, alpha.astype(np.float32), mach.astype(np.float32))
    assert low[0].dtype == jnp.float32
    np.testing.assert_allclose(low, lift_drag(SC1095, alpha, mach), atol=1e-5)


GOOD = {"alpha_deg": [-180, -10, 0, 10, 180], "mach": [0.0, 0.5], "cl": np.zeros((5, 2)), "cd": np.ones((5, 2))}


def gap(row, column, value):
    table = np.ones((5, 2))
    table[row, column] = value
    return table


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"cl": gap(2, 1, np.nan)}, "`cl` must be finite, but is nan at alpha 0 deg, Mach 0.5"),
        ({"cd": gap(2, 1, -0.1)}, "`cd` must not be negative, but is -0.1 at alpha 0 deg"),
        ({"cl": gap(0, 0, 0.5)}, "`cl` must be the same at -180 and 180 deg"),
        ({"cl": np.zeros((5, 3))}, r"`cl` must have shape \(5, 2\)"),
        ({"alpha_deg": [-180, 10, 0, 20, 180]}, r"`alpha_deg` must increase .*, but 10 is followed by 0 \(row 3\)"),
        ({"alpha_deg": [-32, -10, 0, 10, 32]}, "`alpha_deg` must run from -180 to 180, but runs from -32 to 32"),
        ({"alpha_deg": [-180, -10, np.nan, 10, 180]}, "`alpha_deg` must be .* but is nan at entry 3"),
        ({"mach": [0.5, 0.0]}, "`mach` must increase"),
        ({"mach": [-0.5, 0.0]}, r"`mach` must be a number in \[0, 5\] throughout"),
    ],
)
def test_refuses(changes, text):
    airfoil_table(**GOOD)
    with pytest.raises(InputError, match=text):
        airfoil_table(**(GOOD | changes))
