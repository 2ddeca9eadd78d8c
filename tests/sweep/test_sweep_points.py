"""What the solvers of a sweep find: the same as one by one, and momentum theory's inflow."""

from functools import partial

import numpy as np
import pytest
from wakes import COARSE
from wakes import made_up as made_up_wake

from rotorjax.bench.cases import Case
from rotorjax.bench.disk_fit import disk_fit
from rotorjax.bench.finite_state import model_of
from rotorjax.bench.settings import study_settings
from rotorjax.inflow.balance import balance, stations_of
from rotorjax.limits import check_axial
from rotorjax.sweep import hover_batch, hover_wake
from rotorjax.sweep.case import sweep_case
from rotorjax.sweep.run import sweep
from rotorjax.sweep.table import dataset
from rotorjax.trim.run import request, run


def test_the_fit_over_the_disk_gives_a_plane_back():
    r, widths = np.linspace(0.15, 0.95, 9), np.full(9, 0.1)
    for count in (3, 12, 13):
        psi = 2 * np.pi / count * np.arange(count)
        plane = 0.05 + r * (0.01 * np.cos(psi) - 0.02 * np.sin(psi))[:, None]
        np.testing.assert_allclose(disk_fit(r, widths, psi, plane), [0.05, 0.01, -0.02], atol=1e-15)
    np.testing.assert_allclose(disk_fit(r, widths, np.zeros(1), plane[:1] * 0 + 0.05), [0.05, 0, 0])


@pytest.mark.slow
def test_hovers_of_the_finite_state_are_what_they_are_one_by_one(tmp_path):
    axes = {"height": [0.8, 1.5], "slope_deg": [0.0, 10.0], "collective_deg": [12.0, 16.0]}
    found = dataset(sweep(sweep_case("inflow", axes), tmp_path / "a"))
    assert len(list((tmp_path / "a" / "points").iterdir())) == 1  # one batch
    for h, slope, pitch in ((0.8, 0.0, 12.0), (0.8, 10.0, 16.0), (1.5, 10.0, 12.0)):
        settings = study_settings("uh60", pitch)
        guess = check_axial("vpbfsm", settings.rotor, settings.operating)
        model, stations = model_of(Case(h, slope), settings), stations_of(settings.rotor)
        alone = balance(model, settings.rotor, settings.operating, stations, guess)
        here = found.sel(height=h, slope_deg=slope, collective_deg=pitch)
        for name in ("CT", "CP", "CP_induced", "CP_profile"):
            np.testing.assert_allclose(here[name], getattr(alone, name), rtol=1e-12)
        fit = disk_fit(*(np.asarray(getattr(alone, n)) for n in ("r", "widths", "psi", "inflow")))
        np.testing.assert_allclose([here[f"lambda_{n}"] for n in ("0", "1c", "1s")], fit, atol=1e-12)
    assert (found["lambda_1c"].sel(slope_deg=10.0) < -1e-6).all()  # less inflow on the mountain's side
    # the collective for a weight, by the same program
    weight = float(found["thrust"].sel(height=1.5, slope_deg=10.0, collective_deg=16.0))
    axes = {"height": [0.8, 1.5], "slope_deg": [0.0, 10.0]}
    back = dataset(sweep(sweep_case("inflow", axes, weight=weight), tmp_path / "b"))
    np.testing.assert_allclose(back["thrust"], weight, rtol=1e-10)
    np.testing.assert_allclose(back["collective_deg"].sel(height=1.5, slope_deg=10.0), 16.0, rtol=1e-9)


def test_the_secant_finds_zeros_lane_by_lane():
    wanted = np.array([0.1, 0.3, 0.5])
    found = hover_batch.secant(lambda x: np.tan(x) - np.tan(wanted), np.zeros(3), np.full(3, 0.01))
    np.testing.assert_allclose(found, wanted, atol=1e-10)
    np.testing.assert_array_equal(hover_batch.secant(lambda x: x * np.nan, np.zeros(2), np.ones(2) * 0.01), 0.01)


@pytest.mark.slow
def test_trims_are_what_they_are_one_by_one(tmp_path):
    case = sweep_case("trim", {"advance_ratio": [0.0, 0.1, 0.2]}, inflow="uniform", thrust_coefficient=0.006)
    found = dataset(sweep(case, tmp_path))
    alone = run(request("uh60", 0.006, "uniform", advance=0.2))
    here = found.sel(advance_ratio=0.2)
    np.testing.assert_allclose(here["CP"], alone.means.CQ, rtol=1e-9)
    np.testing.assert_allclose(np.deg2rad(here["theta_1s_deg"]), alone.means.controls[2], rtol=1e-8)
    np.testing.assert_allclose(found["lambda_0"].sel(advance_ratio=0.0), np.sqrt(0.006 / 2), rtol=1e-6)
    np.testing.assert_allclose(found["lambda_1c"], 0.0, atol=1e-12)
    assert float(found["CP"].min()) < float(found["CP"].sel(advance_ratio=0.0))


def test_a_free_wake_starts_from_its_neighbours(tmp_path):
    wanted = {"height": [1.0, 1.5, 2.0], "slope_deg": [0.0, 10.0]}
    case = sweep_case("inflow", wanted, wake=COARSE, model="freewake", collective_deg=16.0)
    seen = []

    def solver(model, start, progress):
        ground = model.ground
        place = float(ground.height), round(float(np.rad2deg(ground.slope)), 6)
        seen.append((place, None if start is None else float(start.model.ground.height)))
        return made_up_wake(model, start, progress, converged=True)

    found = dataset(sweep(case, tmp_path, solver=partial(hover_wake.solve, solver=solver)))
    assert seen[0] == ((2.0, 0.0), None)
    at_one = [start for place, start in seen if place == (1.0, 0.0)]
    assert at_one == [1.5]  # where it is lost from there, the solve itself tries from nothing
    assert set(found["verdict"].to_numpy().ravel()) == {"converged"}
    again = []
    sweep(case, tmp_path, solver=lambda *a: again.append(a))
    assert not again
