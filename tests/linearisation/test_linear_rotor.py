"""The linear rotor: blades seen from the hub in hover, closed forms, named modes, against the march, bad input."""

from dataclasses import replace
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.io import netcdf
from rotorjax.linearisation import flight, identified, identify, steps
from rotorjax.linearisation.compact import compact, frequencies, reduced
from rotorjax.linearisation.found import OUTPUTS, Wanted
from rotorjax.linearisation.modes import blade_modes, modes, named
from rotorjax.linearisation.rotor import base_of, linear_rotor
from rotorjax.ode.harmonic import average, harmonic_model
from rotorjax.ode.hill import Exponents, harmonic_transfer
from rotorjax.rotor.flap_lag import flap_frequency, lag_frequency
from rotorjax.trim.run import request, run

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


def names_of(upper):
    """Names of flap's and a wake's modes by `blade_modes`. upper: exponent, coordinate and flap's part of each."""
    states = tuple(f"beta_{name}{rate}" for name in ("0", "1c", "1s", "D") for rate in ("", "_rate"))
    states += tuple(f"wake[{k}]" for k in range(4))
    values, part = [], []
    for value, coordinate, share in upper:
        members = np.array([state.startswith(f"beta_{coordinate}") for state in states])
        column = np.where(members, share / members.sum(), 0.0)
        column[states.index("wake[0]")] = 1 - share
        pair = abs(value.imag) > 1e-9
        values += [value, value.conjugate()] if pair else [value]
        part += [column] * (2 if pair else 1)
    found = Exponents(np.array(values), np.zeros((12, len(values))), np.stack(part, axis=1))
    return {mode.name: mode.exponent for mode in named(found, states, blade_modes(found, states))}


def test_every_coordinate_of_the_blades_has_modes_of_its_own():
    """Where the differential flap takes part in a wake's mode more than the cyclic flap does in its slow one."""
    upper = {
        "differential flap": (-0.5 + 0.8j, "D", 0.39),
        "inflow wake[0]": (-0.3 + 1.0j, "D", 0.35),
        "coning": (-0.4 + 0.8j, "0", 0.3),
        "progressing flap": (-0.5 + 1.9j, "1", 0.7),
        "regressing flap": (-0.6 + 0.0j, "1", 0.21),
        "regressing flap (2)": (-0.8 + 0.0j, "1", 0.2),
    }
    assert names_of(upper.values()) == {name: value for name, (value, *_) in upper.items()}


def test_a_mode_of_the_wake_is_not_called_a_blades_where_its_own_is_missed():
    """The free wake at μ = 0.15: 3.85/rev stood as progressing flap where rounding had hidden the slow ones."""
    upper = {
        "differential flap": (-0.44 + 0.95j, "D", 0.9),
        "coning": (-0.54 + 0.99j, "0", 0.53),
        "progressing flap": (-0.47 + 1.89j, "1", 0.76),
        "inflow wake[0]": (-0.25 + 3.85j, "1", 0.1),
        "inflow wake[0] (2)": (-8.6 + 0.0j, "1", 0.004),
    }
    told = {name: value for name, (value, *_) in upper.items()}
    assert names_of(upper.values()) == told
    for rounding in (1e-17j, -1e-17j):
        slow = [(-0.16 + rounding, "1", 0.42), (-0.8 + rounding, "1", 0.44)]
        assert names_of([*upper.values(), *slow]) == told | {"regressing flap": -0.16, "regressing flap (2)": -0.8}


def test_linear_steps_are_those_of_the_nonlinear_march(fast):
    """Over a revolution, all of them, those of the torque and the forces in the disk's plane included."""
    base = base_of(fast)
    model = linear_rotor(base, INPUTS)
    truth = steps.marched(base, INPUTS, model.outputs)
    error = steps.largest_gap(truth, steps.modelled(model, [steps.size_of(name) for name in INPUTS]))
    assert error.max() < 0.03
    assert np.median(error) < 0.02


def test_small_models_keep_the_blades_and_the_responses(in_flight):
    model = chosen(in_flight, INPUTS, OUTPUTS)
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
        flight.check(request("uh60", 0.00575, "pitt-peters"), Wanted(**BAD[message]))


def test_harmonics_of_what_does_not_change_are_refused(periodic):
    with pytest.raises(InputError, match="does not change with the azimuth"):
        flight.held_harmonics(periodic, 4)


def test_an_inflow_is_identified_from_steps(hover, linear, fast, in_flight, monkeypatch):
    """Steps of a rotor whose inflow has known constants give them back, and Pitt and Peters' own are the start."""
    start, flow = identified.own(hover), float(np.mean(hover.z.inflow, axis=0)[0])
    np.testing.assert_allclose(start.stiffness, np.diag([4 * flow, flow, flow]), atol=1e-9)
    np.testing.assert_allclose(start.mass, [8 / (3 * np.pi), *2 * [16 / (45 * np.pi)]])
    found = []
    for trimmed, rotor, advance in ((hover, linear, 0.0), (fast, average(in_flight), 0.3)):
        start = identified.own(trimmed)
        a, b = identified.changed(rotor, start, start)
        np.testing.assert_allclose(a, rotor.a, atol=1e-9)
        np.testing.assert_allclose(b, rotor.b, atol=1e-9)
        sheared = 1.0 if advance else 0.0  # in hover moments have no part in thrust
        swirl = 0.3 * float(start.stiffness[1, 1]) * np.array([[0, sheared, 0], [0, 0, 1], [sheared, -1, 0]])
        true = identified.Inflow(start.mass * np.array([1.3, 0.9, 0.8]), start.stiffness * 1.2 + swirl)
        a, b = identified.changed(rotor, start, true)
        wake = replace(rotor, a=np.asarray(a), b=np.asarray(b))
        found.append(identified.identified(wake, rotor, start, advance, 1.0))
        np.testing.assert_allclose(found[-1].inflow.mass, true.mass, rtol=1e-3)
        np.testing.assert_allclose(found[-1].inflow.stiffness, true.stiffness, atol=1e-3 * true.stiffness.max())
        assert found[-1].error < 1e-4 < found[-1].pitt_peters_error
    monkeypatch.setattr(identified, "MOST_FITS", 2)
    with pytest.warns(UserWarning, match="at advance ratio 0.3, height 1 is the best of 2 that were tried"):
        assert identified.identified(wake, rotor, start, 0.3, 1.0).error < found[-1].pitt_peters_error
    with pytest.raises(InputError, match="must have finite steps"):
        identified.identified(replace(wake, a=np.full_like(wake.a, np.nan)), rotor, start)
    with pytest.raises(InputError, match="has no lambda_0"):
        identified.identified(wake, replace(linear, states=tuple(f"x[{k}]" for k in range(linear.order))), start)


def test_flights_in_the_wake_leave_a_table_of_their_inflows(hover, periodic, linear, tmp_path, monkeypatch):
    """None of a flight with an inflow model, nor of one whose outputs are not all there."""
    start = identify.Beside(linear, identified.own(hover))
    monkeypatch.setattr(identify, "beside", lambda request: start)
    wake, other = (request("uh60", 0.00575, inflow, advance=0.2) for inflow in ("freewake", "pitt-peters"))
    monkeypatch.setattr(
        identify,
        "identified",
        lambda model, rotor, own, *where: identified.Identified(own, 0.1, own, 0.2, *where),
    )
    few = chosen(linear, INPUTS)
    flights = [
        SimpleNamespace(result=SimpleNamespace(request=asked), full=full, models={"periodic": periodic})
        for asked, full in ((wake, linear), (other, linear), (wake, few))
    ]
    found = identify.of_flights(flights)
    assert [(one.advance, one.height) for one in found] == [(0.2, np.inf)]
    identify.write(found, tmp_path)
    identify.write([], tmp_path / "none")
    data = netcdf.read(tmp_path / "inflow.nc")
    np.testing.assert_allclose(identified.interpolated(data, 0.2).mass, start.inflow.mass)
    assert len((tmp_path / "inflow.txt").read_text().splitlines()) == 5
    assert identify.lines(found) == [
        "identified inflow at advance ratio 0.2: 10.0 % off over a revolution after a step, Pitt and Peters' own 20.0 %"
    ]


def test_an_identified_table_is_interpolated_in_speed_and_one_over_height_squared():
    one = identified.Identified(identified.Inflow(np.ones(3), np.eye(3)), 0.1, *2 * [None], 0.0, 1.0)
    one = replace(one, pitt_peters=one.inflow, pitt_peters_error=0.3)
    grid = [
        replace(one, inflow=identified.Inflow(np.full(3, 1 + mu / h), np.eye(3) * (1 + 1 / h)), advance=mu, height=h)
        for mu in (0.1, 0.2)
        for h in (1.0, np.inf)
    ]
    data = identified.table(grid)
    assert list(data.height.values) == [1.0, np.inf]
    assert len(identified.text(data).splitlines()) == 8
    assert "linear in advance_ratio and in 1/height²" in identified.text(data)
    between = identified.interpolated(data, 0.15, 2.0)
    np.testing.assert_allclose(between.mass, 1 + 0.15 / 4, rtol=1e-12)
    np.testing.assert_allclose(between.stiffness, 1.25 * np.eye(3), rtol=1e-12)
    np.testing.assert_allclose(data.tau_0.sel(advance_ratio=0.1, height=1.0), 1.1 / 2)
    np.testing.assert_allclose(identified.interpolated(data, 0.2).mass, 1.0)
    with pytest.raises(InputError, match=r"within the table, but are 0\.3 and 2"):
        identified.interpolated(data, 0.3, 2.0)


def test_one_over_height_squared_is_the_measure_of_the_grounds_effect():
    """Of Pitt and Peters' own K in hover, 4λ with λ ∝ (1 − 1/16h²)^{3/2}, between h = 1 and 2 and above: linear in 1/h²
    within 0.1 %, where linear in 1/h is off by more than five times as much.
    """
    heights = np.array([1.0, 2.0, np.inf])

    def stiffness(h):
        return 4 * np.sqrt(0.00575 / 2) * (1 - 1 / (16 * np.asarray(h) ** 2)) ** 1.5 * np.eye(3)

    grid = [
        identified.Identified(*2 * [identified.Inflow(np.ones(3), stiffness(h)), 0.1], 0.0, float(h)) for h in heights
    ]
    data = identified.table(grid)
    for h in (1.2, 1.4, 1.7, 3.0, 5.0):
        true = stiffness(h)[0, 0]
        found = float(identified.interpolated(data, 0.0, h).stiffness[0, 0])
        plain = np.interp(1 / h, 1 / heights[::-1], [stiffness(v)[0, 0] for v in heights[::-1]])
        assert abs(found - true) < 1e-3 * true
        assert abs(found - true) < 0.2 * abs(plain - true)
