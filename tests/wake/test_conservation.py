"""Circulation that neither begins nor ends inside the wake, and blades that have no number."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.ground import plane
from rotorjax.wake.field import velocity
from rotorjax.wake.model import WakeState, free_wake
from rotorjax.wake.roll_up import release, trailers
from rotorjax.wake.segments import bound_vortex, far_filaments, join, near_lattice
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.start import prescribed


def uneven(model):
    """One slice with strengths of no symmetry at all; the first age has the bound circulation, as in hover."""
    x, settings = prescribed(model), model.settings

    def wave(*shape):
        return 0.01 * jnp.cos(jnp.arange(np.prod(shape))).reshape(shape)

    gamma = wave(settings.panels, settings.near_ages)
    return WakeState(x.near[0], x.far[0], gamma, wave(settings.filaments, settings.far_ages), gamma[:, 0])


def test_no_circulation_begins_or_ends_inside_a_lattice_that_ends_at_once(uh60, coarse):
    """At each node but those of the last row as much flows in as out, whatever the strengths (Kirchhoff, Helmholtz)."""
    model = free_wake(*uh60, None, coarse)
    slice_ = uneven(model)
    parts = join(near_lattice(model, slice_, jnp.asarray(0.01)), bound_vortex(model, slice_.gamma_bound))
    ends = np.concatenate([parts.start, parts.end])
    flow = np.concatenate([parts.strength, -parts.strength])
    nodes, which = np.unique(ends.round(12), axis=0, return_inverse=True)
    balance = np.bincount(which.ravel(), flow)
    last = np.asarray(slice_.near[:, -1]).round(12)
    inner = ~(nodes[:, None] == last).all(-1).any(1)
    assert inner.sum() == (model.settings.panels + 1) * model.settings.near_ages
    assert np.abs(balance[inner]).max() < 1e-17
    # what leaves the last row are its trailers, and they add up to nothing
    assert np.abs(balance[~inner]).max() > 1e-3
    assert abs(balance[~inner].sum()) < 1e-16


def test_what_the_trailers_give_up_the_filaments_take_over(uh60):
    """At every age the strengths add up to nothing and, with places as released, to the impulse of the trailers."""
    model = free_wake(*uh60, None, wake_settings(panels=6, roll_up_start=0.5, inboard_decay=0.0, turbulence=0.0))
    settings, near = model.settings, model.settings.near_ages
    gamma = 0.01 * jnp.sin(jnp.linspace(0.3, 2.5, settings.panels))
    rows = jnp.repeat(model.leading[:, None], near, axis=1)
    start = release(model, model.leading, gamma)
    far = jnp.broadcast_to(start.points[:, None], (settings.filaments, settings.far_ages, 3))
    along = [jnp.repeat(v[:, None], n, axis=1) for v, n in ((gamma, near), (start.strength, settings.far_ages))]
    state = WakeState(rows, far, *along, gamma)
    trailed = near_lattice(model, state, jnp.asarray(0.01)).strength[: (settings.panels + 1) * near].reshape(-1, near)
    rolled = far_filaments(model, state, start, jnp.zeros(()), "free").strength.reshape(settings.filaments, -1)
    begun = settings.release_ages
    carried = jnp.pad(rolled, ((0, 0), (begun, 0)))[:, :near]
    np.testing.assert_allclose(jnp.sum(trailed, axis=0) + jnp.sum(carried, axis=0), 0, atol=1e-17)
    impulse = model.edges**2 @ trailed + jnp.sum(start.points**2, axis=1) @ carried
    np.testing.assert_allclose(impulse, trailers(gamma) @ model.edges**2, rtol=1e-12)
    # the share rises from row to row, by the same each time
    share = carried[0] / start.strength[0]
    np.testing.assert_allclose(share, np.clip((np.arange(near) + 0.5 - begun) / (near - begun), 0, 1), atol=1e-12)


def test_numbering_the_blades_from_another_one_changes_nothing(uh60, coarse):
    """Four different wakes over a slope, at one instant: the flow is the same from whichever blade they are counted."""
    model = free_wake(*uh60, plane(1.2, 15.0), coarse)
    growing = [1, 1.01, 1.02, 1.03]
    four = jax.tree.map(lambda a: jnp.stack([g * a for g in growing]), uneven(model))
    points = jnp.array([[0.3, 0.2, -0.1], [0.7, -0.4, 0.2], [1.1, 0.5, -0.5]])
    found = eqx.filter_jit(velocity)(four, points, model)
    np.testing.assert_allclose(found[1:], jnp.broadcast_to(found[0], found[1:].shape), atol=1e-14)
    assert float(jnp.abs(found).max()) > 1e-3
