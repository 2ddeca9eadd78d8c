"""The linear rotor: blades seen from the hub in hover, closed forms, named modes, against the march, bad input."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from wakes import COARSE

from rotorjax.coupled import RotorState
from rotorjax.coupled_wake import coupled_wake
from rotorjax.errors import InputError
from rotorjax.linearisation import flight, identified, steps
from rotorjax.linearisation.compact import compact, frequencies, reduced
from rotorjax.linearisation.drive import drive_of
from rotorjax.linearisation.modes import modes
from rotorjax.linearisation.rotor import SteadyState, base_of, linear_rotor, rate_and_readings, state_names
from rotorjax.ode.harmonic import average, harmonic_model
from rotorjax.ode.hill import harmonic_transfer
from rotorjax.rotor.flap_lag import flap_frequency, lag_frequency
from rotorjax.rotor.hub import rotor_inputs
from rotorjax.trim.run import request, run
from rotorjax.trim.solve import trim
from rotorjax.wake.equilibrium import full_state, spread
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.start import prescribed

INPUTS = ("theta_0", "theta_1c", "theta_1s", "w", "q")


@pytest.fixture(scope="module")
def hover():
    return run(request("uh60", 0.00575, "pitt-peters")).trimmed


@pytest.fixture(scope="module")
def base(hover):
    return base_of(hover)


@pytest.fixture(scope="module")
def periodic(base):
    return linear_rotor(base)


@pytest.fixture(scope="module")
def linear(periodic):
    return average(periodic)


@pytest.fixture(scope="module")
def fast():
    return run(request("uh60", 0.00575, "pitt-peters", advance=0.3)).trimmed


@pytest.fixture(scope="module")
def in_flight(fast):
    return linear_rotor(base_of(fast))


def chosen(model, inputs, outputs=None):
    """Fewer inputs and outputs of a model."""
    m = [model.inputs.index(name) for name in inputs]
    q = [model.outputs.index(name) for name in outputs or model.outputs]
    pick = {
        "b": model.b[..., m], "c": model.c[..., q, :], "d": model.d[..., q, :][..., m], "u": model.u[m],
        "y": model.y[..., q], "inputs": tuple(inputs), "outputs": tuple(model.outputs[k] for k in q),
        "input_units": tuple(model.input_units[k] for k in m), "output_units": tuple(model.output_units[k] for k in q),
    }  # fmt: skip
    return replace(model, **pick)


def gain(model, output, name, omega=0.0):
    """One response at one frequency."""
    return model.response(np.array([omega]))[0, model.outputs.index(output), model.inputs.index(name)]


def test_hover_is_time_invariant_seen_from_the_hub(base, periodic):
    whole = linear_rotor(at_azimuths(base, 3), ["theta_0"], ["CT"])
    np.testing.assert_allclose(whole.a, np.broadcast_to(periodic.a, whole.a.shape), atol=1e-9)
    assert periodic.order == 19
    assert periodic.states[1] == "beta_1c"
    assert periodic.states[-3:] == ("lambda_0", "lambda_1c", "lambda_1s")
    assert len(set(periodic.states)) == 19


def at_azimuths(base, nodes):
    """The same hover at several azimuths of a passage."""
    angles = base.orbit.period * jnp.arange(nodes) / nodes
    states = jax.tree.map(lambda v: jnp.repeat(v, nodes, axis=0), base.orbit.x)
    return base._replace(orbit=eqx.tree_at(lambda o: (o.t, o.x), base.orbit, (angles, states)))


def test_modes_are_the_blades_shifted_by_the_rotation(hover, linear):
    """Collective and differential at a blade's own frequencies, cyclic ones a rotation away; all damped."""
    values = np.linalg.eigvals(linear.a)
    assert np.all(values.real < 0)
    # the inflow does not hear the differential modes: those are the single blade's
    names = list(linear.states)
    own = [names.index(f"{n}") for n in ("beta_D", "beta_D_rate", "lag_D", "lag_D_rate")]
    blade = np.linalg.eigvals(linear.a[np.ix_(own, own)])
    others = np.delete(np.arange(len(names)), own)
    np.testing.assert_allclose(linear.a[np.ix_(others, own)], 0.0, atol=1e-9)
    flap, lag = blade[np.argmax(blade.imag)], min(blade[blade.imag > 0], key=lambda v: v.imag)
    # damped about as −γ/16 with the offset, at the rotating frequency
    assert abs(flap) == pytest.approx(float(flap_frequency(hover.p.blade)), rel=0.03)
    assert -0.5 < flap.real < -0.3
    assert abs(lag) == pytest.approx(float(lag_frequency(hover.p.blade)), rel=0.1)
    # lag, which the inflow hardly hears: regressing and advancing stand one per rev away
    for shift in (-1, 1):
        assert np.min(np.abs(values - (lag + 1j * shift))) < 0.05


def test_static_gains(linear):
    """Collective and going down add thrust, longitudinal cyclic tips the disk a quarter turn later."""
    assert gain(linear, "CT", "theta_0").real > 0
    assert gain(linear, "CT", "w").real > 0
    assert gain(linear, "CT", "gust_w") == pytest.approx(-gain(linear, "CT", "w"))
    assert gain(linear, "beta_1c", "theta_1s").real == pytest.approx(-1.0, abs=0.15)  # for a blade without offset
    # a nose-up rate leaves the disk behind: up aft
    assert gain(linear, "beta_1c", "q").real > 0


def test_modes_have_names(periodic):
    names = [mode.name for mode in modes(periodic)]
    for name in (
        "coning",
        "regressing flap",
        "progressing flap",
        "differential flap",
        "regressing lag",
        "collective lag",
    ):
        assert name in names
    found = {mode.name: mode for mode in modes(periodic)}
    assert found["regressing lag"].exponent.imag == pytest.approx(1 - found["collective lag"].exponent.imag, abs=0.01)
    assert found["progressing flap"].shares["flap"] > 0.9
    assert sum(found["coning"].shares.values()) == pytest.approx(1.0)


def test_linear_steps_are_those_of_the_nonlinear_march(fast):
    """Over a revolution, all loads but the torque's small answer to cyclic, which the lag damper's kinks decide."""
    base = base_of(fast)
    model = linear_rotor(base, INPUTS)
    truth = steps.marched(base, INPUTS, model.outputs)
    error = steps.largest_gap(truth, steps.modelled(model, [steps.size_of(name) for name in INPUTS]))
    rows = [
        model.outputs.index(n) for n in ("CT", "Z", "L", "M", "beta_0", "beta_1c", "beta_1s", "lambda_0", "lambda_1c")
    ]
    assert error[rows].max() < 0.03
    assert np.median(error) < 0.02


def test_torque_is_linear_too_where_the_lag_damper_is(fast):
    """The damper's table has kinks that a step crosses; with a straight one torque is met like everything else."""
    blade, few = fast.p.blade, ("theta_0", "theta_1c")
    first = blade.damper_rate.size // 2 + 1
    slope = blade.damper_force[first] / blade.damper_rate[first]
    p = eqx.tree_at(lambda p: p.blade.damper_force, fast.p, slope * blade.damper_rate)
    base = base_of(trim(p, fast.flight, fast.residual, fast.z))
    model = linear_rotor(base, few)
    error = steps.largest_gap(
        steps.marched(base, few, model.outputs), steps.modelled(model, [steps.size_of(name) for name in few])
    )
    assert error[model.outputs.index("CQ")].max() < 0.03


def test_small_models_keep_the_blades_and_the_responses(in_flight):
    model = chosen(in_flight, INPUTS, flight.OUTPUTS)
    truth = harmonic_transfer(model, frequencies())[:, 0]
    found = compact(harmonic_model(model, (0,)), 19, truth)
    pairs = (("CT", "theta_0"), ("beta_1s", "theta_1c"), ("CT", "w"), ("M", "q"))
    for out, name in pairs:
        where = model.outputs.index(out), model.inputs.index(name)
        assert found.gap_db[where] < 1
        assert found.gap_deg[where] < 10
    whole = harmonic_model(model, (0, 2, 4))
    small = reduced(whole, 24)
    assert small.states[:3] == ("beta_0", "beta_1c", "beta_1s")
    assert small.states[12:15] == ("lambda_0", "lambda_1c", "lambda_1s")
    np.testing.assert_allclose(small.response(np.zeros(1)), whole.response(np.zeros(1)), rtol=1e-6, atol=1e-9)


def test_a_wake_that_is_alike_on_all_blades_stays_so_at_every_azimuth(uh60):
    """In multi-blade coordinates the rates of a level hover do not depend on the azimuth, and have no cyclic part."""
    settings = wake_settings(**COARSE)
    own = full_state(free_wake(*uh60, None, settings), spread(prescribed(free_wake(*uh60, None, settings), 0.05), 1))[0]
    p, still = coupled_wake(*uh60, settings), jnp.zeros(4)
    wake = jax.tree.map(lambda v: jnp.concatenate([v, jnp.zeros((3, *v.shape[1:]))]), own)
    x = SteadyState(RotorState(still.at[0].set(0.05), still, still.at[0].set(0.03), still), wake)
    program = eqx.filter_jit(rate_and_readings)
    u = drive_of(rotor_inputs(theta_0=0.3), p)
    (one, read), (other, again) = (program(jnp.asarray(psi), x, u, p) for psi in (0.0, 0.7))
    flat, turned = (np.asarray(ravel_pytree(rate)[0]) for rate in (one, other))
    np.testing.assert_allclose(flat, turned, atol=1e-12 * np.abs(flat).max())
    names = state_names(x, p)[0]
    uneven = [k for k, name in enumerate(names) if any(part in name for part in ("_1c", "_1s", "_D"))]
    assert len(names) == flat.size == len(set(names))
    assert np.abs(flat[uneven]).max() < 1e-12
    assert float(read["CT"]) == pytest.approx(float(again["CT"]), rel=1e-12)


def test_a_trim_that_failed_is_refused(hover):
    failed = replace(hover, outcome=replace(hover.outcome, converged=False))
    with pytest.raises(InputError, match="converged"):
        linear_rotor(base_of(failed), ["theta_0"], ["CT"])


BAD = {
    "`inputs` must name what a rotor with pitt-peters inflow has, but has 'height': allowed are theta_0": {
        "inputs": ("height",)
    },
    "has 'slope'": {"inputs": ("theta_0", "slope")},
    "has 'CX'": {"outputs": ("CX",)},
    "must name at least one": {"outputs": ()},
    "`order` must be at least 13 .12 states of the blades": {"order": 12},
    r"`harmonics` must lie in .0, 11. for 48 azimuths": {"harmonics": 12},
    "`azimuths` must be at least 16": {"azimuths": 8},
}


@pytest.mark.parametrize("message", BAD)
def test_bad_input_is_refused_before_the_trim(message):
    with pytest.raises(InputError, match=message):
        flight.check(request("uh60", 0.00575, "pitt-peters"), flight.Wanted(**BAD[message]))


def test_harmonics_of_what_does_not_change_are_refused(periodic):
    with pytest.raises(InputError, match="does not change with the azimuth"):
        flight.held_harmonics(periodic, 4)


def test_an_inflow_is_identified_from_steps(linear):
    """Steps of a rotor whose inflow has known constants give them back, and Pitt and Peters' own are the start."""
    own = identified.own_constants(linear)
    true = identified.Constants(1.3 * own.m_0, 0.7 * own.k_0, 0.9 * own.m_1, 1.2 * own.k_1, -0.3 * own.k_1)
    a, b = identified.changed(linear, own)
    np.testing.assert_allclose(a, linear.a, atol=1e-9)
    np.testing.assert_allclose(b, linear.b, atol=1e-9)
    a, b = identified.changed(linear, true)
    wake = replace(linear, a=np.asarray(a), b=np.asarray(b))
    found = identified.identified(wake, linear, 1.0)
    np.testing.assert_allclose(found.constants, true, rtol=1e-4)
    assert found.error < 1e-4 < found.pitt_peters_error
    data = identified.table([found, replace(found, height=np.inf)])
    assert list(data.height.values) == [1.0, np.inf]
    np.testing.assert_allclose(data.tau_0[0], true.m_0 / true.k_0, rtol=1e-3)
    assert len(identified.text(data).splitlines()) == 5
    between = identified.interpolated(found, replace(found, height=np.inf, constants=own), 2.0)
    np.testing.assert_allclose(between, [(a + b) / 2 for a, b in zip(found.constants, own, strict=True)])
    with pytest.raises(InputError, match="has no lambda_0"):
        identified.identified(wake, replace(linear, states=tuple(f"x[{k}]" for k in range(linear.order))))
