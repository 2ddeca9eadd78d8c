"""Roll-up: conservation, smoothness and limits."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.wake.model import free_wake
from rotorjax.wake.roll_up import release, tip_point, tip_share, trailers
from rotorjax.wake.settings import wake_settings

RULES = {
    "impulse": (0.45, 0.75),
    "maximum": (0.3, 0.6, 0.9),
    "centroid": (0.3, 0.6, 0.9),
}


def model_of(uh60, rule, inboard, **settings):
    return free_wake(*uh60, None, wake_settings(roll_up=rule, inboard=inboard, **settings))


def loading(model):
    r = model.stations
    return 0.01 * jnp.sin(jnp.pi * (r - model.rotor.root_cutout) / (1 - model.rotor.root_cutout)) * (1 + r**4)


@pytest.mark.parametrize(("rule", "inboard"), RULES.items())
def test_far_filaments_carry_no_net_circulation(uh60, rule, inboard):
    model = model_of(uh60, rule, inboard)
    found = release(model, model.leading, loading(model))
    assert abs(float(jnp.sum(found.strength))) < 1e-16


def rolled(model):
    """A row whose edge has rolled up: spirals in the (r, z) plane, tighter towards the tip."""
    r = model.edges
    turn = 0.02 / (1.01 - r)
    return jnp.stack([r - 0.02 * jnp.sin(turn) ** 2, 0.1 * r, 0.02 * jnp.sin(turn)], axis=-1)


@pytest.mark.parametrize("band", [0.0, 0.01, 0.015])
def test_on_a_straight_row_the_tip_vortex_starts_at_its_station(uh60, band):
    model = model_of(uh60, "impulse", (0.45, 0.75), release_band=band)
    found = tip_point(model, model.leading)
    np.testing.assert_allclose(found, [float(model.settings.release), 0, 0], atol=1e-12)


def test_the_place_has_derivatives_by_station_and_band(uh60):
    model = model_of(uh60, "impulse", (0.45, 0.75))

    def place(numbers):
        moved = eqx.tree_at(lambda m: (m.settings.release, m.settings.release_band), model, tuple(numbers))
        return tip_point(moved, rolled(moved))

    at, step = jnp.array([0.968, 0.015]), 1e-7
    forward, reverse = jax.jacfwd(place)(at), jax.jacrev(place)(at)
    differences = [(place(at + e) - place(at - e)) / (2 * step) for e in step * jnp.eye(2)]
    np.testing.assert_allclose(forward, reverse, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(forward, jnp.stack(differences, -1), rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("inboard", [(0.45,), (0.45, 0.75), (0.25, 0.5, 0.75)])
def test_impulse_rule_keeps_the_impulse_of_the_trailers(uh60, inboard):
    model = model_of(uh60, "impulse", inboard)
    gamma = loading(model)
    found = release(model, model.leading, gamma)
    np.testing.assert_allclose(
        found.strength @ jnp.sum(found.points**2, axis=1), trailers(gamma) @ model.edges**2, rtol=1e-12
    )
    # Σ γ r² = 2 ∫ Γ r dr: the impulse is the thrust's
    np.testing.assert_allclose(trailers(gamma) @ model.edges**2, jnp.sum(gamma * jnp.diff(model.edges**2)), rtol=1e-12)


def test_centroid_rule_keeps_the_linear_moment_of_the_tip_trailers(uh60):
    model = model_of(uh60, "centroid", (0.3, 0.6, 0.9))
    gamma = loading(model)
    found = release(model, model.leading, gamma)
    gathered = tip_share(model, gamma) * trailers(gamma)
    np.testing.assert_allclose(found.strength[0] * found.points[0, 0], gathered @ model.edges, rtol=1e-6)


def test_sharp_maximum_is_the_papers(uh60):
    model = model_of(uh60, "paper", (), sharpness=400.0)
    gamma = loading(model)
    found = release(model, model.leading, gamma)
    assert found.strength.shape == (1,)
    np.testing.assert_allclose(found.strength[0], jnp.max(gamma), rtol=5e-3)
    np.testing.assert_array_equal(found.points[0], model.leading[-1])


@pytest.mark.parametrize("rule", ["impulse", "maximum", "centroid"])
def test_derivatives_are_right_in_both_modes(uh60, rule):
    model = model_of(uh60, rule, RULES[rule])

    def f(gamma):
        found = release(model, model.leading, gamma)
        return jnp.concatenate([found.strength, found.points.ravel()])

    gamma = loading(model)
    forward, reverse = jax.jacfwd(f)(gamma), jax.jacrev(f)(gamma)
    np.testing.assert_allclose(forward, reverse, atol=1e-12)
    step = 1e-7
    for i in (0, 5, 13):
        e = jnp.zeros_like(gamma).at[i].set(step)
        np.testing.assert_allclose(forward[:, i], (f(gamma + e) - f(gamma - e)) / (2 * step), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("strength", [0.0, -0.01])
def test_unloaded_and_downward_blades_stay_finite(uh60, strength):
    model = model_of(uh60, "centroid", (0.45,))
    one = jnp.ones_like(model.stations)
    found, slope = jax.jvp(lambda g: release(model, model.leading, g), (strength * one,), (one,))
    assert all(bool(jnp.all(jnp.isfinite(v))) for v in (*found, *slope))


@pytest.mark.parametrize("inboard", [(), (0.3, 0.98)])
def test_impulse_rule_needs_filaments_inboard_of_the_release(inboard):
    with pytest.raises(InputError, match="inboard"):
        wake_settings(roll_up="impulse", inboard=inboard)
