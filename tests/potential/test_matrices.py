from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.potential.field import disk_functions, pressure_functions, sigma, zeta
from rotorjax.potential.legendre import k_constant, legendre_p
from rotorjax.potential.matrices import apparent_mass, damping, gamma, influence
from rotorjax.potential.modes import ground_modes, mode_table, rotor_modes

NODE, WEIGHT = np.polynomial.legendre.leggauss(40)
NU, WEIGHT = (NODE + 1) / 2, WEIGHT / 2
ODD, EVEN = rotor_modes(3, 3), mode_table(2, 3, 3)


def p(m, n):
    return np.array(legendre_p(((m, n),), jnp.array(NU))[0]) * (1 - NU**2) ** (m / 2)


def galerkin_damping(m, j, n):
    even = j if (j + m) % 2 == 0 else n
    k = k_constant(m, even) if (j - n) % 2 else k_constant(m, n)
    return (p(m, j) * p(m, n) * WEIGHT).sum() / k


def galerkin_mass(m, j, n):
    if (j + m) % 2:
        return (p(m, j) * p(m, n) * NU * WEIGHT).sum()
    potential = sigma(m, n) * p(m, n + 1) + zeta(m, n) * p(m, n - 1)
    return (p(m, j) * potential * WEIGHT).sum() / k_constant(m, j)


@pytest.mark.parametrize("rows", [ODD, EVEN, ground_modes(3, 3)], ids=["odd", "even", "even with diagonal"])
@pytest.mark.parametrize("columns", [ODD, EVEN], ids=["odd", "even"])
def test_damping_and_mass_are_the_galerkin_integrals(rows, columns):
    d, mass = damping(rows, columns), apparent_mass(rows, columns)
    for i, a in enumerate(rows.modes):
        for k, b in enumerate(columns.modes):
            same = (a.m, a.kind) == (b.m, b.kind)
            np.testing.assert_allclose(d[i, k], galerkin_damping(a.m, a.n, b.n) if same else 0, atol=1e-12)
            np.testing.assert_allclose(mass[i, k], galerkin_mass(a.m, a.n, b.n) if same else 0, atol=1e-12)


def test_influence_without_skew_is_the_mass():
    for rows in (ODD, EVEN):
        np.testing.assert_allclose(influence(rows, rows, jnp.array(0.0)), apparent_mass(rows, rows), rtol=1e-15)


def test_influence_is_reciprocal():
    """L_jn^rm = ± L_nj^mr (reversing the flow turns ψ by π), with the m = 0 rows at half weight."""
    x = np.tan(np.deg2rad(20.0))
    for table in (ODD, EVEN):
        weight = np.where(table.m == 0, 1.0, 0.5)[:, None]
        matrix = weight * np.array(influence(table, table, jnp.array(x)))
        sign = np.where((table.m[:, None] + table.m) % 2 == 0, 1, -1)
        np.testing.assert_allclose(matrix, sign * matrix.T, atol=1e-14)


def skewed_streamlines(nu, psi, chi, nodes):
    """Points and steps up the streamlines that end on the disk, split where they pass the leading edge."""
    node, weight = np.polynomial.legendre.leggauss(nodes)
    node, weight = (node + 1) / 2, weight / 2
    cluster, slope = node**3 * (10 - 15 * node + 6 * node**2), 30 * node**2 * (1 - node) ** 2 * weight
    x, y = np.sqrt(1 - nu**2) * np.cos(psi), np.sqrt(1 - nu**2) * np.sin(psi)
    edge = ((x + np.sqrt(1 - y**2)) / np.sin(chi))[:, None]
    far = 2 * edge + 1
    xi = np.concatenate([edge * cluster, edge + (far - edge) * cluster, far / node], axis=1)
    step = np.concatenate([edge * slope, (far - edge) * slope, far / node**2 * weight], axis=1)
    points = np.stack([x[:, None] - xi * np.sin(chi), np.broadcast_to(y[:, None], xi.shape), xi * np.cos(chi)], axis=-1)
    return jnp.array(points), jnp.array(step)


@partial(jax.jit, static_argnums=0)
def along(modes, points, step):
    """∫ Φ dξ and ∫ ∂Φ/∂z̄ dξ: velocity potential and axial flow of unit pressure at unit speed."""
    up = jnp.zeros_like(points).at[..., 2].set(1.0)
    value, slope = jax.jvp(lambda p: pressure_functions(modes, p), (points,), (up,))
    return jnp.einsum("mns,ns->mn", value, step), -jnp.einsum("mns,ns->mn", slope, step)


@pytest.mark.parametrize("degrees", [20.0, 35.0, 60.0, 80.0])
def test_influence_is_the_galerkin_integral_along_skewed_streamlines(degrees):
    """All four blocks. Odd rows, by Green's theorem: ∫ P̄_j w ν dν; even rows: (1/K_j) ∫ P̄_j Ψ dν."""
    chi = np.deg2rad(degrees)
    node, weight = np.polynomial.legendre.leggauss(24)
    nu, psi = (a.ravel() for a in np.meshgrid((node + 1) / 2, (np.arange(48) + 0.5) * np.pi / 24, indexing="ij"))
    weights = np.repeat(weight / 2 / 48, 48)
    points, step = skewed_streamlines(nu, psi, chi, 24)
    x, y = (jnp.array(np.sqrt(1 - nu**2) * f(psi)) for f in (np.cos, np.sin))
    for rows in (rotor_modes(2, 2), mode_table(2, 2, 2)):
        share = np.where(rows.m == 0, 1.0, 2.0)[:, None]
        test = disk_functions(rows, x, y) * weights * share
        for columns in (rotor_modes(2, 2), mode_table(2, 2, 2)):
            potential, flow = along(columns, points, step)
            if rows.parity == "odd":
                integral = test * nu @ flow.T
            else:
                integral = test / np.array([k_constant(a.m, a.n) for a in rows.modes])[:, None] @ potential.T
            np.testing.assert_allclose(influence(rows, columns, jnp.array(np.tan(chi / 2))), integral, atol=1e-6)


def test_thrust_gives_more_inflow_aft_in_forward_flight():
    """One term of each harmonic: the structure of Pitt and Peters (1980)."""
    modes, x = rotor_modes(1, 1), jnp.array(np.tan(np.deg2rad(25.0)))
    l = np.array(influence(modes, modes, x))
    cosine, sine = modes.index(1, 2), modes.index(1, 2, "sin")
    np.testing.assert_allclose(l[sine, sine] / l[cosine, cosine], (1 + x**2) / (1 - x**2), rtol=1e-13)
    assert l[cosine, 0] > 0
    assert l[sine, 0] == 0


def test_no_closed_form_is_said():
    with pytest.raises(ValueError, match="outer radius"):
        gamma(0, 0, 0, 0)


def test_derivative_by_skew_at_zero():
    modes = rotor_modes(2, 2)
    slope = jax.jacrev(lambda x: influence(modes, modes, x))(0.0)
    difference = (influence(modes, modes, jnp.array(1e-6)) - influence(modes, modes, jnp.array(-1e-6))) / 2e-6
    np.testing.assert_allclose(slope, difference, atol=1e-9)
