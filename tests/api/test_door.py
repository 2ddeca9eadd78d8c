"""The front door: what it offers, lazily, and both models through jax's transformations."""

import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
from wakes import COARSE

import rotorjax as rj
from rotorjax.bench.mean_flow import LENGTH, streamlines
from rotorjax.ode.models import LinearModel
from rotorjax.potential import model as potential
from rotorjax.rotor import geometry

SETTINGS = rj.WakeSettings(**COARSE, azimuths=4)
RIM = jnp.array([[0.5, 0.0, -0.3], [0.0, -0.7, -0.2], [1.2, 0.3, 0.1]])


@pytest.fixture(scope="module")
def uh60():
    return rj.rotor("uh60", collective_deg=18.0)


@pytest.fixture(scope="module")
def over_ground(uh60):
    return rj.solve(rj.finite_state(*uh60, rj.plane(1.0)))


@pytest.fixture(scope="module")
def wake(uh60):
    return rj.solve(rj.free_wake(*uh60, rj.plane(1.0), SETTINGS))


def test_what_is_offered_is_there():
    for name in rj.__all__:
        assert callable(getattr(rj, name)), name
    assert set(rj.__all__) < set(dir(rj))
    with pytest.raises(AttributeError, match="solv"):
        _ = rj.solv


def test_it_opens_without_loading_the_house_or_touching_jax():
    code = "import sys, rotorjax; sys.exit(bool({'jax', 'matplotlib', 'xarray', 'optimistix'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    code = "import sys, jax, rotorjax as rj; rj.free_wake, rj.solve; sys.exit(jax.config.jax_enable_x64)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_rooms_with_the_name_of_a_function_are_both(uh60):
    assert rj.rotor.geometry is geometry
    assert rj.rotor("uh60")[0].name == "UH-60A"
    assert float(jnp.rad2deg(uh60[1].collective)) == pytest.approx(18.0)


@pytest.mark.parametrize(("blades", "collective_deg"), [(2, 8.0), (4, 10.0)])
def test_a_rotor_that_says_nothing_of_its_tips_pays_for_its_lift(blades, collective_deg):
    """Induced power over the ideal in hover: at least 1, and below it where the lift goes on to the end."""
    file, hover = rj.rotor("knight_hefner_2", collective_deg)

    def factor(**tip):
        rotor = geometry.rotor("plain", blades, file.radius, 0.17, 0.05, file.airfoil, **tip)
        found = rj.solve(rj.finite_state(rotor, hover))
        return float(found.CP_induced / (found.CT**1.5 / np.sqrt(2)))

    assert factor() == factor(tip_loss=geometry.TIP_LOSS)
    assert 1.0 <= factor() < 1.1
    assert factor(tip_loss=1.0) < min(1.0, 0.9 * factor())


@pytest.mark.slow
def test_the_finite_state_through_all_transformations(uh60):
    def thrust(height, collective=18.0):
        rotor, operating = rj.rotor("uh60", collective_deg=collective)
        return rj.solve(rj.finite_state(rotor, operating, rj.plane(height))).CT

    value, slope = jax.value_and_grad(thrust)(1.0)
    step = 1e-4
    near = (thrust(1.0 + step) - thrust(1.0 - step)) / (2 * step)
    assert float(slope) == pytest.approx(float(near), rel=1e-5)
    assert float(jax.jacfwd(thrust)(1.0)) == pytest.approx(float(slope), rel=1e-9)
    assert float(jax.jit(thrust)(1.0)) == pytest.approx(float(value), rel=1e-9)
    many = jax.vmap(thrust)(jnp.array([1.0, 1.5, 2.0]))
    assert float(many[0]) == pytest.approx(float(value), rel=1e-9)
    assert np.all(np.diff(many) < 0)
    with pytest.raises(rj.InputError, match="collective"):
        thrust(1.0, -8.0)


@pytest.mark.slow
def test_a_solved_rotor_is_read_drawn_and_written(over_ground, tmp_path):
    told = over_ground.performance()
    assert 50e3 < float(told.thrust) < 150e3
    assert float(told.torque * over_ground.model.operating.omega) == pytest.approx(float(told.power))
    data = over_ground.to_xarray()
    assert float(data["CT"]) == float(over_ground.CT)
    assert data["inflow"].dims == ("azimuth", "radius")
    data.to_netcdf(tmp_path / "one.nc", engine="h5netcdf")
    assert float(xr.load_dataset(tmp_path / "one.nc")["height"]) == 1.0
    over_ground.plot(tmp_path / "one.png")
    assert (tmp_path / "one.png").stat().st_size > 5000
    with pytest.raises(rj.InputError, match="vortices"):
        over_ground.to_vtk(tmp_path / "one.vtk")
    found = rj.velocity(over_ground, RIM)
    np.testing.assert_allclose(found, potential.velocity(over_ground.found.state, RIM, over_ground.model.flow))


@pytest.mark.slow
@pytest.mark.calls_host
def test_a_free_wake_solved_and_differentiated(uh60, wake, tmp_path):
    assert wake.converged
    wake.to_vtk(tmp_path / "wake.vtk")
    assert "LINES 4" in (tmp_path / "wake.vtk").read_text()

    def thrust(height):
        return rj.solve(rj.free_wake(*uh60, rj.plane(height), SETTINGS), start=wake, tol=1e-10).CT

    value, slope = jax.jit(jax.value_and_grad(thrust))(1.0)
    assert float(value) == pytest.approx(wake.CT, rel=1e-6)
    assert float(jax.jacfwd(thrust)(1.0)) == pytest.approx(float(slope), rel=1e-8)
    step = 1e-3
    ends = jax.vmap(thrust)(jnp.array([1.0 - step, 1.0 + step]))
    assert float(ends[1]) == pytest.approx(float(thrust(1.0 + step)), rel=1e-8)
    assert float(slope) == pytest.approx(float(ends[1] - ends[0]) / (2 * step), rel=1e-4)


@pytest.mark.slow
def test_the_mean_velocity_of_a_wake_is_alike_all_round_and_stops_at_the_ground(wake):
    around = jnp.array([[0.5, 0.0, -0.3], [0.0, 0.5, -0.3], [-0.5, 0.0, -0.3]])
    down = rj.velocity(wake, around)[:, 2]
    assert np.ptp(np.asarray(down)) < 1e-3 * abs(float(down[0]))
    assert float(down[0]) < -0.01
    on_ground = rj.velocity(wake, around.at[:, 2].set(-1.0))
    assert float(jnp.max(jnp.abs(on_ground[:, 2]))) < 1e-12


@pytest.mark.slow
def test_streamlines_go_along_the_flow_and_stay_above_the_ground(wake):
    """Equal steps; no line reaches the plane; between two nodes a line runs as the flow does there."""
    lines = streamlines(wake.found)
    steps = np.diff(lines, axis=1)
    np.testing.assert_allclose(np.linalg.norm(steps, axis=-1), LENGTH, rtol=1e-3)
    assert lines[..., 2].min() > -1.0
    some = lines[::13, 5:60:18]
    flow = np.asarray(rj.velocity(wake, (some + steps[::13, 5:60:18] / 2).reshape(-1, 3)))
    along = np.sum(flow * steps[::13, 5:60:18].reshape(-1, 3), axis=1) / np.linalg.norm(flow, axis=1)
    np.testing.assert_allclose(along, LENGTH, rtol=2e-2)


def test_wrong_input_is_named(wake, over_ground):
    with pytest.raises(rj.InputError, match=r"must be of rj\.free_wake"):
        rj.solve(3)
    with pytest.raises(rj.InputError, match="hayden"):
        rj.calibrate("haydn")
    with pytest.raises(rj.InputError, match="neither"):
        rj.linearise(over_ground)


def test_the_deck_and_the_exports_are_at_the_door(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text('[rotor]\nname = "uh60"\n[time]\nduration = 0.0\n[path]\nt = [0.0]\nheight = [1.0]\n')
    with pytest.raises(rj.InputError, match="duration"):
        rj.over_deck(case)
    with pytest.raises(rj.InputError, match="slopes"):
        rj.evaluate(tmp_path / "out", slopes_deg=(0.0,))
    one = np.eye(1)
    model = LinearModel(one, one, one, one, ("x",), ("u",), ("y",), ("rad",), ("1",))
    assert rj.to_control(model).nstates == 1
    assert rj.save_mat(model, tmp_path / "model.mat").exists()
