"""Flights from case files: histories, the command's files, what is refused."""

import json

import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator

from rotorjax.cli import main
from rotorjax.errors import InputError
from rotorjax.io import netcdf
from rotorjax.simulation.case import COLUMNS, read_case, steps_of
from rotorjax.simulation.history import piecewise, smooth
from rotorjax.simulation.output import over_a_turn
from rotorjax.simulation.run import driver_of
from rotorjax.simulation.start import from_trim
from rotorjax.trim.run import prepare
from rotorjax.trim.solve import Trimmed, guess
from tests.browser import opens

FLIGHT = '[flight]\nrotor = "uh60"\ninflow = "pitt-peters"\nthrust_coefficient = 0.00575\n'
TIME = "[time]\nduration = 0.5\nsteps_per_turn = 72\n"
HISTORY = "[history]\nt = [0.0, 0.25, 0.3, 0.5]\n"


def write(folder, *parts):
    path = folder / "case.toml"
    path.write_text("".join(parts))
    return path


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """The command, with a step of collective at 0.25 s."""
    folder = tmp_path_factory.mktemp("flight")
    case = write(folder, FLIGHT, TIME, HISTORY, "collective_deg = [0.0, 0.0, 0.5, 0.5]\n")
    assert main(["simulate", "--case", str(case), "--out", str(folder), "--gif"]) == 0
    return folder, netcdf.read(folder / "history.nc")


def test_the_trim_holds_until_the_step(flown):
    _, data = flown
    before = data.where(data["time"] < 0.25, drop=True)
    np.testing.assert_allclose(before["CT"], 0.00575, rtol=1e-8)
    np.testing.assert_allclose(before["flap"].sel(coordinate=["1c", "1s", "D"]), 0.0, atol=1e-8)
    np.testing.assert_allclose(before["flap"].sel(coordinate="0"), float(before["flap"][0, 0]), atol=1e-8)


def test_the_step_overshoots_as_the_inflow_builds_up(flown):
    _, data = flown
    thrust = data["CT"].values
    assert thrust.max() > thrust[-1] > 1.01 * thrust[0]
    assert float(data["theta_0"][-1] - data["theta_0"][0]) == pytest.approx(0.5)
    assert float(data["flap"].sel(coordinate="0")[-1]) > float(data["flap"].sel(coordinate="0")[0])


def test_the_last_instant_is_the_one_asked_for(flown):
    _, data = flown
    assert float(data["time"][-1]) == pytest.approx(0.5, rel=1e-12)
    assert float(data["time"][-2]) < 0.5
    omega = 27.0
    np.testing.assert_allclose(data["azimuth"], omega * data["time"], rtol=1e-9)
    assert np.diff(data["CT"])[-1] == pytest.approx(np.diff(data["CT"])[-2], rel=0.5)  # the last steps fit the rest


def test_the_mean_thrust_waits_for_the_input_and_ends_above_it(flown):
    _, data = flown
    assert float(data["trim_CT"]) == pytest.approx(0.00575, rel=1e-8)
    turned, t = over_a_turn(data, "CT"), data["time"].values
    np.testing.assert_allclose(turned[t <= 0.25], 0.00575, rtol=1e-8)  # nothing before the input
    turn = 2 * np.pi / 27.0
    late = t > 0.5 - turn
    inside = np.concatenate([[np.interp(0.5 - turn, t, data["CT"])], data["CT"].values[late]])
    exact = np.trapezoid(inside, np.concatenate([[0.5 - turn], t[late]])) / turn
    assert turned[-1] == pytest.approx(exact, rel=1e-3)


def test_the_mean_over_a_turn_takes_vibration_away():
    psi = np.append(2 * np.pi / 12 * np.arange(40), 20.7)
    data = xr.Dataset({"azimuth": ("time", psi), "CT": ("time", 3 + 0.5 * np.cos(4 * psi)), "trim_CT": ((), 3.0)})
    np.testing.assert_allclose(over_a_turn(data, "CT")[:-1][psi[:-1] >= 2 * np.pi], 3.0, atol=1e-12)
    np.testing.assert_allclose(over_a_turn(data, "CT"), 3.0, atol=0.025)  # while it comes in, and over the last steps


def test_the_files(flown):
    folder, data = flown
    told = json.loads((folder / "report.json").read_text())
    assert told["finished"] is True
    assert told["revolutions"] == pytest.approx(0.5 * 27 / (2 * np.pi), rel=0.05)
    assert told["real_time_factor"] > 0
    assert data["inflow"].dims == ("frame", "ray", "radius")
    for name in ("histories.png", "animation.gif"):
        assert (folder / name).stat().st_size > 10_000
    page = (folder / "report.html").read_text()
    assert page.count("data:image/") == 2
    assert opens(folder / "report.html", folder)
    assert f"C_T goes from {told['histories']['CT']['first']:.5f}" in page


def test_histories_are_scipys_monotone_cubics_with_their_rates():
    t, columns = np.array([0.0, 0.3, 0.5, 2.0]), np.array([[0.0, 1], [1, 1], [1, 3], [0, 2]])
    found, rate = piecewise(smooth(t, columns)), piecewise(smooth(t, columns).derivative())
    for at in (0.0, 0.1, 0.3, 0.41, 1.9, 2.0):
        np.testing.assert_allclose(found(jnp.asarray(at)), PchipInterpolator(t, columns)(at), atol=1e-14)
        np.testing.assert_allclose(rate(jnp.asarray(at)), PchipInterpolator(t, columns).derivative()(at), atol=1e-13)


def started(case):
    """A trim that was not solved for: enough for its inputs."""
    p, flight, residual = prepare(case.request)
    return from_trim(Trimmed(guess(p, flight), None, residual, flight, p))


def test_inputs_of_a_descent(tmp_path):
    """m/s and seconds become rotor units; the height falls by the path's integral."""
    history = HISTORY + "w = [0.0, 2.0, 2.0, 2.0]\nq_deg = [0.0, 1.0, 1.0, 1.0]\nrotor_speed = [100, 99, 99, 99]\n"
    case = read_case(write(tmp_path, FLIGHT, "height = 1.0\n", TIME, history))
    start = started(case)
    driver = driver_of(case, start)
    omega, tip = 27.0, 27.0 * 8.177784
    u = driver(jnp.asarray(0.4 * omega))
    assert float(u.w) == pytest.approx(2.0 / tip, rel=1e-6)
    assert float(u.q) == pytest.approx(np.deg2rad(1.0) / omega, rel=1e-6)
    assert float(u.omega) == pytest.approx(0.99)
    down = PchipInterpolator([0.0, 0.25, 0.3, 0.5], [0.0, 2, 2, 2])
    nose = PchipInterpolator([0.0, 0.25, 0.3, 0.5], np.deg2rad([0.0, 1, 1, 1])).antiderivative()
    assert float(u.pitch) == pytest.approx(nose(0.4), abs=1e-10)
    sunk = quad(lambda t: down(t) * np.cos(nose(t)), 0.0, 0.4, epsabs=1e-12)[0]
    assert float(u.height) == pytest.approx(1.0 - sunk / 8.177784, rel=1e-9)
    now, step = 0.1 * omega, 1e-5
    slope = (driver(jnp.asarray(now + step)).w - driver(jnp.asarray(now - step)).w) / (2 * step)
    assert float(driver(jnp.asarray(now)).w_rate) == pytest.approx(float(slope), rel=1e-6)
    assert steps_of(case, omega, 72) % 12 == 0


def test_a_path_into_the_ground_is_refused(tmp_path):
    history = HISTORY + "w = [0.0, 9.0, 9.0, 9.0]\n"
    case = read_case(write(tmp_path, FLIGHT.replace("pitt-peters", "vpbfsm"), "height = 0.3\n", TIME, history))
    with pytest.raises(InputError, match=r"cuts it at 0\.\d\d s, to -"):
        driver_of(case, started(case))
    low = read_case(write(tmp_path, FLIGHT, "height = 0.6\n", TIME, history))
    with pytest.raises(InputError, match=r"above 0\.5 R.*goes below it"):
        driver_of(low, started(low))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (TIME, "thrust_coefficient"),
        (FLIGHT, "duration"),
        (FLIGHT + "hight = 1.0\n" + TIME, "height"),
        (FLIGHT + TIME + "[histroy]\n", "history"),
        (FLIGHT + TIME + HISTORY + "colective_deg = [0, 0, 0, 0]\n", "collective_deg"),
        (FLIGHT + TIME + HISTORY + "w = [0, 0, 0]\n", "as many values"),
        (FLIGHT + TIME + HISTORY + "w = [0, nan, 0, 0]\n", "w must be .* throughout, but is nan at entry 2"),
        (FLIGHT + TIME + HISTORY.replace("0.3", "0.2"), "increase"),
        (FLIGHT + TIME + HISTORY.replace("0.5]", "0.4]"), "duration"),
        (FLIGHT + TIME + HISTORY + "rotor_speed = [100, 10, 100, 100]\n", "rotor_speed"),
        (FLIGHT + TIME.replace("72", "50"), "steps_per_turn"),
        ("[flight", "TOML"),
    ],
)
def test_bad_cases(tmp_path, text, words):
    with pytest.raises(InputError, match=words) as error:
        read_case(write(tmp_path, text))
    assert "case.toml" in str(error.value)


def test_columns_are_in_the_order_of_eq_11():
    assert COLUMNS[:6] == ("theta_1c_deg", "theta_1s_deg", "collective_deg", "u", "v", "w")
