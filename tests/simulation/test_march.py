"""The march in steps: that of the equations, in single precision, with the closure once a step, several at once."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rotorjax as rj
from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.rotor import catalogue
from rotorjax.rotor.hub import rotor_inputs
from rotorjax.simulation.case import COLUMNS, SimulationCase
from rotorjax.simulation.march import advance, begun, march, marching
from rotorjax.simulation.pace import Pace
from rotorjax.simulation.run import check_histories
from rotorjax.simulation.start import from_wake
from rotorjax.simulation.step import least_steps
from rotorjax.trim.free_wake import first_guess
from rotorjax.trim.in_wake import TrimmedInWake, wake_trim
from rotorjax.wake.settings import flight_settings

TINY = {"panels": 5, "age_step_deg": 30.0, "near_wake_deg": 120.0, "closure_turns": 1, "closure_bundles": 1}


@pytest.fixture(scope="module")
def start():
    """Not trimmed: a prescribed wake in a wind over ground, enough to march from."""
    settings = flight_settings(4, **TINY)
    p = wake_trim(*catalogue.load("uh60"), rotor_inputs(u=0.15), 0.0058, plane(1.0), settings)
    z = first_guess(p, jnp.array([0.27, 0.04, -0.04]), 0.06, settings.azimuths, 0.03)
    start = from_wake(TrimmedInWake(z, p, None, 0))
    return replace(start, p=marching(start.p))


@eqx.filter_jit
def stepped(state, dt, u, p):
    return advance(state, jnp.zeros(()), dt, lambda _: u, p)


def gone(start, old_age, count, angle=1.0):
    """The march over `angle` in so many steps."""
    state = begun(start.x, start.inputs, start.p, old_age)
    for _ in range(count):
        state = stepped(state, jnp.asarray(angle / count), start.inputs, start.p)
    return state


@pytest.fixture(scope="module")
def fine(start):
    return gone(start, "stage", 16)


def off(a, b):
    return max(float(jnp.max(jnp.abs(x - y))) for x, y in zip(*map(jax.tree.leaves, (a.x, b.x)), strict=True))


@pytest.mark.parametrize(("old_age", "most"), [("step", 5e-3), ("two steps", 1e-2)])
def test_the_closure_once_a_step_is_of_second_order(start, fine, old_age, most):
    coarse, finer = (off(gone(start, old_age, count), fine) for count in (8, 16))
    assert coarse < most
    assert 1.6 < np.log2(coarse / finer) < 3.2


def test_single_precision(start, fine):
    """16 steps of a third of a revolution, against double precision."""
    single = march(start, 48, old_age="stage")
    double = gone(start, "stage", 16, 2 * np.pi / 3)
    state = single.start
    assert np.isnan(state.y.CT)
    for _ in range(16):
        state = single.step(state)
    assert {leaf.dtype for leaf in jax.tree.leaves(state.x)} == {np.dtype(np.float32)}
    assert float(state.y.CT) == pytest.approx(float(double.y.CT), rel=1e-4)
    assert off(state, double) < 1e-4
    with pytest.raises(InputError, match=r"omega <= 4.16 with 48 .*, but has 5: .* steps_per_turn = 58"):
        single.step(state, replace(single.inputs, omega=5.0))
    with pytest.raises(FloatingPointError, match="in step 17"):
        single.step(state, replace(single.inputs, theta_0=np.nan))


def test_too_few_steps_are_refused_with_the_number_that_is_enough(start):
    least = least_steps(start)
    assert least == 12
    with pytest.raises(InputError, match="`steps_per_turn` must be at least 12 for this wake, but is 10"):
        march(start, 10)
    with pytest.raises(InputError, match=r"`precision` must be one of \('single', 'double'\), but is 'half'"):
        march(start, precision="half")  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="`old_age` must be one of"):
        march(start, old_age="never")  # pyright: ignore[reportArgumentType]


@pytest.fixture(scope="module")
def level():
    return rj.trim(*rj.rotor("uh60"), 0.00575, inflow="uniform", advance=0.15, azimuths=8)


def test_an_inflow_model_is_marched_by_the_same_calls(level):
    """Several at once are as one; a pull on the collective lifts; a trim keeps its thrust over a revolution."""
    one, both = rj.march(level, precision="double"), rj.march(level, precision="double", batch=2)
    controls = replace(one.inputs, theta_0=one.inputs.theta_0 + 0.01)
    mixed = jax.tree.map(lambda a, b: np.stack([a, b]), one.inputs, controls)
    state, pulled, states = one.start, one.start, both.start
    thrust = []
    for _ in range(one.steps_per_turn):
        state, pulled, states = one.step(state), one.step(pulled, controls), both.step(states, mixed)
        thrust.append(float(state.y.CT))
    np.testing.assert_allclose(states.y.CT, [state.y.CT, pulled.y.CT], rtol=1e-12)
    assert float(pulled.y.CT) > 1.02 * float(state.y.CT)
    assert np.mean(thrust) == pytest.approx(level.means.CT, rel=5e-4)  # trimmed with eight azimuths


def test_what_is_of_one_rotor_without_surfaces_says_so(level):
    among = replace(level, request=replace(level.request, surfaces=rj.wall(3.0, -1.0, 1.0, length=1.0, panel=1.0)))
    with pytest.raises(InputError, match=r"must be a trim without surfaces, but has some: step it by rj\.march"):
        rj.linearise(among)
    with pytest.raises(
        InputError, match=r"a trim of one rotor \(rj.trim\), several .* or a linear model, but is a Plane"
    ):
        rj.march(plane(1.0))  # pyright: ignore[reportCallIssue, reportArgumentType]
    with pytest.raises(InputError, match="of one rotor or several, but is neither"):
        rj.linearise(plane(1.0))  # pyright: ignore[reportArgumentType]


def test_a_history_faster_than_the_steps_is_warned_of(level):
    t, columns = np.array([0.0, 0.1, 0.104, 1.0]), np.zeros((4, len(COLUMNS)))
    columns[2:, 2], columns[:, -1] = 1.0, 100.0
    case = SimulationCase(level.request, 1.0, None, t, columns)
    omega = 2 * np.pi / 0.24
    with pytest.warns(
        UserWarning, match=r"between t = 0.1 and 0.104 s, in less than a step of 0.01 s: .* 50 Hz .* to 60"
    ):
        check_histories(case, omega, 24)
    check_histories(case, omega, 60)
    columns[:, 2] += 17.0
    with pytest.warns(UserWarning, match=r"collective_deg begins at 17, a jump at the start.*added to the trim"):
        check_histories(case, omega, 60)


def test_late_frames_are_counted():
    lines = []
    pace = Pace(lines.append)
    pace.start()
    for due in (-1.0, 0.02, 0.0):
        pace.frame(due, f"{due}")
    assert (pace.frames, pace.late) == (3, 2)
    assert pace.worst > 0.9
    assert lines[1] == "0.02  late 1"
