"""Dense derivatives of the wake's velocities, and the inverse Jacobian that is made of them."""

import re

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.ground import plane
from rotorjax.wake import preconditioner
from rotorjax.wake.biot_savart import segment_velocity
from rotorjax.wake.equilibrium import residual, spread
from rotorjax.wake.influence import pair_derivatives
from rotorjax.wake.kernel_sweeps import KernelSegments
from rotorjax.wake.model import free_wake
from rotorjax.wake.preconditioner import harmonic_inverse
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.start import laid_level, prescribed, with_the_ground


def test_pair_derivatives_are_those_of_the_kernel():
    rng = np.random.default_rng(3)
    points, start, end = (jnp.asarray(rng.normal(size=(n, 3))) for n in (3, 4, 4))
    points = points.at[0].set(start[1])  # a point on a node
    strength, core = jnp.asarray(rng.normal(size=4)), jnp.asarray(0.1 + rng.random(4))

    def each(start, end, strength, core):
        one = lambda *s: segment_velocity(points, *(a[None] for a in s))  # noqa: E731
        return jax.vmap(one, out_axes=1)(start, end, strength, core)

    soft = jnp.sum((end - start) ** 2, axis=1) * core**2
    segments = KernelSegments(start.T, end.T, strength / (4 * jnp.pi), soft)
    found = pair_derivatives(points, segments)
    tangents = [jnp.asarray(rng.normal(size=a.shape)) for a in (start, end, strength, core)]
    expected = jax.jvp(each, (start, end, strength, core), tuple(tangents))[1]
    soft_t = 2 * jnp.sum((end - start) * (tangents[1] - tangents[0]), axis=1) * core**2 + (
        2 * jnp.sum((end - start) ** 2, axis=1) * core * tangents[3]
    )
    value = jnp.einsum("nsij,sj->nsi", found.start, tangents[0]) + jnp.einsum("nsij,sj->nsi", found.end, tangents[1])
    value = value + found.strength * (tangents[2] / (4 * jnp.pi))[:, None] + found.soft * soft_t[:, None]
    np.testing.assert_allclose(value, expected, rtol=1e-10, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ground", "start"), [(None, 1.0), (plane(0.9), 1.0), (plane(0.9), 0.5)], ids=["free", "level", "by and by"]
)
def test_harmonic_inverse_is_the_inverse_jacobian_of_an_axisymmetric_wake(uh60, ground, start, monkeypatch):
    """Any axisymmetric wake will do, solved or not: the identity is algebra."""
    inversion, asked = spied_inversion(monkeypatch)
    settings = wake_settings(
        panels=5,
        age_step_deg=30.0,
        near_wake_deg=120.0,
        roll_up_start=start,
        closure_turns=1,
        closure_bundles=1,
        azimuths=8,
    )
    model = free_wake(*uh60, ground, settings)
    x = prescribed(model)
    everywhere = spread(x, 8)
    rng = np.random.default_rng(0)
    v = jax.tree.map(lambda a: jnp.asarray(rng.normal(size=a.shape)), everywhere)
    w = harmonic_inverse(model, x, 8)(v, everywhere, model)
    back = eqx.filter_jit(lambda w: jax.jvp(lambda y: residual(y, model), (everywhere,), (w,))[1])(w)
    for a, b in zip(back, v, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-8)
    factorised = re.findall(r"lapack_zgetrf\w*\(.*-> \(tensor<([\dx]+)xcomplex", inversion.lower(*asked).as_text())
    assert factorised, "the program factorises nothing"
    assert all(shape.count("x") == 1 for shape in factorised), "a batch may wait for ever, see _inverse"


def spied_inversion(monkeypatch):
    """What inverts the matrices, and a list that holds the arguments once it is called."""
    asked, inverse = [], preconditioner._inverse
    monkeypatch.setattr(preconditioner, "_inverse", lambda *args: asked.extend(args) or inverse(*args))
    return inverse, asked


def test_laid_level_keeps_a_level_wake_and_raises_a_sloped_one_above_the_ground(uh60, coarse):
    level, steep = plane(1.0), plane(1.0, 30.0)
    x = spread(prescribed(free_wake(*uh60, level, coarse)), 4)
    same = laid_level(x, level)
    np.testing.assert_allclose(same.far, x.far[:1], atol=1e-12)
    laid = laid_level(with_the_ground(x, level, steep), steep)
    assert float(jnp.min(level.distance(laid.far))) > 0
