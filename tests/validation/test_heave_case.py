"""Heave in both models: histories of a linear system, the march, ground at rest, and what the rows say."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from wakes import COARSE

from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.linearisation.outputs import WakeOutputs
from rotorjax.ode.models import LinearModel
from rotorjax.rotor.catalogue import load
from rotorjax.validation import heave, heaving
from rotorjax.validation.case import Subject
from rotorjax.validation.heave import Each
from rotorjax.validation.heaving import Heave, Heaving, of_finite_states, of_free_wake
from rotorjax.wake.loads import WakeInputs
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import wake_settings


def made_up(rates=(-0.4, -1.1), gain=1.0):
    b, c = np.array([[0.3, -0.2], [0.5, 0.4]]), gain * np.array([[1.0, -0.5], [0.2, 0.7]])
    names = ("climb", "height"), ("induced", "CT"), ("ΩR", "R"), ("ΩR", "-")
    d = gain * np.array([[-0.1, 0.02], [0.3, 0.0]])
    return Heaving(0.05, 0.006, LinearModel(np.diag(rates), b, c, d, ("x", "y"), *names))


def test_history_is_the_linear_systems_own():
    model, size, omega, psi = made_up(rates=(-0.4, 0.3)), 0.01, 0.7, heaving.instants()

    def inputs(t):
        return size * np.array([omega * np.sin(omega * t), 1 - np.cos(omega * t)])

    m = model.linear
    path = solve_ivp(
        lambda t, x: m.a @ x + m.b @ inputs(t), (0, psi[-1]), np.zeros(2), t_eval=psi, rtol=1e-10, atol=1e-14
    )
    expected = (m.c @ path.y + m.d @ inputs(psi)).T
    np.testing.assert_allclose(model.history(Heave(jnp.asarray(size), jnp.asarray(omega))), expected, atol=1e-9)


def test_what_is_read_off_the_first_revolutions_is_the_response_once_a_start_is_forgotten():
    model = made_up(rates=(-5.0, -7.0))
    for frequency in (0.5, 1.0):
        np.testing.assert_allclose(model.early(frequency), model.response(np.array([frequency]))[0], rtol=1e-6)


def test_rows_of_equal_models_are_met_and_of_others_are_not():
    same, point = made_up(), heave.points(Subject())[-1]
    found = heave.rows(point, Each(same, made_up(gain=0.5), same))
    assert len(found) == 11
    assert all(row.met and row.difference == pytest.approx(0, abs=1e-12) for row in found)
    assert sum(not row.met for row in heave.rows(point, Each(made_up(gain=-2.0), same, same))) == len(found)
    half_a_turn = [r for r in heave.rows(point, Each(made_up(gain=-1.0), same, same)) if "phase" in r.quantity]
    assert all(abs(row.difference or 0) == pytest.approx(180) for row in half_a_turn)
    assert pytest.approx(12.7, abs=0.05) == heave.LAG_DEG


def test_picture():
    one, at = made_up(), heave.points(Subject())
    models, quarter = [Each(one, made_up(gain=0.5), one)] * 2, np.zeros((heaving.instants().size, 2))
    assert len(heave.draw(at, models, heave.HeaveChanges(quarter, quarter, quarter)).axes) == 8


def test_finite_states_at_rest_follow_the_steady_ground_effect():
    """The response to slow heave is the slope of trims over height."""
    rotor, settings = load("caradonna_tung"), wake_settings(**COARSE, azimuths=4)
    wakes = [free_wake(*rotor, ground=plane(h), settings=settings) for h in (0.99, 1.0, 1.01)]
    low, middle, high = of_finite_states(wakes, "quasi-steady", radial_terms=1, source_terms=3)
    slope = np.array([high.lambda0 - low.lambda0, high.CT - low.CT]) / 0.02
    np.testing.assert_allclose(middle.response(np.zeros(1))[0].real, slope, rtol=2e-3)
    assert np.abs(middle.response(np.array([2.0]))[0, 1]) > 10 * abs(slope[1])  # climb, not height
    with pytest.raises(InputError, match="ground"):
        of_finite_states([free_wake(*rotor, settings=settings)], "quasi-steady")


class Wake(NamedTuple):
    """A wake of two states that is the linear system itself. at (2,): its inputs, climb and height, at rest."""

    at: jax.Array


def test_march_and_linear_wake_speak_of_the_same_heave(monkeypatch):
    """On a wake that is linear: heave reaches it as climb and height, and the climb is taken off its inflow."""
    true, heave_ = made_up(), Heave(jnp.asarray(0.01), jnp.asarray(0.8))
    m, rest = true.linear, jnp.array([0.0, 1.0])
    counted = replace(m, d=m.d + np.diag([1.0, 0.0]), outputs=("lambda0", "CT"))  # climb included, as wakes have it

    def moved(u):
        return jnp.stack([u.climb, u.height]) - rest

    def found(state, velocities, inputs, model):
        out = counted.c @ state + counted.d @ moved(inputs)
        return WakeOutputs(out[1], out[1], out[0], out)

    monkeypatch.setattr(heaving, "inputs_of", lambda model: WakeInputs(jnp.zeros(()), *model.at))
    monkeypatch.setattr(heaving, "rhs", lambda psi, state, u, model: m.a @ state + m.b @ moved(u))
    monkeypatch.setattr(heaving, "velocities_along", lambda *arguments: (None, None))
    monkeypatch.setattr(heaving, "_read", found)
    monkeypatch.setattr(heaving, "linear_wake", lambda *arguments: None)
    monkeypatch.setattr(heaving, "average", lambda periodic: counted)
    solution: Any = SimpleNamespace(model=Wake(rest), state=jnp.zeros(2), mean_inflow=0.05, CT=0.006)
    linear = of_free_wake(solution).history(heave_)
    np.testing.assert_allclose(linear, true.history(heave_), atol=1e-12)
    marched = heaving.marched(solution, heave_)
    np.testing.assert_allclose(marched, linear, atol=1e-8)
    assert heave.march_row(heave.points(Subject())[-1], heave.HeaveChanges(marched, linear, linear)).met
