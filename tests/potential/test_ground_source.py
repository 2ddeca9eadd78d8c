import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ground import Plane, plane
from rotorjax.potential.field import axial_functions, disk_functions
from rotorjax.potential.ground_source import (
    DiskQuadrature,
    correction,
    correlation,
    depth,
    ground_on_rotor,
    rotor_on_ground,
    self_flow,
)
from rotorjax.potential.legendre import legendre_p, legendre_q
from rotorjax.potential.modes import ground_modes, rotor_modes

RULE = DiskQuadrature()
G = eqx.filter_jit(correlation)


def test_depth_is_smaller_on_the_mountain_side():
    ground = plane(1.0, 30.0)
    points = jnp.array([[0.7, 0.2, 0.0], [-0.7, 0.2, 0.0]])
    d = depth(ground, points[:, 0])
    np.testing.assert_allclose(ground.distance(points.at[:, 2].set(-d)), 0, atol=1e-15)
    assert d[0] < 1 < d[1]


def test_quadrature_integrates_products_of_modes_exactly():
    x, y, _, weights = RULE.rule()
    p = np.array(disk_functions(ground_modes(3, 4), jnp.array(x), jnp.array(y)))
    expected = np.where(ground_modes(3, 4).m == 0, 1.0, 0.5)
    np.testing.assert_allclose(p * weights @ p.T, np.diag(expected), atol=1e-13)


@pytest.mark.parametrize("height", [0.5, 1.0, 3.0])
def test_level_ground_matches_the_integral_of_eq_37(height):
    """The trapezoidal rule of the paper, refined by Richardson; harmonics do not mix on level ground."""
    rotor, sources, ground = rotor_modes(1, 2), ground_modes(1, 2), plane(height)
    mine = np.array(G(rotor, sources, ground, RULE))

    def trapezoid(n):
        nu = jnp.linspace(0, 1, n)
        at_depth = jax.jit(lambda p: axial_functions(rotor, p))(
            jnp.stack([jnp.sqrt(1 - nu**2), 0 * nu, 0 * nu - height], axis=-1)
        )
        on_ground = disk_functions(sources, jnp.sqrt(1 - nu**2) * (1 - 1e-16), 0 * nu)
        return np.trapezoid(on_ground[:, None, :] * at_depth[None], nu, axis=-1)

    coarse, fine = trapezoid(401), trapezoid(801)
    cosine = np.array([m.kind == "cos" for m in sources.modes])[:, None] * np.array(
        [m.kind == "cos" for m in rotor.modes]
    )
    same = (sources.m[:, None] == rotor.m) & cosine.astype(bool)
    np.testing.assert_allclose(mine[same], ((4 * fine - coarse) / 3)[same], atol=2e-9)
    kinds = (sources.m[:, None] != rotor.m) | (
        np.array([m.kind for m in sources.modes])[:, None] != np.array([m.kind for m in rotor.modes])
    )
    np.testing.assert_allclose(mine[kinds], 0, atol=1e-14)
    assert np.abs(coarse - mine)[same].max() > 1e-7  # the trapezoidal rule itself is far from rounding error


@pytest.mark.parametrize(("height", "slope"), [(0.5, 0.0), (1.0, 30.0), (1.0, 40.0), (0.9, 30.0)])
def test_quadrature_has_converged(height, slope):
    rotor, sources, ground = rotor_modes(2, 3), ground_modes(2, 4), plane(height, slope)
    fine = G(rotor, sources, ground, DiskQuadrature(48, 96))
    np.testing.assert_allclose(G(rotor, sources, ground, RULE), fine, atol=1e-10 * float(jnp.abs(fine).max()))


def test_sine_and_cosine_states_do_not_mix_on_a_slope():
    rotor, sources = rotor_modes(2, 2), ground_modes(2, 2)
    sine = [np.array([m.kind == "sin" for m in table.modes]) for table in (sources, rotor)]
    g = np.array(G(rotor, sources, plane(1.0, 25.0), RULE))
    np.testing.assert_allclose(g[sine[0][:, None] != sine[1]], 0, atol=1e-14)
    assert abs(g[0, rotor.index(1, 2)]) > 1e-3  # but harmonics do


def test_normal_component_carries_cos_delta():
    rotor, x, y = rotor_modes(1, 2), jnp.array([0.3, -0.5]), jnp.array([0.2, 0.4])
    ground = plane(1.0, 35.0)
    points = jnp.stack([x, y, -depth(ground, x)], axis=-1)
    down = axial_functions(rotor, points)
    velocity = jnp.stack([0 * down, 0 * down, -down], axis=-1)
    np.testing.assert_allclose(rotor_on_ground(rotor, ground, x, y), -velocity @ ground.normal, rtol=1e-14)


def test_flow_of_the_sources_at_the_rotor():
    sources, height, r = ground_modes(0, 3), 0.8, 0.6
    factor = correction(0.3, 1.5)
    up = ground_on_rotor(sources, plane(height), factor, jnp.array([r, 0.0, 0.0]))
    d = 1 - r**2 - height**2
    root = np.sqrt(d**2 + 4 * height**2)
    nu, eta = np.sqrt((d + root) / 2), np.sqrt((root - d) / 2)
    expected = legendre_p(sources.pairs, jnp.array(nu)) * legendre_q(sources.pairs, jnp.array(eta))
    np.testing.assert_allclose(up[0], expected[0] * 0.3 ** (eta**1.5), rtol=1e-13)
    np.testing.assert_allclose(up[1:], expected[1:], rtol=1e-13)


def test_correction_is_one_on_the_ground_and_fades():
    eta = jnp.array([0.0, 0.5, 3.0])
    np.testing.assert_allclose(correction().factor(eta), (np.pi / 7) ** (eta**2), rtol=1e-14)
    points = jnp.array([[0.3, 0.1, -1.0]])
    above = ground_on_rotor(ground_modes(1, 2), plane(1.0), correction(0.1, 0.7), points)
    np.testing.assert_allclose(above[:, 0], self_flow(ground_modes(1, 2), points[0, 0], points[0, 1]), rtol=1e-13)


@pytest.mark.parametrize("p", [0.5, 1.0, 1.7])
def test_correction_has_finite_derivatives_on_the_ground(p):
    def f(b, p, eta):
        return eqx.tree_at(lambda c: (c.b, c.p), correction(), (b, p)).factor(eta)

    for eta in (0.0, 0.6):
        for jacobian in (jax.jacfwd, jax.jacrev):
            slopes = jacobian(f, argnums=(0, 1, 2))(0.4, p, eta)
            assert np.all(np.isfinite(slopes))
    np.testing.assert_allclose(slopes[0], 0.6**p * 0.4 ** (0.6**p - 1), rtol=1e-12)
    np.testing.assert_allclose(slopes[1], np.log(0.4) * 0.4 ** (0.6**p) * 0.6**p * np.log(0.6), rtol=1e-12)


@pytest.mark.parametrize(("b", "p"), [(0.0, 2.0), (1.1, 2.0), (float("nan"), 2.0), (0.5, 0.0), (0.5, float("inf"))])
def test_bad_correction_is_refused(b, p):
    with pytest.raises(InputError, match="must"):
        correction(b, p)


@pytest.mark.parametrize("jacobian", [jax.jacfwd, jax.jacrev])
def test_derivatives_of_g_by_height_and_slope(jacobian):
    rotor, sources = rotor_modes(1, 2), ground_modes(1, 3)

    def f(v):
        return correlation(rotor, sources, Plane(v[0], v[1]), RULE)

    f, v, step = jax.jit(f), jnp.array([1.0, 0.3]), 1e-5
    slopes = jax.jit(jacobian(f))(v)
    differences = np.stack([(f(v + step * e) - f(v - step * e)) / (2 * step) for e in np.eye(2)], axis=-1)
    np.testing.assert_allclose(slopes, differences, rtol=1e-6, atol=1e-8)
