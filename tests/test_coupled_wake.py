"""Lagging blades in their own wake: a lag about the shaft is a turn of the whole rotor, rates are velocities."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.coupled_wake import wake_air_loads
from rotorjax.frames import rotate_about_shaft
from rotorjax.rotor.catalogue import load
from rotorjax.wake.equilibrium import Unknowns, evaluated, spread
from rotorjax.wake.loads import across_blades
from rotorjax.wake.model import Flight, free_wake, on_blade
from rotorjax.wake.settings import flight_settings
from rotorjax.wake.start import prescribed

SLICES = 4
TINY = {"panels": 5, "age_step_deg": 30.0, "near_wake_deg": 120.0, "azimuths": SLICES}
TINY |= {"closure_turns": 1, "closure_bundles": 0}
LAG = 0.15


def flying(model, wind=(0.0, 0.0, 0.0), hinge=0.0466, **parts):
    values = {name: jnp.zeros(SLICES) for name in ("flap", "flap_rate", "cyclic", "lag", "lag_rate")} | parts
    flight = Flight(wind=jnp.asarray(wind, float), hinge=jnp.asarray(hinge), **values)
    return eqx.tree_at(lambda m: m.flight, model, flight, is_leaf=lambda v: v is None)


def test_a_lag_about_the_shaft_is_a_turn_of_the_rotor():
    """Blades, their wake and the wind turned back by one angle: loads of the sections the same, forces turned."""
    model = free_wake(*load("uh60"), settings=flight_settings(4, **TINY))
    x = spread(prescribed(model), SLICES)
    x = jax.tree.map(lambda a: a * (1 + 0.02 * jax.random.normal(jax.random.key(0), a.shape)), x)
    back = jnp.asarray(-LAG)
    turned = Unknowns(rotate_about_shaft(x.near, back), rotate_about_shaft(x.far, back), x.gamma_bound)
    motion = {"flap": 0.05 + 0.02 * jnp.arange(SLICES), "flap_rate": 0.01 * jnp.arange(SLICES)}
    wind = jnp.array([0.15, 0.02, -0.01])
    before = flying(model, wind, 0.0, **motion)
    after = flying(model, rotate_about_shaft(wind, back), 0.0, lag=jnp.full(SLICES, LAG), **motion)
    here, there = evaluated(before, x), evaluated(after, turned)
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, atol=1e-12, rtol=0), here.loads, there.loads)
    psi = 2 * np.pi / SLICES * jnp.arange(SLICES)
    first, second = (
        wake_air_loads(m, v.velocities.control, v.loads, psi).force for m, v in ((before, here), (after, there))
    )
    np.testing.assert_allclose(second, rotate_about_shaft(first, back), atol=1e-13)


def test_sections_move_as_their_places_do():
    """u_T and u_P are the velocity of the blade through still air: that of its places, differenced in time."""
    model = free_wake(*load("uh60"), settings=flight_settings(4, **TINY))
    flap, lag, rate, back = 0.1, LAG, 0.03, -0.02

    def at(t):
        moved = flying(model, flap=jnp.full(SLICES, flap + rate * t), lag=jnp.full(SLICES, lag + back * t)).of_slice(0)
        return rotate_about_shaft(on_blade(moved, model.stations), jnp.asarray(t))

    step = 1e-5
    velocity = (at(step) - at(-step)) / (2 * step)
    moving = {"flap_rate": jnp.full(SLICES, rate), "lag_rate": jnp.full(SLICES, back)}
    now = flying(model, flap=jnp.full(SLICES, flap), lag=jnp.full(SLICES, lag), **moving)
    _, ahead, up = now.of_slice(0).flight.axes
    tangential, perpendicular = across_blades(now, jnp.zeros((SLICES, 5, 3)))
    np.testing.assert_allclose(tangential[0], velocity @ ahead, rtol=1e-8)
    np.testing.assert_allclose(perpendicular[0], velocity @ up, atol=1e-9)
