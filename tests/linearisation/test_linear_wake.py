"""The linear wake against finite differences, the nonlinear march, and the derivative of the periodic wake."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from wakes import COARSE

from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.linearisation.assembly import assemble, velocities_along
from rotorjax.linearisation.marching import STEPS, nonlinear_step, stable_steps
from rotorjax.linearisation.outputs import read
from rotorjax.linearisation.reduce import reduce
from rotorjax.linearisation.system import (
    WakeBase,
    disturbed_outputs,
    disturbed_rhs,
    linear_wake,
    orbit_of,
    order_of,
    residual_of,
)
from rotorjax.linearisation.waves import pairing, spectrum, wave_matrix
from rotorjax.ode.harmonic import average
from rotorjax.wake.dynamics import driven, inputs_of, rates, rhs
from rotorjax.wake.equilibrium import spread
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.solution import solve


@pytest.fixture(scope="module")
def wake(uh60):
    """A coarse wake at h = 1, solved to rounding."""
    found = solve(free_wake(*uh60, plane(1.0), wake_settings(**COARSE, azimuths=4)), tol=1e-11)
    assert found.converged, found.why
    return found


@pytest.fixture(scope="module")
def parts(wake):
    return assemble(wake)


@pytest.fixture(scope="module")
def model(wake, parts):
    return average(linear_wake(wake, outputs_=("CT", "CQ", "lambda0"), parts=parts))


@jax.jit
def rates_and_outputs(state, velocities, u, model):
    """`dynamics.rhs` and `outputs`, from the velocities that make up most of both."""
    there = driven(model, u)
    return rates(state, velocities, u, there), read(state, velocities, u, there)


def test_the_solved_wake_rests(wake, parts):
    assert residual_of(wake, parts) < 1e-9


def test_names_units_and_order(wake, model):
    assert model.inputs == ("collective", "climb", "height")
    assert model.input_units == ("rad", "ΩR", "R")
    assert model.outputs == ("CT", "CQ", "lambda0")
    assert model.output_units == ("-", "-", "ΩR")
    assert model.order == order_of(wake.model)


def test_matrices_against_finite_differences(wake, model):
    rng, u, step = np.random.default_rng(0), inputs_of(wake.model), 1e-6
    x, state_of = ravel_pytree(jax.tree.map(jnp.asarray, wake.state))
    v, w = rng.normal(size=x.size), rng.normal(size=3)

    def both(s):
        state, inputs = state_of(x + s * v), type(u)(*(a + s * b for a, b in zip(u, w, strict=True)))
        still = jax.tree.map(jnp.zeros_like, u)
        velocities = velocities_along(jnp.zeros(()), state, inputs, still, wake.model)[0]
        rate, out = rates_and_outputs(state, velocities, inputs, wake.model)
        return ravel_pytree(rate)[0], jnp.stack([out.CT, out.CQ, out.lambda0])

    rate, out = ((a - b) / (2 * step) for a, b in zip(both(step), both(-step), strict=True))
    ours = model.a @ v + model.b @ w
    np.testing.assert_allclose(ours, rate, atol=1e-6 * np.abs(ours).max())
    ours = model.c @ v + model.d @ w
    np.testing.assert_allclose(ours, out, atol=1e-6 * np.abs(ours).max())


def test_steady_gain_is_the_slope_of_solved_wakes(wake, model):
    """Independent: wakes solved with the input moved, by a fixed point of the transport and not of the rates."""
    gain, u, step = model.response(np.zeros(1))[0].real, inputs_of(wake.model), 1e-4
    for name in ("collective", "height"):
        ends = [
            solve(driven(wake.model, u._replace(**{name: getattr(u, name) + s})), start=wake, tol=1e-11)
            for s in (step, -step)
        ]
        read_off = [np.array([end.CT, end.CP, end.mean_inflow]) for end in ends]
        slope = (read_off[0] - read_off[1]) / (2 * step)
        np.testing.assert_allclose(gain[:, model.inputs.index(name)], slope, rtol=1e-5, err_msg=name)


@pytest.mark.parametrize("name", ["collective", "height"])
def test_linear_step_against_the_nonlinear_march(wake, model, name):
    """A tenth of the step leaves a tenth of the difference: what is left is curvature, not a wrong matrix."""
    m, errors = model.inputs.index(name), []
    for size in (STEPS[name], 0.1 * STEPS[name]):
        found = nonlinear_step(wake, name, size, turns=0.5, steps=stable_steps(model))
        ours = size * model.step(found.psi)[:, :, m]
        truth = np.stack([found.outputs.CT, found.outputs.CQ, found.outputs.lambda0], axis=1)
        errors.append(np.abs(ours - truth).max(axis=0) / np.abs(truth).max(axis=0))
    assert errors[1].max() < 0.01
    np.testing.assert_allclose(errors[1], 0.1 * errors[0], rtol=0.3)


def test_wave_number_zero_is_the_linear_model(wake, model, parts):
    np.testing.assert_array_equal(wave_matrix(wake, 0, parts), model.a)


def test_wave_numbers_against_all_blades(wake, parts):
    """A disturbance with a phase from blade to blade, followed by the equations of all blades in forward mode."""
    whole = spread(jax.tree.map(jnp.asarray, wake.state), 4)
    u, rng = inputs_of(wake.model), np.random.default_rng(1)
    push = jax.jit(lambda d: jax.jvp(lambda s: rhs(0.3, s, u, wake.model), (whole,), (d,))[1])
    for wave in (0, 1, 2):
        phase = np.exp(2j * np.pi * wave * np.arange(4) / 4)
        one = jax.tree.map(lambda a: rng.normal(size=a.shape[1:]) + 1j * rng.normal(size=a.shape[1:]), whole)
        full = jax.tree.map(lambda a, phase=phase: np.multiply.outer(phase, a), one)
        rate = jax.tree.map(lambda a, b: a[0] + 1j * b[0], *(push(jax.tree.map(f, full)) for f in (jnp.real, jnp.imag)))
        ours = wave_matrix(wake, wave, parts) @ np.concatenate([a.ravel() for a in jax.tree.leaves(one)])
        theirs = np.concatenate([np.asarray(a).ravel() for a in jax.tree.leaves(rate)])
        np.testing.assert_allclose(ours, theirs, atol=1e-10 * np.abs(theirs).max())


def test_modes_are_told_from_rounding(wake, model, parts):
    found = spectrum(wake, count=1, parts=parts)
    np.testing.assert_allclose(found.exponents[0][0].real, model.poles().real.max(), rtol=1e-9)
    assert all(mode.error < 1e-6 for mode in found.modes)
    assert found.modes[0].exponent.real == max(mode.exponent.real for mode in found.modes)
    np.testing.assert_allclose(abs(found.modes[0].multiplier), np.exp(2 * np.pi * found.modes[0].exponent.real))


def test_pairing_rate_is_that_of_its_circulation_and_spacing(wake):
    low, middle, high = pairing(wake).rate
    assert 0 < low <= middle <= high
    np.testing.assert_allclose(
        middle, np.pi * pairing(wake).circulation[1] / (4 * pairing(wake).spacing[1] ** 2), rtol=0.3
    )


def test_reduced_models(model):
    part = replace(
        model,
        b=model.b[:, :1],
        c=model.c[[0, 2]],
        d=model.d[[0, 2], :1],
        inputs=("collective",),
        outputs=("CT", "lambda0"),
        input_units=("rad",),
        output_units=("-", "ΩR"),
    )
    small = reduce(part, 19)
    assert small.frequency.model.order == small.time.model.order == 19
    assert small.frequency.bode_error_db.max() < 1
    assert small.time.step_error.max() < 0.1
    large = reduce(part, small.unstable + 40)
    assert large.frequency is large.time
    assert large.frequency.bode_error_db.max() < 0.5
    assert large.time.step_error.max() < 0.05


def test_unknown_names_and_lost_wakes_are_refused(wake):
    with pytest.raises(InputError, match="'colective'"):
        linear_wake(wake, ("colective",))
    with pytest.raises(InputError, match="'CX'"):
        linear_wake(wake, None, ("CX",))
    lost = replace(wake, converged=False, why="lost")
    with pytest.raises(InputError, match="lost"):
        linear_wake(lost)
    with pytest.raises(InputError, match="lost"):
        wave_matrix(lost, 1)
    with pytest.raises(InputError, match="'wind'"):
        nonlinear_step(wake, "wind")


def test_slices_are_interpolated_to_themselves_and_turn_from_blade_to_blade(wake):
    rng = np.random.default_rng(2)
    periodic = jax.tree.map(lambda a: jnp.asarray(rng.normal(size=(8, *a.shape[1:]))), wake.state)
    base = WakeBase(periodic, wake.model)
    for leaf, now, later in zip(
        *map(jax.tree.leaves, (periodic, base.at(jnp.pi / 4), base.at(3 * jnp.pi / 4))), strict=True
    ):
        np.testing.assert_allclose(now, leaf[1::2], atol=1e-12)
        np.testing.assert_allclose(later, jnp.roll(now, -1, axis=0), atol=1e-12)


def test_a_level_wake_taken_for_one_over_a_slope_has_the_same_model(wake, model):
    """The way of slopes (all blades, interpolated slices, disturbances alike) on a case whose answer is known."""
    state = spread(jax.tree.map(jnp.asarray, wake.state), 8)
    slices, rng = replace(wake, state=state, psi=np.arange(8) * np.pi / 4), np.random.default_rng(4)
    orbit, base, u = orbit_of(slices, nodes=2), WakeBase(state, wake.model), inputs_of(wake.model)
    assert float(orbit.period) == pytest.approx(np.pi / 2)
    x, state_of = ravel_pytree(orbit.start)
    v, w = rng.normal(size=x.size), rng.normal(size=3)

    @jax.jit
    def push(t):
        def both(x, u):
            rate, out = disturbed_rhs(t, x, u, base), disturbed_outputs(t, x, u, base)
            return ravel_pytree(rate)[0], jnp.stack([out.CT, out.CQ, out.lambda0])

        return jax.jvp(both, (orbit.start, u), (state_of(jnp.asarray(v)), type(u)(*jnp.asarray(w))))

    for t in orbit.t:
        (rest, _), (rate, out) = push(t)
        assert np.abs(rest).max() < 1e-9
        np.testing.assert_allclose(rate, model.a @ v + model.b @ w, atol=1e-10 * np.abs(rate).max())
        np.testing.assert_allclose(out, model.c @ v + model.d @ w, atol=1e-10 * np.abs(out).max())
