"""The rotor in its free wake in hover by wave number: against forward mode of all blades, and its small model."""

from dataclasses import replace
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from wakes import COARSE

import rotorjax as rj
from rotorjax.coupled import RotorState
from rotorjax.coupled_wake import coupled_wake
from rotorjax.errors import InputError
from rotorjax.linearisation import flight, hover_flight, rotor, trim_output
from rotorjax.linearisation.drive import drive_of
from rotorjax.linearisation.found import Wanted
from rotorjax.linearisation.hover import CHUNK, Flat, hover_model, members_of, pushed
from rotorjax.linearisation.hover_small import small_hover
from rotorjax.linearisation.rotor import Base, SteadyState, rate_and_readings, state_names
from rotorjax.linearisation.stages import Stages
from rotorjax.ode.orbit import make_orbit
from rotorjax.ode.outcome import Outcome
from rotorjax.rotor.hub import rotor_inputs
from rotorjax.simulation.march import marching
from rotorjax.trim.run import Result, request
from rotorjax.wake.equilibrium import full_state, spread
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.start import prescribed

INPUTS = ("theta_0", "theta_1c", "q", "w")
OUTPUTS = ("CT", "M", "beta_1s", "lambda_1c", "lift_0")
TINY = {**COARSE, "panels": 4, "closure_turns": 0, "closure_bundles": 0, "age_step_deg": 30.0, "near_wake_deg": 120.0}


@pytest.fixture(scope="module")
def base(uh60):
    """A prescribed wake, alike on all blades: derivatives are exact there as anywhere."""
    settings = wake_settings(**TINY | {"free_turns": 1.0})
    still = free_wake(*uh60, None, settings)
    own = full_state(still, spread(prescribed(still, 0.05), 1))[0]
    p, zero = marching(coupled_wake(*uh60, settings)), jnp.zeros(4)
    wake = jax.tree.map(lambda v: jnp.concatenate([v, jnp.zeros((3, *v.shape[1:]))]), own)
    x = SteadyState(RotorState(zero.at[0].set(0.05), zero, zero.at[0].set(0.03), zero), wake)
    states = jax.tree.map(lambda v: v[None], x)
    found = Outcome(None, 0.0, (0.0,), 0, True, "made up", 0.0)
    return Base(p, drive_of(rotor_inputs(theta_0=0.3), p), make_orbit(0.0, states, np.pi / 2, found), "a free wake")


@pytest.fixture(scope="module")
def model(base):
    return hover_model(base, INPUTS, OUTPUTS)


def test_rates_of_a_wake_alike_on_all_blades_are_so_from_every_azimuth(base):
    """In multi-blade coordinates the rates of a level hover do not depend on the azimuth, and have no cyclic part."""
    program, x = eqx.filter_jit(rate_and_readings), base.orbit.start
    (one, read), (other, again) = (program(jnp.asarray(psi), x, base.u, base.p) for psi in (0.0, 0.7))
    flat, turned = (np.asarray(ravel_pytree(rate)[0]) for rate in (one, other))
    np.testing.assert_allclose(flat, turned, atol=1e-12 * np.abs(flat).max())
    names = state_names(x, base.p)[0]
    uneven = [k for k, name in enumerate(names) if any(part in name for part in ("_1c", "_1s", "_D"))]
    assert len(names) == flat.size == len(set(names))
    assert np.abs(flat[uneven]).max() < 1e-12
    assert float(read["CT"]) == pytest.approx(float(again["CT"]), rel=1e-12)


@pytest.mark.slow
def test_waves_are_the_equations_of_all_blades_from_any_azimuth(base, model):
    """A random disturbance of every state and input; columns were made at ψ = 0 by moving one blade."""
    rng, members = np.random.default_rng(0), members_of(base.orbit.start, 4)
    x, v = rng.normal(size=members.size), rng.normal(size=len(INPUTS))
    flat, psi = np.asarray(ravel_pytree(base.orbit.start)[0]), base.orbit.t[0] + 0.4
    z, along = np.concatenate([flat, [base.u[name] for name in INPUTS]]), np.zeros((CHUNK, flat.size + v.size))
    along[0] = np.concatenate([x, v])
    function = Flat(base.orbit.start, INPUTS, OUTPUTS)
    found = np.asarray(pushed(function, jnp.asarray(z), psi, base.u, base.p, jnp.asarray(along)))[0]
    rate, out, seen = found[: x.size], found[x.size :], model.d @ v
    order = ("0", "1c", "1s", "D")
    for wave in model.waves:
        a, b, c = wave.in_real()
        own = np.concatenate([members[order.index(name)] for name in wave.coordinates])
        np.testing.assert_allclose(a @ x[own] + b @ v, rate[own], atol=1e-9 * np.abs(rate[own]).max())
        seen = seen + c @ x[own]
    np.testing.assert_allclose(seen, out, atol=1e-9 * np.abs(out).max())
    assert model.outputs[-1] == "lift_0[3]"


def test_responses_and_steps_are_those_of_the_joined_real_model(model):
    joined = model.linear()
    assert joined.order == 3 * len(model.names)
    assert joined.states[0] == "beta_0"
    assert "gamma_near_1s[0,0]" in joined.states
    np.testing.assert_allclose(model.response(np.array([0.7])), joined.response(np.array([0.7])), rtol=1e-7, atol=1e-9)
    times = np.linspace(0, 1.0, 5)
    np.testing.assert_allclose(model.step(times), joined.step(times), atol=1e-8)


def test_a_small_model_keeps_the_blades_and_the_steps(model):
    coarse, found = small_hover(model, 20), small_hover(model, 60)
    assert (coarse.model.order, found.model.order) == (20, 60)
    assert found.model.states[:2] == ("beta_0", "beta_0_rate")
    assert found.model.states[12] == "lambda_1c"
    row = model.outputs.index("beta_1s"), model.inputs.index("theta_1c")
    assert np.median(found.step_error) < 0.5 * np.median(coarse.step_error)
    assert found.step_error[row] < 0.05
    times = np.linspace(0, 2 * np.pi, 49)
    truth = model.step(times)
    error = np.abs(found.model.step(times) - truth).max(axis=0) / np.abs(truth).max(axis=0)
    np.testing.assert_allclose(error[row], found.step_error[row], rtol=1e-6)


def test_modes_of_blades_and_wake_have_names(model):
    found, growing = hover_flight.hover_modes(model, leading=3)
    names = [mode.name for mode in found]
    assert {"coning", "collective lag", "differential flap", "regressing flap", "progressing flap"} <= set(names)
    assert sum(name.startswith("wake") for name in names) == 3
    assert set(growing) == {"0", "1c 1s", "D"}
    value = next(mode.exponent for mode in found if mode.name == "coning")
    assert np.abs(model.waves[0].resolvent.poles - value).min() < 1e-9


@pytest.fixture
def hovered(base, monkeypatch):
    """A trim that is the base."""
    monkeypatch.setattr(rotor, "base_of", lambda trimmed, *_: base)
    flown = SimpleNamespace(CT=0.00575, controls=np.zeros(4))
    return Result(request("uh60", 0.00575, "freewake"), None, flown, None, 0.0)


def test_the_front_door_takes_a_hover(hovered, model):
    full = rj.linearise(hovered, INPUTS, OUTPUTS)
    np.testing.assert_array_equal(full.a, model.linear().a)
    assert full.notes["CT"] == 0.00575
    small = rj.linearise(hovered, INPUTS, OUTPUTS, order=20, time="seconds")
    assert (small.order, small.time) == (20, "seconds")
    with pytest.raises(InputError, match="`harmonics` must be"):
        rj.linearise(hovered, harmonics=None)


def test_it_is_written_like_any_linear_rotor(hovered, tmp_path, monkeypatch):
    monkeypatch.setattr(trim_output, "numbers", lambda result: {})
    found = hover_flight.hovering(hovered, Wanted(INPUTS, OUTPUTS), Stages(None))
    content = trim_output.write(found, tmp_path)
    files = {f"{name}.{end}" for name in ("reduced", "full") for end in ("mat", "nc")}
    files |= {f"{name}.{end}" for name in ("roots", "steps") for end in ("png", "pdf")}
    assert {path.name for path in tmp_path.iterdir()} == files | {
        "README.md",
        "report.md",
        "report.html",
        "linearise.json",
    }
    assert content["reduced_order"] == found.small.model.order == 20
    assert content["inputs"]["w"]["unit"] == "ΩR"
    assert content["reduced_step_error"]["CT"]["theta_0"] == found.small.step_error[0, 0]
    assert "UH-60" in trim_output.lines(found)
    assert "## Growing modes" in (tmp_path / "report.md").read_text()


BAD = {
    "`tilt` must be 0 in hover": {"tilt_deg": 3.0},
    "`slope` must be 0 .* take inflow 'vpbfsm'": {"height": 1.0, "slope_deg": 3.0},
}


@pytest.mark.parametrize("message", BAD)
def test_what_is_no_level_hover_is_refused(message):
    with pytest.raises(InputError, match=message):
        flight.check(request("uh60", 0.00575, "freewake", **BAD[message]), Wanted())


def test_two_blades_unknown_names_and_failed_trims_are_refused(base):
    hovering = request("uh60", 0.00575, "freewake")
    two = replace(hovering, rotor=replace(hovering.rotor, blades=2, name="two blades"))
    with pytest.raises(InputError, match="at least three blades"):
        flight.check(two, Wanted())
    with pytest.raises(InputError, match="has 'gust_aft'"):
        flight.check(hovering, Wanted(inputs=("gust_aft",)))
    with pytest.raises(InputError, match="harmonics"):
        flight.check(hovering, Wanted(harmonics=4))
    failed = base._replace(orbit=replace(base.orbit, converged=False))
    with pytest.raises(InputError, match="converged"):
        hover_model(failed, INPUTS, OUTPUTS)
