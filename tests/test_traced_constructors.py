"""Public constructors under grad and vmap: their checks let traced values pass, and their derivatives are exact."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.operating import operating_point
from rotorjax.rotor import geometry
from rotorjax.rotor.airfoil import airfoil_table, lift_drag, linear_airfoil
from rotorjax.rotor.hub import rotor_inputs
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import wake_settings

AIR = linear_airfoil()
ALPHA = np.array([-180.0, -20.0, -5.0, 0.0, 6.0, 20.0, 180.0])
CL = np.array([0.0, -1.0, -0.5, 0.0, 0.6, 1.0, 0.0])


def solidity(**values):
    given = {"radius": 1.0, "root_cutout": 0.2, "chord": 0.08} | values
    return geometry.solidity(geometry.rotor("a", 2, airfoil=AIR, **given))


def lift(cl):
    table = airfoil_table(ALPHA, 0.0, cl, jnp.full(7, 0.01))
    return lift_drag(table, jnp.deg2rad(3.0), jnp.asarray(0.2))[0]


def three_blades(**values):
    return geometry.rotor("a", 3, 1.0, 0.2, 0.08, AIR, **values)


CASES = {
    "plane height": (lambda h: plane(h).distance(jnp.zeros(3)), 1.0, 1.0),
    "plane slope": (lambda s: plane(1.0, s).slope, 10.0, np.pi / 180),
    "operating point": (lambda c: operating_point(100.0, collective=c).collective, 0.1, 1.0),
    "radius": (lambda radius: solidity(radius=radius), 1.0, -2 * 0.08 / np.pi),
    "chord": (lambda c: solidity(chord=c), 0.08, 2 / np.pi),
    "chord table": (lambda c: solidity(chord=([0.2, 1.0], jnp.stack([c, c]))), 0.08, 2 / np.pi),
    "root cut-out": (lambda r: geometry.rotor("a", 2, 1.0, r, 0.08, AIR).root_cutout, 0.2, 1.0),
    "twist": (lambda t: geometry.twist(three_blades(twist=t), jnp.array(0.5)), 0.1, 1.0),
    "twist table": (
        lambda t: geometry.twist(three_blades(twist=([0.0, 1.0], [t, -t])), jnp.array(0.25)), 0.1, 0.5,
    ),
    "hinge": (lambda e: geometry.hinge(e, 1.2, 0.55, 0.33).offset, 0.05, 1.0),
    "airfoil": (lambda a: linear_airfoil(a).cl[46, 0], 5.7, np.deg2rad(0.0)),
    "inputs": (lambda h: rotor_inputs(height=h).height, 1.0, 1.0),
    "wake settings": (lambda c: wake_settings(tip_core=c).tip_core, 0.03, 1.0),
    "free wake": (
        lambda h: free_wake(three_blades(), operating_point(100.0), plane(h)).ground.height, 1.0, 1.0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_derivatives_through_constructors(name):
    function, at, slope = CASES[name]
    np.testing.assert_allclose(jax.grad(function)(at), slope, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(jax.jit(function)(at), function(at), rtol=1e-12)
    both = jax.vmap(function)(jnp.array([at, 1.01 * at]))
    np.testing.assert_allclose(both, [function(at), function(1.01 * at)], rtol=1e-12, atol=1e-14)


def test_a_table_may_be_differentiated_in_its_coefficients():
    """Slopes at the nodes follow the values, so that central differences of the whole constructor are met."""
    cl, step = jnp.asarray(CL), 1e-6
    numeric = [(lift(cl + step * e) - lift(cl - step * e)) / (2 * step) for e in jnp.eye(7)]
    np.testing.assert_allclose(jax.grad(lift)(cl), numeric, atol=1e-9)


def test_slopes_are_those_of_scipys_monotone_interpolant():
    """Against PchipInterpolator on the table continued over three turns."""
    from scipy.interpolate import PchipInterpolator

    alpha = np.deg2rad(ALPHA)
    thrice = np.concatenate([alpha[:-1] - 2 * np.pi, alpha[:-1], alpha[:-1] + 2 * np.pi])
    slopes = PchipInterpolator(thrice, np.tile(CL[:-1], 3)).derivative()(thrice[6:13])
    table = airfoil_table(ALPHA, 0.0, CL, np.full(7, 0.01))
    np.testing.assert_allclose(table.nodes[:, 0, 0, 1, 0], slopes, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("blades", [1, 2, 3, 5, 7])
def test_default_settings_fit_any_rotor(blades):
    rotor = geometry.rotor("a", blades, 1.0, 0.2, 0.08, AIR)
    for settings in (None, wake_settings()):
        found = free_wake(rotor, operating_point(100.0), settings=settings).settings.azimuths
        assert found % blades == 0
        assert found >= 8


def test_azimuths_that_were_asked_for_are_kept_or_refused():
    with pytest.raises(InputError, match="multiple of the 3 blades, but has 8"):
        free_wake(three_blades(), operating_point(100.0), settings=wake_settings(azimuths=8))
