"""Linear models in steps: the same calls as the rotor they are made of, and what a model's own response says."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import rotorjax as rj
from rotorjax.errors import InputError
from rotorjax.ode.models import LinearModel, PeriodicModel

SPEED = {"omega_rad_s": 20.0}


@pytest.fixture(scope="module")
def swinging():
    """x' = v, v' = −(1 + ½ cos t) x − v/5 + u, over 64 times of a revolution."""
    t = 2 * np.pi * np.arange(64) / 64
    a = np.zeros((64, 2, 2))
    a[:, 0, 1], a[:, 1, 0], a[:, 1, 1] = 1.0, -(1 + 0.5 * np.cos(t)), -0.2
    b, c, d = np.tile([[0.0], [1.0]], (64, 1, 1)), np.tile([[1.0, 0.0]], (64, 1, 1)), np.zeros((64, 1, 1))
    names = {"states": ("x", "v"), "inputs": ("push",), "outputs": ("x",)}
    units = {"state_units": ("-", "-"), "input_units": ("-",), "output_units": ("-",)}
    base = {"x": np.zeros((64, 2)), "u": np.array([0.3]), "y": np.cos(t)[:, None]}
    return PeriodicModel(t, 2 * np.pi, a, b, c, d, **names, **units, **base, notes=SPEED)


def marched(model, steps, count):
    """x and outputs after so many steps with the input raised by one."""
    found = rj.march(model, steps)
    state, controls = found.start, replace(found.inputs, push=found.inputs.push + 1.0)
    for _ in range(count):
        state = found.step(state, controls)
    return state


def test_a_periodic_model_is_marched_to_fourth_order(swinging):
    fine = marched(swinging, 1024, 1024).x
    errors = [np.abs(marched(swinging, n, n).x - fine).max() for n in (8, 16, 32)]
    assert errors[2] < 1e-5
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(orders > 3.7)


def test_a_periodic_models_outputs_are_counted_from_its_trim(swinging):
    times, outputs = swinging.refined(256).step(np.ones(1))
    state = marched(swinging, 64, 17)
    assert state.y.x == pytest.approx(np.cos(times[32]) + outputs[32, 0], abs=1e-6)


def test_a_constant_model_is_marched_exactly_with_any_steps(swinging):
    model = LinearModel(
        swinging.a[16], swinging.b[0], swinging.c[0], swinging.d[0], ("x", "v"), ("push",), ("x",), ("-",), ("-",),
        notes=SPEED,
    )  # fmt: skip
    few, many = marched(model, 3, 3), marched(model, 60, 60)
    np.testing.assert_allclose(few.x, many.x, rtol=1e-12)
    in_seconds = replace(model, a=model.a * 20, b=model.b * 20, time="seconds")
    np.testing.assert_allclose(marched(in_seconds, 3, 3).x, few.x, rtol=1e-12)


def test_it_flies_as_the_rotor_does():
    trimmed = rj.trim(*rj.rotor("uh60"), 0.00575, inflow="uniform", advance=0.1, azimuths=8)
    rotor = rj.march(trimmed, precision="double")
    linear = rj.march(rj.linearise(trimmed, ["theta_0"], ["CT", "beta_0"], harmonics=None), rotor.steps_per_turn)
    assert linear.seconds == pytest.approx(rotor.seconds)
    thrusts = []
    one: Any
    for one in (rotor, linear):
        state, controls = one.start, replace(one.inputs, theta_0=one.inputs.theta_0 + np.deg2rad(0.2))
        for _ in range(one.steps_per_turn):
            state = one.step(state, controls)
            thrusts.append(float(state.y.CT))
    ours, theirs = np.reshape(thrusts, (2, -1))
    change = np.abs(ours - ours[0]).max()
    assert np.abs(ours - theirs).max() < 0.02 * change


def test_wrong_inputs(swinging):
    found: Any = rj.march(swinging)
    with pytest.raises(InputError, match="`controls` must be made of this march's inputs"):
        found.step(found.start, {"push": 1.0})
    with pytest.raises(InputError, match="`precision` is of a march of the rotor"):
        rj.march(swinging, precision="single")
    with pytest.raises(InputError, match="rotor's speed among its notes"):
        rj.march(replace(swinging, notes={}))
