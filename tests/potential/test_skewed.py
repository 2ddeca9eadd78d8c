from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad_vec

from rotorjax.errors import InputError
from rotorjax.potential.field import field_functions, pressure_functions
from rotorjax.potential.matrices import apparent_mass, influence
from rotorjax.potential.modes import Mode, ModeTable, rotor_modes
from rotorjax.potential.skewed import skewed_functions

PRESSURE = ModeTable([Mode(0, 1, "cos"), Mode(1, 2, "cos"), Mode(1, 2, "sin"), Mode(2, 3, "cos")], "odd")
SOURCE = ModeTable([Mode(0, 2, "cos"), Mode(1, 3, "cos")], "even")
FLOW = jax.jit(skewed_functions, static_argnums=0)
PLACES = {
    "above": (0.3, 0.2, 0.4),
    "on": (0.3, -0.4, 0.0),
    "in the wake": (0.5, 0.2, -0.5),
    "deep in the wake": (1.6, -0.3, -2.0),
    "outside below": (-1.2, 0.4, -0.3),
    "outside above": (1.4, 0.9, 0.2),
    "in the plane outside": (-0.9, 0.9, 0.0),
}


def along_streamline(modes, point, chi):
    """∫ ∇Φ dξ straight through the disk, adaptively: the acceleration potential itself."""
    slope = jax.jit(jax.jacfwd(lambda p: pressure_functions(modes, p)))
    point, way = np.array(point), np.array([-np.sin(chi), 0.0, np.cos(chi)])
    crossing = max(0.0, -point[2] / np.cos(chi))
    ends = np.unique([0.0, crossing, crossing + 0.5, crossing + 2.0, crossing + 8.0])
    settings = {"epsabs": 1e-8, "epsrel": 1e-9, "limit": 400}

    def f(s):
        return np.array(slope(point + s * way)).T

    result = sum(quad_vec(f, a, b, **settings)[0] for a, b in pairwise(ends))
    return result + quad_vec(lambda u: f(1 / u) / u**2, 0, 1 / ends[-1], **settings)[0]


@pytest.mark.slow
@pytest.mark.parametrize("modes", [PRESSURE, SOURCE], ids=["pressure", "source"])
@pytest.mark.parametrize("degrees", [20.0, 50.0])
def test_flow_is_the_acceleration_integrated_along_streamlines(modes, degrees):
    chi = np.deg2rad(degrees)
    mine = FLOW(modes, jnp.array(list(PLACES.values())), jnp.array(chi))
    for i, point in enumerate(PLACES.values()):
        np.testing.assert_allclose(mine[:, :, i], along_streamline(modes, point, chi), atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("modes", [PRESSURE, SOURCE], ids=["pressure", "source"])
def test_axial_stream_is_the_closed_form(modes):
    points = jnp.array(list(PLACES.values()))
    np.testing.assert_allclose(FLOW(modes, points, jnp.array(0.0)), field_functions(modes, points), atol=1e-6)


@pytest.mark.slow
def test_disk_flow_of_finite_states_converges_to_it():
    """a = M⁻¹L(X)τ at unit mass flow: the finite states' axial flow on the disk, more of them nearer."""
    chi = np.deg2rad(30.0)
    points = jnp.array([[0.3, 0.2, 0.0], [-0.4, 0.3, 0.0], [0.1, -0.6, 0.0]])
    exact = -FLOW(ModeTable([Mode(0, 1, "cos")], "odd"), points, jnp.array(chi))[2, 0]
    errors = []
    for harmonics, terms in ((1, 1), (3, 2), (5, 3)):
        modes = rotor_modes(harmonics, terms)
        l, mass = influence(modes, modes, jnp.array(np.tan(chi / 2))), apparent_mass(modes, modes)
        a = jnp.linalg.solve(jnp.array(mass), l[:, 0])
        errors.append(float(jnp.sqrt(jnp.mean((a @ pressure_functions(modes, points) - exact) ** 2))))
    assert errors[2] < errors[1] < errors[0]
    assert errors[2] < 0.06  # of 1.6


def test_mirror_in_the_plane_of_symmetry():
    points = jnp.array([[0.4, 0.3, -0.6], [0.4, -0.3, -0.6]])
    flow = FLOW(PRESSURE, points, jnp.array(0.6))
    even = np.array([1, 1, -1, 1])[None, :] * np.array([1, -1, 1])[:, None]
    np.testing.assert_allclose(flow[:, :, 0], even * flow[:, :, 1], atol=1e-12)


def test_derivative_by_skew():
    points = jnp.array([[0.4, 0.3, -0.6], [0.2, 0.1, 0.3]])

    def f(chi):
        return FLOW(PRESSURE, points, chi)[2]

    difference = (f(jnp.array(0.5 + 1e-4)) - f(jnp.array(0.5 - 1e-4))) / 2e-4
    np.testing.assert_allclose(jax.jacfwd(f)(jnp.array(0.5)), difference, atol=1e-4)


def test_bad_shape():
    with pytest.raises(InputError, match=r"shape \(N, 3\)"):
        skewed_functions(PRESSURE, jnp.zeros(3), jnp.array(0.1))
