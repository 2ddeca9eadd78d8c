"""The rotor in its free wake in flight: put together against forward mode, against the march, against dense ones."""

import ctypes
import resource
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from wakes import COARSE

from rotorjax.coupled import RotorState
from rotorjax.coupled_wake import coupled_wake
from rotorjax.errors import InputError
from rotorjax.linearisation import flight, kept, schedule, wake_flight
from rotorjax.linearisation.condensed import aligned, condensed, shares_of
from rotorjax.linearisation.drive import drive_of
from rotorjax.linearisation.found import Wanted
from rotorjax.linearisation.hover import Flat, products
from rotorjax.linearisation.instant import MOTIONS, instant
from rotorjax.linearisation.memory import give_back
from rotorjax.linearisation.modes import RotorMode
from rotorjax.linearisation.rotor import Base, SteadyState, rates
from rotorjax.linearisation.settled import mirrored, settled
from rotorjax.ode.harmonic import average
from rotorjax.ode.orbit import make_orbit
from rotorjax.ode.outcome import Outcome
from rotorjax.ode.repeated import leading
from rotorjax.ode.runge_kutta import RK4
from rotorjax.ode.trajectory import march
from rotorjax.rotor.hub import rotor_inputs
from rotorjax.simulation.march import marching
from rotorjax.trim.means import Means
from rotorjax.trim.run import Result, request
from rotorjax.trim.verdict import Verdict
from rotorjax.wake.equilibrium import full_state, spread
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.start import prescribed

INPUTS, OUTPUTS = ("theta_0", "theta_1c", "q", "w", "gust_aft"), ("CT", "M", "beta_1s", "lambda_1c", "lift_0")
TINY = {**COARSE, "panels": 4, "closure_turns": 0, "closure_bundles": 0, "age_step_deg": 30.0, "near_wake_deg": 120.0}
THICK = {
    "free_turns": 4 / 12,
    "inboard": (0.45,),
    "tip_core": 0.1,
    "near_core": 0.1,
    "control_core": 0.05,
    "circulation_lag": 0.4,
}


@pytest.fixture(scope="module")
def base(uh60):
    """A periodic march in a wind, found from a prescribed wake that knows of none."""
    settings = wake_settings(**TINY | THICK)
    still = free_wake(*uh60, None, settings)
    own = full_state(still, spread(prescribed(still, 0.05), 1))[0]
    p, zero = marching(coupled_wake(*uh60, settings)), jnp.zeros(4)
    wake = jax.tree.map(lambda v: jnp.concatenate([v, jnp.zeros((3, *v.shape[1:]))]), own)
    x = SteadyState(RotorState(zero.at[0].set(0.05), zero, zero.at[0].set(0.03), zero), wake)
    u = drive_of(rotor_inputs(theta_0=0.25, theta_1c=0.03, theta_1s=-0.06, u=0.2), p)
    start = Outcome(None, 0.0, (0.0,), 0, True, "made up", 0.0)
    orbit = make_orbit(0.0, jax.tree.map(lambda v: v[None], x), np.pi / 2, start)
    found = settled(Base(p, u, orbit, "a free wake"), wake_flight.passage_azimuths(p, 48))
    assert found.orbit.converged, found.orbit.why
    return found


@pytest.fixture(scope="module")
def model(base):
    return wake_flight.all_states(base, INPUTS, OUTPUTS)


def test_matrices_are_those_of_forward_mode(base):
    """At an azimuth of its own, along random directions of all states and inputs."""
    rng, psi, x = np.random.default_rng(0), base.orbit.t[0] + 0.3, base.orbit.start
    found = instant(psi, x, base.u, base.p, INPUTS, OUTPUTS)
    z = jnp.concatenate([ravel_pytree(x)[0], jnp.stack([base.u[name] for name in INPUTS])])
    n, along = found.a.shape[0], rng.normal(size=(4 * MOTIONS + len(INPUTS), z.size))  # as many as it takes itself
    truth = products(Flat(x, INPUTS, OUTPUTS), z, psi, base.u, base.p, along).T
    v, w = along[:, :n].T, along[:, n:].T
    np.testing.assert_allclose(found.a @ v + found.b @ w, truth[:n], atol=1e-11 * np.abs(truth[:n]).max())
    np.testing.assert_allclose(found.c @ v + found.d @ w, truth[n:], atol=1e-11 * np.abs(truth[n:]).max())


def test_steps_and_starts_march_as_the_nonlinear_equations_do(base, model):
    """Differences of marches over a passage, from a step of collective and from another start."""
    size, rng, nodes = 1e-5, np.random.default_rng(1), base.orbit.nodes
    flat, unravel = ravel_pytree(base.orbit.start)

    def end(x, u):
        path = march(rates, x, 0.0, np.pi / 2 / nodes, nodes, u, base.p, progress=False, tableau=RK4)
        return np.asarray(ravel_pytree(mirrored(path.last, 4))[0])

    rest = end(base.orbit.start, base.u)
    np.testing.assert_allclose(rest, flat, atol=1e-5)
    stepped = end(base.orbit.start, base.u | {"theta_0": base.u["theta_0"] + size}) - rest
    way = rng.normal(size=flat.size)
    moved = end(unravel(flat + size * way), base.u) - rest
    x, held = np.zeros((flat.size, 1)), np.eye(len(INPUTS))[:, :1]
    for k in range(model.steps):
        x = model.leap(k, x, held)
    for linear, truth in ((model.signs * x[:, 0], stepped), (model.across(way[:, None])[:, 0], moved)):
        assert np.abs(size * linear - truth).max() < 0.03 * np.abs(truth).max()


def test_leading_exponents_are_those_of_the_dense_monodromy_matrix(model):
    model = model.halved()
    matrix = model.across(np.eye(model.part.order))
    some = np.eye(len(matrix))[:, ::40]
    np.testing.assert_allclose(model.across_back(some), matrix[::40].T, atol=1e-12 * np.abs(matrix).max())
    found, values = leading(model, 8, depth=20), np.linalg.eigvals(matrix)
    largest = values[np.argsort(-np.abs(values))][: found.values.size]
    np.testing.assert_allclose(np.sort(np.abs(found.multipliers)), np.sort(np.abs(largest)), rtol=1e-4)
    assert found.residuals.max() < 1e-3
    np.testing.assert_allclose(
        np.exp(found.values * np.pi), found.multipliers**2, rtol=1e-9
    )  # signs are back after two
    modes = {mode.name: mode for mode in wake_flight.wake_modes(found, model.part.states)}
    assert {"collective lag", "regressing lag", "progressing lag", "differential lag"} <= set(modes)
    assert modes["regressing lag"].exponent.imag == pytest.approx(1 - modes["collective lag"].exponent.imag, abs=0.02)
    assert modes["collective lag"].shares["lag"] == pytest.approx(1.0, abs=0.05)


@pytest.fixture(scope="module")
def truth(model):
    return model.step(4)


@pytest.fixture(scope="module")
def one(model, truth):
    return condensed(model, 4, np.abs(truth).max(axis=0), 60)


@pytest.fixture(scope="module")
def other(model, truth, one):
    """The same flight in other directions."""
    return condensed(model, 4, np.abs(truth).max(axis=0) ** 0.5, 60, shares_of(one.model.states))


def gap(truth, model):
    """Largest differences of its unit steps, over the largest values."""
    own = np.stack([model.step(column)[1] for column in np.eye(len(INPUTS))], axis=-1)
    return np.abs(own - truth).max(axis=0) / np.abs(truth).max(axis=0)


def test_a_condensed_model_keeps_the_blades_and_the_steps(model, truth, one):
    coarse = condensed(model, 4, np.abs(truth).max(axis=0), 20).model
    assert (coarse.order, one.model.order) == (36, 76)
    assert one.model.states[:2] == ("beta_0", "beta_1c")
    assert np.median(gap(truth, one.model)) < min(0.015, 0.5 * np.median(gap(truth, coarse)))


def test_condensed_models_of_several_flights_have_states_of_one_meaning(truth, one, other):
    """One flight in two bases: in common coordinates what lies between is it, too."""
    assert other.model.states == one.model.states
    assert np.linalg.norm(one.model.b - other.model.b) > 0.1 * np.linalg.norm(one.model.b)
    turned = aligned([one, other])
    for own, before in zip(turned, (one.model, other.model), strict=True):
        np.testing.assert_allclose(gap(truth, own), gap(truth, before), atol=1e-8)
    middle = replace(turned[0], **{name: (getattr(turned[0], name) + getattr(turned[1], name)) / 2 for name in "abc"})
    assert np.median(gap(truth, middle)) < 0.03


def test_several_flights_make_one_scheduled_model(one, other):
    none, flights = np.zeros((len(OUTPUTS), len(INPUTS))), []
    for advance, part in ((0.1, one), (0.2, other)):
        asked = SimpleNamespace(request=request("uh60", 0.00575, "freewake", advance=advance))
        wake = wake_flight.WakeFindings(0, 0, (), 0.0, none, none, 0.0, part.basis)
        full, named = average(part.model), (RotorMode("coning", -0.5 + advance * 1j, {}, {}),)
        flights.append(flight.LinearFlight(asked, full, None, named, {}, part.model, (0,), none, none, none, wake))
    data = schedule.stitched(flights, "azimuth")
    assert list(data.advance_ratio.values) == [0.1, 0.2]
    high = [
        replace(one, result=SimpleNamespace(request=replace(one.result.request, height=h)))
        for one in flights
        for h in (1.0, 2.0)
    ]
    assert [*schedule.pictures(flights)] == [*schedule.pictures(high[:2])] == ["roots"]  # one speed: over height
    (alone,) = schedule.pictures(flights[:1]).values()
    assert alone.axes[0].get_legend().get_texts()[0].get_text() == "advance ratio 0.1"
    assert [*schedule.pictures(high)] == ["roots_height_1", "roots_height_2"]
    np.testing.assert_allclose(data.frequency.sel(mode="coning"), [0.1, 0.2])
    wake = RotorMode("wake collective", -0.2 + 1j, {}, {})  # others in every flight: no line goes from one to the next
    (drawn,) = schedule.pictures([replace(one, modes=(*one.modes, wake)) for one in flights]).values()
    assert sum(line.get_marker() == "None" for line in drawn.axes[0].lines) == 2  # coning, and zero growth
    for k, found in enumerate(flights):
        poles, own = (np.sort(np.linalg.eigvals(a).real) for a in (data["A"][k].values, found.full.a))
        np.testing.assert_allclose(poles, own, atol=1e-6)
    assert schedule.alike([replace(flights[0], wake=None)])[0] is flights[0].full


def test_a_flight_in_the_wake_is_kept_and_taken_up(one, tmp_path, monkeypatch):
    """But for the trim, which is set up anew with Pitt and Peters' inflow, and what is made of a flight in seconds."""
    asked = replace(request("uh60", 0.00575, "freewake", advance=0.1), wake=wake_settings(**TINY | THICK))
    trimmed = SimpleNamespace(z=np.arange(3.0), iterations=7, outcome=Outcome(None, 1e-7, (), 7, True, "made up", 0.0))
    means = Means(0.00575, 4e-4, 2e-4, 1e-4, 0.0, 0.0, *np.arange(12.0).reshape(4, 3))
    result = Result(asked, trimmed, means, Verdict("converged", "made up", 1e-4, 1e-3, 0.25), 1.5)
    step, condensation = np.random.default_rng(0).normal(size=(2, *one.model.d.shape[1:]))
    mode = RotorMode("wake collective", -0.2 + 1j, {"flap": 0.1, "inflow": 0.9}, {"wake[0]": 0.5})
    wake = wake_flight.WakeFindings(304, 48, (mode,), 1e-5, step, condensation, np.nan, one.basis)
    parts, nothing = (one.model, (0,), None, None, step, wake), (None, None)
    shelf, heard = kept.FlightShelf(tmp_path, Wanted(INPUTS, OUTPUTS), []), {}
    assert shelf.take_up(asked) is None
    shelf.keep(flight.LinearFlight(result, *nothing, (replace(mode, name="coning"), mode), {"trim": 2.0}, *parts))
    monkeypatch.setattr(kept, "restored", lambda *of: heard.update(restored=of) or trimmed)
    monkeypatch.setattr(kept, "completed", lambda *of: of)
    again, dear, _, clock = shelf.take_up(asked)
    _, state, outcome, damping = heard["restored"]
    np.testing.assert_array_equal(state["00"], trimmed.z)
    assert (outcome.residual, outcome.iterations, damping, clock.seconds) == (1e-7, 7, 0.25, {"trim": 2.0})
    assert again.verdict == result.verdict
    assert [found.name for found in dear.modes] == ["coning", "wake collective"]
    assert dear.wake.modes == (mode,)
    pairs = [(getattr(dear.periodic, name), getattr(one.model, name)) for name in "tabcdxuy"]
    pairs += [(getattr(dear.wake, name), getattr(wake, name)) for name in ("basis", "step_error", "condensed_error")]
    pairs += [(dear.wake.thrust, wake.thrust), (again.means.flap, means.flap), (dear.step_error, step)]
    for found, before in pairs:
        np.testing.assert_array_equal(found, before)
    with pytest.raises(InputError, match=r"holds one with wake\.tip_core"):
        shelf.take_up(replace(asked, wake=wake_settings(**TINY | THICK | {"tip_core": 0.11})))


@pytest.mark.skipif(sys.platform != "linux", reason="memory is counted by Linux, and given back by GNU's C library")
def test_memory_that_is_free_is_given_back():
    """A hundred megabytes in small pieces, freed but for the last, which holds them back."""

    def resident():
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()

    library, size, count = ctypes.CDLL(None), 50_000, 2000
    library.malloc.restype, library.free.argtypes = ctypes.c_void_p, [ctypes.c_void_p]
    pieces = [library.malloc(ctypes.c_size_t(size)) for _ in range(count)]
    for piece in pieces:
        ctypes.memset(piece, 1, size)
    for piece in pieces[:-1]:
        library.free(piece)
    before = resident()
    give_back()
    if hasattr(library, "malloc_trim"):
        assert before - resident() > 0.8 * size * count
    library.free(pieces[-1])


BAD = {
    "`slope` must be 0 .* 3: a level flight": ({"advance": 0.15, "height": 1.0, "slope_deg": 3.0}, {}),
    "has 'gust_aft'": ({}, {"inputs": ("gust_aft",)}),
    "has 'clearance_aft'": ({"advance": 0.15}, {"outputs": ("clearance_aft",)}),
    "`order` must be at least 13": ({"advance": 0.15}, {"order": 12}),
    "`harmonics` must lie in": ({"advance": 0.15}, {"harmonics": 12}),
}


@pytest.mark.parametrize("message", BAD)
def test_bad_input_is_refused_before_the_trim(message):
    asked, wanted = BAD[message]
    with pytest.raises(InputError, match=message):
        flight.check(request("uh60", 0.00575, "freewake", **asked), Wanted(**wanted))


def test_a_failed_trim_is_refused_and_a_lost_march_told(base):
    failed = base._replace(orbit=replace(base.orbit, converged=False, why="lost"))
    with pytest.raises(InputError, match="lost"):
        wake_flight.base_in_flight(failed, 48)
    with pytest.raises(InputError, match="lost"):
        wake_flight.all_states(failed, INPUTS, OUTPUTS)
