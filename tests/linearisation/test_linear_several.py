"""Several rotors linearised: what is marched, one rotor's own model where they are far apart, mirror images."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
from wakes import COARSE

import rotorjax as rj
from rotorjax.api.several import SolvedTogether
from rotorjax.errors import InputError
from rotorjax.linearisation.several import Pulses, about, linear_several, pulses, realised
from rotorjax.linearisation.system import linear_wake
from rotorjax.ode.harmonic import harmonic_model
from rotorjax.simulation.several_march import marching, stepped
from rotorjax.wake.several_dynamics import SeveralInputs, nominal
from rotorjax.wake.several_solution import SeveralSolution

SETTINGS = rj.WakeSettings(**COARSE | {"closure_turns": 0, "closure_bundles": 0})
STEP = 2 * np.pi / 24
march_step = eqx.filter_jit(stepped)


@pytest.fixture(scope="module")
def rotor():
    return rj.rotor("knight_hefner_2", 8.0)


@pytest.fixture(scope="module")
def alone(rotor):
    kind, hover = rotor
    return rj.solve(rj.free_wake(kind, hover, None, SETTINGS)).found


def pair(rotor, apart):
    kind, hover = rotor
    return rj.several_wakes(kind, hover, [(0, -apart / 2, 0), (0, apart / 2, 0)], settings=SETTINGS)


def of_both(alone, several):
    """Both rotors in the wake of one alone, all slices alike."""
    return jax.tree.map(lambda a: jnp.broadcast_to(a[None], (2, several.slices, *a.shape[1:])), alone.state)


@pytest.fixture(scope="module")
def apart(rotor, alone):
    """Two that leave each other alone, as they are solved."""
    several = pair(rotor, 1000.0)
    ct, cp, induced, inflow = (np.full(2, getattr(alone, n)) for n in ("CT", "CP", "CP_induced", "mean_inflow"))
    state = of_both(alone, several)
    return SeveralSolution(several, state, (alone, alone), True, "", alone.residual, 0, ct, cp, induced, inflow)


@pytest.fixture(scope="module")
def model(apart):
    return linear_several(apart, turns=1, phases=1)  # for these every instant is alike


def marched(several, state, inputs, count):
    """Thrust and torque of both, at the start of so many steps."""
    several, rows = marching(several), []
    x = about(several, state, jnp.zeros(()))
    for _ in range(count):
        x, y = march_step(x, jnp.asarray(STEP), inputs, several)
        rows.append(jnp.concatenate([y.thrust, y.power / inputs.omega]))
    return np.array(rows)


def test_a_step_is_that_of_the_nonlinear_march(apart, model):
    """Over a revolution, of one collective and one speed; the other rotor feels nothing of it."""
    u, times = nominal(apart.model), STEP * np.arange(25)
    rest, linear = marched(apart.model, apart.state, u, 25), model.step(times)
    for name, size, m in (("theta_0", 2e-4, 0), ("omega", 2e-4, 3)):
        moved = replace(u, **{name: getattr(u, name).at[m % 2].add(size)})
        truth = (marched(apart.model, apart.state, moved, 25) - rest) / size
        for q in (m % 2, 2 + m % 2):
            np.testing.assert_allclose(linear[:, q, m], truth[:, q], atol=0.03 * np.abs(truth[:, q]).max())
        other = 1 - m % 2
        assert np.abs(linear[:, other, m]).max() < 1e-3 * np.abs(truth).max()


def test_far_apart_each_has_one_rotors_own_model(alone, model):
    """From 30° on: before, what the march reads, the loads of the line's solution, is not what that model reads, those
    of the state's circulation, which follows it with a lag.
    """
    settings = replace(alone.model.settings, bound_filter="solution")
    solution = replace(alone, model=replace(alone.model, settings=settings))
    one = harmonic_model(linear_wake(solution, ("collective",), ("CT", "CQ")), (0,))
    exact = one.step(STEP * np.arange(25))[..., 0]
    ours = model.step(STEP * np.arange(25))
    for i in range(2):
        gap = np.abs(ours[2:, [i, 2 + i], i] - exact[2:]).max(axis=0)
        assert np.all(gap < 0.01 * np.abs(exact).max(axis=0))
    np.testing.assert_allclose(model.y[:2], alone.CT, rtol=1e-5)


def test_what_is_named_is_found(apart, model):
    some = linear_several(apart, ["omega", "theta_0"], ["CT[1]"], 3, turns=0.25, phases=1)
    assert (some.inputs[:3], some.outputs, some.order) == (("omega[0]", "omega[1]", "theta_0[0]"), ("CT[1]",), 3)
    np.testing.assert_allclose(some.d[0], model.d[1, [2, 3, 0, 1]])
    assert model.inputs == ("theta_0[0]", "theta_0[1]", "omega[0]", "omega[1]")
    assert model.input_units == ("rad", "rad", "Ω", "Ω")
    assert model.outputs[3:5] == ("CQ[1]", "lambda0[0]")
    assert model.output_units[3:5] == ("-", "ΩR")
    assert model.notes["step_error"] < 0.01
    stepping = rj.march(model)
    state = stepping.step(stepping.start, replace(stepping.inputs, omega=[1.0, 1.01]))
    assert state.y.CT[1] > state.y.CT[0]
    with pytest.raises(InputError, match="must hold 2 of `omega`, but holds 1"):
        stepping.step(stepping.start, replace(stepping.inputs, omega=1.0))
    with pytest.raises(InputError, match="must name what the model has"):
        linear_several(apart, ["collective"])
    with pytest.raises(InputError, match="must be converged to be linearised"):
        linear_several(replace(apart, converged=False))
    with pytest.raises(InputError, match="they stand on one shaft"):
        linear_several(replace(apart, model=replace(apart.model, slices=1)))
    with pytest.raises(InputError, match=r"`harmonics` must be \(0,\) for several rotors"):
        rj.linearise(SolvedTogether(apart), harmonics=None)


def test_side_by_side_the_rotors_answer_as_mirror_images(rotor, alone):
    near = pair(rotor, 2.5)
    found = pulses(near, of_both(alone, near), turns=1 / 12, phases=1).outputs.reshape(3, 3, 2, 2, 2)
    np.testing.assert_allclose(found[:, :, 0, :, 0], found[:, :, 1, :, 1], atol=1e-12)
    np.testing.assert_allclose(found[:, :, 0, :, 1], found[:, :, 1, :, 0], atol=1e-12)
    assert np.abs(found[:, 0, 0, :, 1]).max() > 1e-4 * np.abs(found[:, 0]).max()
    # and the other one's part is the derivative of the march
    u = nominal(near)
    faster, slower = (
        marched(near, of_both(alone, near), SeveralInputs(u.theta_0, u.omega.at[1].add(s)), 1) for s in (1e-4, -1e-4)
    )
    np.testing.assert_allclose(found[0, :2, :, 1, 1].ravel(), (faster - slower)[0] / 2e-4, rtol=1e-5, atol=1e-9)


def test_a_system_that_grows_is_found_from_its_pulses():
    rng = np.random.default_rng(0)
    a = np.zeros((5, 5))
    a[:] = scipy.linalg.block_diag([[0.3, 2.0], [-2.0, 0.3]], [[-1.0]], [[-10.0]], [[0.0]])
    b, c, d = rng.normal(size=(5, 2)), rng.normal(size=(3, 5)), rng.normal(size=(3, 2))
    joint = scipy.linalg.expm(STEP * np.block([[a, b], [np.zeros((2, 7))]]))
    leap, push = joint[:5, :5], joint[:5, 5:]
    outputs = np.array([d, *(c @ np.linalg.matrix_power(leap, k) @ push for k in range(24))])
    found = realised(Pulses(outputs, np.zeros(3), STEP))
    assert found[0].shape == (5, 5)
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(found[0])), np.sort_complex(np.linalg.eigvals(a)), atol=1e-6
    )
    at = [m[2] @ np.linalg.solve(2.0 * np.eye(5) - m[0], m[1]) + m[3] for m in (found, (a, b, c, d))]
    np.testing.assert_allclose(*at, rtol=1e-6)
    with pytest.raises(InputError, match="`order`"):
        realised(Pulses(outputs, np.zeros(3), STEP), 100)
