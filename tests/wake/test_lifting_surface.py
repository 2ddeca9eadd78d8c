"""The three-quarter-chord condition against a vortex lattice that knows nothing of lifting lines."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.wake.lifting_surface import chord_downwash


def elliptic(aspect, y):
    """Chord of an elliptic wing of span 2."""
    return 8 / (np.pi * aspect) * np.sqrt(np.maximum(1 - y**2, 0))


def rectangular(aspect, y):
    return 2 / aspect + 0 * y


def span(panels):
    """Edges and control points, cosine-spaced over −1 … 1."""
    angle = np.linspace(0, np.pi, panels + 1)
    return -np.cos(angle), -np.cos(0.5 * (angle[1:] + angle[:-1]))


def line_slope(aspect, planform, behind, panels=40):
    """Lift slope of a wing with a straight quarter chord: lifting line, and what `behind` chords of distance change."""
    edges, y = span(panels)
    chord = planform(aspect, y)
    line = (1 / (y[:, None] - edges[:-1]) - 1 / (y[:, None] - edges[1:])) / (4 * np.pi)
    whole = line + np.asarray(chord_downwash(jnp.asarray(y), jnp.asarray(edges), jnp.asarray(behind * chord)))
    gamma = np.linalg.solve(np.eye(panels) + np.pi * chord[:, None] * whole, np.pi * chord)
    return 2 * gamma @ np.diff(edges) * aspect / 4


def lattice_slope(aspect, planform, rows, panels=20):
    """Lift slope of the same wing by horseshoes on `rows` rows of panels, at angle of attack 1."""
    edges, y = span(panels)
    place = (np.arange(rows) + 0.25) / rows - 0.25, (np.arange(rows) + 0.75) / rows - 0.25
    points = np.array([[planform(aspect, v) * s, v] for v in y for s in place[1]])

    def bound(a, b):
        r1, r2 = points - a, points - b
        turn = r1[:, 0] * r2[:, 1] - r1[:, 1] * r2[:, 0]
        unit = [r / np.linalg.norm(r, axis=1, keepdims=True) for r in (r1, r2)]
        return -(unit[0] - unit[1]) @ (b - a) / turn

    def trailer(a):
        x, h = points[:, 0] - a[0], points[:, 1] - a[1]
        return (1 + x / np.hypot(x, h)) / h

    columns = []
    for inner, outer in itertools.pairwise(edges):
        for s in place[0]:
            a, b = (np.array([planform(aspect, e) * s, e]) for e in (inner, outer))
            columns.append((trailer(a) - trailer(b) + bound(a, b)) / (4 * np.pi))
    gamma = np.linalg.solve(np.array(columns).T, np.ones(len(points))).reshape(panels, rows).sum(axis=1)
    return 2 * gamma @ np.diff(edges) * aspect / 4


@pytest.mark.parametrize("aspect", [2.55, 6.0, 15.0])
@pytest.mark.parametrize("planform", [elliptic, rectangular])
def test_it_is_the_lattice_with_one_row(aspect, planform):
    """Weissinger's method is a lattice of one row (whose bound vortex is not quite straight at elliptic tips)."""
    np.testing.assert_allclose(line_slope(aspect, planform, 0.5, 20), lattice_slope(aspect, planform, 1), rtol=2e-4)


@pytest.mark.parametrize("planform", [elliptic, rectangular])
def test_lift_slope_is_that_of_the_lifting_surface(planform):
    """Within 1 % of a lattice fine in the chord at an aspect ratio of 6, where the lifting line is 7 % high."""
    surface = lattice_slope(6.0, planform, 6, panels=60)  # the lattice itself is 1 % off with 20
    assert line_slope(6.0, planform, 0.5) == pytest.approx(surface, rel=0.01)
    assert 1.05 < line_slope(6.0, planform, 0.0) / surface < 1.1


def test_the_change_goes_like_aspect_to_the_minus_second():
    """The lift slope changes by 2.7/A² or so: four times less at twice the aspect ratio."""
    change = [1 - line_slope(a, elliptic, 0.5, 80) / line_slope(a, elliptic, 0.0, 80) for a in (20.0, 40.0)]
    assert change[0] / change[1] == pytest.approx(4.0, rel=0.25)


def test_nothing_at_the_line_itself_and_derivatives_there():
    edges, y = map(jnp.asarray, span(8))

    def of_distance(d):
        return chord_downwash(y, edges, d * jnp.ones(8))

    assert jnp.all(of_distance(0.0) == 0)
    for at in (0.0, 0.1):
        forward, reverse = jax.jacfwd(of_distance)(at), jax.jacrev(of_distance)(at)
        np.testing.assert_allclose(forward, reverse, rtol=1e-12)
        difference = (of_distance(at + 2e-6) - of_distance(at)) / 2e-6
        assert np.all(np.isfinite(forward))
        if at:
            central = (of_distance(at + 1e-5) - of_distance(at - 1e-5)) / 2e-5
            np.testing.assert_allclose(forward, central, rtol=1e-6, atol=1e-8)
        else:
            np.testing.assert_allclose(forward, difference, rtol=1e-3)
