"""Flights in the free wake: rates in moving frames, derivatives through a march, files, what is refused."""

import json
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from vtk_file import read_polydata

from rotorjax.coupled import blades_at, inflow_velocity, rhs
from rotorjax.coupled_wake import model_of
from rotorjax.errors import InputError
from rotorjax.ground import pitched, plane
from rotorjax.io import netcdf
from rotorjax.ode.trajectory import integrate
from rotorjax.rotor import catalogue
from rotorjax.rotor.geometry import chord
from rotorjax.rotor.hub import rotor_inputs
from rotorjax.simulation.case import read_case
from rotorjax.simulation.files import write_all
from rotorjax.simulation.output import over_a_turn
from rotorjax.simulation.run import driver_of, fly, fly_from
from rotorjax.simulation.start import from_wake, settings_of
from rotorjax.simulation.step import instant, least_steps, steps_per_turn
from rotorjax.simulation.wake_output import KINDS
from rotorjax.simulation.wake_pictures import wake_film
from rotorjax.trim.free_wake import first_guess
from rotorjax.trim.in_wake import TrimmedInWake, wake_trim

FLIGHT = '[flight]\nrotor = "uh60"\ninflow = "freewake"\nthrust_coefficient = 0.0058\nadvance_ratio = 0.15\n'
OVER_GROUND = FLIGHT + "height = 1.0\n"
TIME = "[time]\nduration = 0.3\n"
HISTORY = "[history]\nt = [0.0, 0.3]\n"
MOTION = "w = [9.0, 9.0]\np_deg = [8.0, 8.0]\n"
WAKE = "[wake]\npanels = 5\nage_step_deg = 30.0\nnear_wake_deg = 120.0\n"
WAKE += "closure_turns = 1\nclosure_bundles = 0\nturbulence = 0.0\n"


def write(folder, *parts):
    path = folder / "case.toml"
    path.write_text("".join(parts))
    return path


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    return read_case(write(tmp_path_factory.mktemp("case"), OVER_GROUND, TIME, HISTORY, MOTION, WAKE))


@pytest.fixture(scope="module")
def start(case):
    """Not trimmed: a prescribed wake in a wind, enough to march from."""
    settings = settings_of(case)
    p = wake_trim(*catalogue.load("uh60"), rotor_inputs(u=0.15), 0.0058, plane(1.0), settings)
    z = first_guess(p, jnp.array([0.27, 0.04, -0.04]), 0.06, settings.azimuths, 0.03)
    return from_wake(TrimmedInWake(z, p, None, 0))


@pytest.fixture(scope="module")
def flown(case, start):
    with pytest.warns(UserWarning, match=r"begins at [89], a jump at the start"):  # as it is meant to
        return fly_from(case, start)


@pytest.fixture(scope="module")
def folder(flown, tmp_path_factory):
    folder = tmp_path_factory.mktemp("flight")
    write_all(flown, folder)
    return folder


def test_derivative_through_a_march(start):
    """Forward mode through two steps, by collective, hub motion, height and core, against central differences."""
    keys = iter(jax.random.split(jax.random.key(0), 20))
    cover = jax.tree.map(lambda v: jax.random.normal(next(keys), v.shape), start.x)

    def value(s, x, u, p):
        u = eqx.tree_at(lambda u: (u.theta_0, u.w, u.height), u, (u.theta_0 + s, u.w + 0.1 * s, u.height + s))
        p = eqx.tree_at(lambda p: p.settings.tip_core, p, p.settings.tip_core * (1 + s))
        last = integrate(rhs, x, 0.0, 0.05, 2, u, p).last
        return sum(jnp.vdot(a, b) for a, b in zip(jax.tree.leaves(cover), jax.tree.leaves(last), strict=True))

    both = eqx.filter_jit(lambda s, *rest: jax.jvp(lambda s: value(s, *rest), (s,), (jnp.ones(()),)))
    step = 1e-5
    ends = [both(jnp.asarray(s, float), start.x, start.inputs, start.p)[0] for s in (step, -step)]
    slope = both(jnp.zeros(()), start.x, start.inputs, start.p)[1]
    assert float(slope) == pytest.approx(float(ends[0] - ends[1]) / (2 * step), rel=1e-6)


def test_steps_that_the_wake_cannot_be_marched_with_are_refused(case, start):
    least = least_steps(start)
    assert steps_per_turn(replace(case, steps_per_turn=120), start) == 120
    with pytest.raises(InputError, match=f"steps_per_turn must be at least {least} for this wake"):
        steps_per_turn(replace(case, steps_per_turn=least - 1), start)


@pytest.mark.slow
def test_the_files(folder, flown):
    told = json.loads((folder / "report.json").read_text())
    assert told["finished"] is True
    assert told["revolutions"] == pytest.approx(1.2, abs=0.1)
    assert told["wake_change_max"] > 0
    data = netcdf.read(folder / "history.nc")
    assert data.sizes["frame"] == flown.flown.t.size
    assert float(data["lag"][0, 0]) == 0
    assert float(data["lag"].sel(coordinate="0")[-1]) > 0.2
    first = data["wake_lattice"].isel(frame=0, blade=0, near_age=0).values
    assert np.hypot(first[-1, 0] - 0.0466, first[-1, 2]) == pytest.approx(1 - 0.0466, abs=1e-4)
    wake_film(data.isel(frame=slice(0, 2)), over_a_turn(data, "CT"), folder / "animation.gif")
    for name in ("histories.png", "wake.png", "animation.gif"):
        assert (folder / name).stat().st_size > 10_000


@pytest.mark.slow
def test_the_wake_in_vtk_is_that_of_the_data(folder, start):
    data = netcdf.read(folder / "history.nc").isel(frame=-1)
    series = json.loads((folder / "vtk" / "wake.vtk.series").read_text())["files"]
    assert series[-1]["time"] == pytest.approx(float(data["time"][-1]))
    points, lines, polygons, values = read_polydata(folder / "vtk" / series[-1]["name"])
    assert len(lines) == 4 * 2
    assert len(polygons) == 4 * 5
    strands, circulation = (data[f"wake_{name}"].values for name in ("filaments", "circulation"))
    for k, line in enumerate(lines):
        blade, filament = divmod(k, 2)
        np.testing.assert_allclose(points[line], strands[blade, filament], atol=1e-8)
        np.testing.assert_allclose(values["circulation"][line], circulation[blade, filament], atol=1e-8)
        assert np.all(values["kind"][line] == KINDS["tip vortex" if filament == 0 else "inboard filament"])
        assert np.all(values["core"][line] > 0.04)
        assert np.all(values["blade"][line] == blade)
    corners = points[np.array(polygons)]
    widths = np.linalg.norm(corners[:5, 0] - corners[:5, 3], axis=1)
    rotor, edges = start.p.rotor, start.p.edges
    np.testing.assert_allclose(widths, chord(rotor, edges[:-1]), rtol=1e-6)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (FLIGHT.replace("freewake", "vpbfsm") + TIME + WAKE, r"\[wake\] must come with"),
        (FLIGHT.replace("freewake", "vpbfsm") + TIME + 'precision = "single"\n', r"\[time\] precision must come with"),
        (FLIGHT + TIME + 'old_age = "never"\n', "old_age"),
        (FLIGHT + TIME + "[wake]\npannels = 9\n", "panels"),
        (FLIGHT + TIME + '[wake]\npanels = "many"\n', "panels"),
        (OVER_GROUND + "slope_deg = 5.0\n" + TIME, "advance_ratio must be 0 over sloping ground"),
    ],
)
def test_bad_wake_cases(tmp_path, text, words):
    with pytest.raises(InputError, match=words):
        read_case(write(tmp_path, text))


def test_the_ground_comes_nearer_as_the_hub_sinks(case, start):
    u = driver_of(case, start)(jnp.asarray(0.2 * 27.0))
    rolled = np.deg2rad(8.0) * 0.2
    assert float(u.roll) == pytest.approx(rolled)
    assert float(u.height) == pytest.approx(1 - np.sin(rolled) / np.deg2rad(8.0) * 9.0 / 8.177784)
    model = model_of(u, blades_at(start.x, u, start.p), start.p)
    assert float(model.ground.height) == float(u.height)
    np.testing.assert_allclose(model.ground.normal, [0, -np.sin(rolled), np.cos(rolled)], atol=1e-12)
    np.testing.assert_allclose(model.flight.wind, [0.15, 0, 9.0 / (27.0 * 8.177784)], atol=1e-15)


@pytest.mark.slow
def test_a_hub_that_stands_askew_sees_the_ground_turned(flown):
    """Nose up over level ground is upright over a slope, but for gravity; no air passes through what it sees."""
    x, u, p = (jax.tree.map(lambda v: v[-1], flown.flown.x), flown.driver(jnp.asarray(5.0)), flown.start.p)
    p = eqx.tree_at(lambda p: p.blade.gravity, p, jnp.zeros(()))
    askew, upright = (replace(u, roll=0 * u.roll, pitch=jnp.asarray(v), height=jnp.ones(())) for v in (0.2, 0.0))
    slope = eqx.tree_at(lambda p: p.ground, p, pitched(plane(1.0), jnp.asarray(0.2)))
    upright = replace(upright, height=slope.ground.height)
    here, there = instant(x, askew, p), instant(x, upright, slope)
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, atol=1e-11), here, there)

    rolled = replace(u, roll=jnp.asarray(0.15), pitch=jnp.asarray(-0.1), heading=jnp.asarray(0.4))
    ground = model_of(rolled, blades_at(x, rolled, p), p).ground
    points = jax.random.normal(jax.random.key(2), (20, 3))
    points = points - ground.distance(points)[:, None] * ground.normal
    through = eqx.filter_jit(inflow_velocity)(x, points, rolled, p)
    assert float(jnp.max(jnp.abs(through @ ground.normal))) < 1e-12 < 1e-3 < float(jnp.max(jnp.abs(through)))


def test_what_is_wrong_is_said_before_the_trim(tmp_path):
    def no_trim(stage):
        assert "residual" not in stage

    sinking = read_case(write(tmp_path, OVER_GROUND, TIME, HISTORY, "w = [0.0, 90.0]\n"))
    with pytest.raises(InputError, match=r"rim over R\), but cuts it at 0\.\d\d s"):
        fly(sinking, no_trim)
    coarse = read_case(write(tmp_path, FLIGHT, TIME, "steps_per_turn = 24\n[wake]\nage_step_deg = 10.0\n"))
    with pytest.raises(InputError, match="steps_per_turn must be at least 36 for this wake, but is 24"):
        fly(coarse, no_trim)
    fast = "steps_per_turn = 24\n[history]\nt = [0.0, 0.3]\nrotor_speed = [100.0, 120.0]\n"
    with pytest.raises(InputError, match="at least 36 for this wake at 120 per cent of the rotor speed, but is 24"):
        fly(read_case(write(tmp_path, FLIGHT, TIME, fast)), no_trim)
    with pytest.raises(InputError, match=r"\[wake\] panels must be a whole number from 4"):
        read_case(write(tmp_path, FLIGHT, TIME, "[wake]\npanels = 2\n"))
