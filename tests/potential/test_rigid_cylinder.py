import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.ground import Plane, plane
from rotorjax.potential import rigid_cylinder
from rotorjax.potential.field import disk_functions, pressure_functions
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.model import FiniteState, finite_state_model, steady_state

CT = 0.006
R, PSI = jnp.array([0.2, 0.6, 0.95]), jnp.array([0.0, 1.0, 2.0, np.pi])


def test_level_ground_is_the_closed_form():
    model = finite_state_model(plane(0.5), harmonics=1)
    a = jnp.linspace(1, -0.4, 9)
    x, y = R * jnp.cos(PSI)[:, None], R * jnp.sin(PSI)[:, None]

    def phi(z):
        return jnp.tensordot(a, pressure_functions(model.modes, jnp.stack([x, y, jnp.full_like(x, z)], axis=-1)), 1)

    mine = rigid_cylinder.inflow(FiniteState(a, jnp.zeros(5)), R, PSI, model)
    np.testing.assert_allclose(mine, phi(0.0) - 2 * phi(0.5) + phi(1.0), atol=1e-9)


@pytest.mark.parametrize("height", [0.05, 0.1])
def test_low_over_level_ground_it_is_the_closed_form_too(height):
    model = finite_state_model(plane(height), radial_terms=1)
    points = jnp.stack([R, 0 * R, 0 * R], axis=-1)
    phi = [pressure_functions(model.modes, points.at[:, 2].set(z))[0] for z in (0.0, height, 2 * height)]
    mine = rigid_cylinder.inflow(FiniteState(jnp.ones(1), jnp.zeros(7)), R, PSI[:1], model)[0]
    np.testing.assert_allclose(mine, phi[0] - 2 * phi[1] + phi[2], atol=1e-12)


@pytest.mark.parametrize(
    ("height", "ratio"), [(0.5, 0.344), (0.75, 0.495), (1, 0.609), (1.5, 0.755), (2, 0.837), (3, 0.916)]
)
def test_mean_inflow_ratio(height, ratio):
    model = finite_state_model(plane(height), radial_terms=1, printed=True)
    state = steady_state(model, jnp.array([np.sqrt(3) / 4 * CT]))
    assert abs(float(rigid_cylinder.mean_inflow(state, model) / np.sqrt(CT / 2)) - ratio) < 6e-4


def test_slope_against_a_column_of_doublets_and_its_image():
    """The column itself, by quadrature over its volume: nothing of the source form enters."""
    ground, model = plane(1.0, 25.0), finite_state_model(plane(1.0, 25.0), harmonics=1)
    a = jnp.linspace(1, -0.4, 9)
    x, y, nu, weights = (jnp.array(v) for v in DiskQuadrature(40, 64).rule())
    density = 2 * a @ disk_functions(model.modes, x, y) * nu * weights * 2 * np.pi
    node, node_weight = np.polynomial.legendre.leggauss(40)
    bottom = -(ground.height - x * jnp.tan(ground.slope))
    z = bottom[:, None] * (node + 1) / 2
    strength = density[:, None] * -bottom[:, None] * node_weight / 2
    column = jnp.stack([jnp.broadcast_to(x[:, None], z.shape), jnp.broadcast_to(y[:, None], z.shape), z], axis=-1)

    def potential(point):  # doublets whose axis points down, so that the flow inside is downward
        d = point - column
        return jnp.sum(strength * d[..., 2] / jnp.sum(d * d, axis=-1) ** 1.5) / (4 * np.pi)

    def column_velocity(point):
        return jax.grad(potential)(point)

    target = jnp.array([0.4, 0.3, 0.3])  # above the disk, clear of the column
    image = ground.reflect_vectors(column_velocity(ground.reflect_points(target)))
    expected = -(column_velocity(target) + image)[2]
    state = FiniteState(a, jnp.zeros(5))
    up = rigid_cylinder.patch_upflow(state, target, model)
    mine = (
        a @ pressure_functions(model.modes, target)
        - 2 * up
        + rigid_cylinder.reflected_sink_downflow(state, target, model)
    )
    np.testing.assert_allclose(mine, expected, atol=1e-6)


def test_mountain_side_has_less_inflow():
    model = finite_state_model(plane(1.0, 30.0))
    lam = rigid_cylinder.inflow(FiniteState(jnp.array([0.05, 0, 0]), jnp.zeros(5)), R, PSI, model)
    assert np.all(lam[-1] > lam[0])


def test_derivatives_by_height_and_slope():
    state = FiniteState(jnp.array([0.05, 0.01, 0]), jnp.zeros(5))

    def f(v):
        model = finite_state_model(plane(1.0))
        model = type(model)(model.modes, model.sources, Plane(v[0], v[1]), model.correction, model.quadrature, "paper")
        return rigid_cylinder.inflow(state, R[:2], PSI[:2], model)

    f, v, step = jax.jit(f), jnp.array([1.0, 0.3]), 1e-5
    differences = np.stack([(f(v + step * e) - f(v - step * e)) / (2 * step) for e in np.eye(2)], axis=-1)
    np.testing.assert_allclose(jax.jit(jax.jacfwd(f))(v), differences, rtol=1e-6, atol=1e-10)
    np.testing.assert_allclose(jax.jit(jax.jacrev(f))(v), differences, rtol=1e-6, atol=1e-10)


def test_without_ground_it_is_the_disk_flow():
    model = finite_state_model()
    state = FiniteState(jnp.array([0.05, 0.01, 0]), jnp.zeros(5))
    np.testing.assert_allclose(
        rigid_cylinder.inflow(state, R, jnp.array([0.0]), model)[0], state.a @ disk_functions(model.modes, R, 0 * R)
    )
