"""The VPBFSM of a case against the model's own functions, momentum theory and a direct search for its own loads."""

import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.bench import finite_state
from rotorjax.bench.cases import Case
from rotorjax.bench.finite_state import GRID_PSI, GRID_R, Stations
from rotorjax.bench.settings import study_settings
from rotorjax.errors import InputError
from rotorjax.potential import model as potential
from rotorjax.potential import rigid_cylinder
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.rotor.blade_element import disk_loading, section_loads

EDGES = np.linspace(0.1, 1.0, 41)
STATIONS = Stations(
    jnp.asarray(0.5 * (EDGES[1:] + EDGES[:-1])), jnp.asarray(np.diff(EDGES)), jnp.asarray(np.arange(12) * np.pi / 6)
)
R, PSI = np.asarray(STATIONS.r), np.asarray(STATIONS.psi)
LOADS = 0.02 * R**2 * (1 - R**20) * (1 + 0.2 * R * np.cos(PSI)[:, None])


@pytest.fixture(scope="module")
def settings():
    return study_settings()


@pytest.fixture(scope="module")
def sloped(settings):
    return finite_state.from_loads(Case(1.0, 15.0), settings, LOADS, STATIONS)


def test_fields_are_the_models(settings, sloped):
    model = finite_state.model_of(Case(1.0, 15.0), settings)
    state = potential.steady_state(model, sloped.tau)
    np.testing.assert_allclose(sloped.states.a, state.a, rtol=1e-12)
    np.testing.assert_allclose(sloped.states.c, state.c, rtol=1e-9, atol=1e-12)
    grid = potential.inflow(state, jnp.asarray(GRID_R), jnp.asarray(GRID_PSI), model)
    np.testing.assert_allclose(sloped.inflow_grid, grid, atol=1e-12)
    np.testing.assert_allclose(sloped.mean_inflow, potential.mean_inflow(state, model), rtol=1e-10)
    left = potential.ground_normal_velocity_rms(state, model)
    np.testing.assert_allclose(sloped.ground_normal_velocity_rms, left, rtol=1e-9)
    printed = finite_state.model_of(Case(1.0, 15.0), settings, printed=True)
    state = potential.steady_state(printed, sloped.tau)
    np.testing.assert_allclose(
        sloped.printed_inflow, potential.inflow(state, STATIONS.r, STATIONS.psi, printed), atol=1e-12
    )
    np.testing.assert_allclose(sloped.printed_mean_inflow, potential.mean_inflow(state, printed), rtol=1e-10)
    exact = rigid_cylinder.inflow(state, STATIONS.r, STATIONS.psi, printed, finite_state.PATCH)
    np.testing.assert_allclose(sloped.exact_image_inflow, exact, atol=1e-12)


def test_source_patch_is_fine_enough_on_the_steepest_slope(settings):
    result = finite_state.from_loads(Case(1.0, 40.0), settings, LOADS, STATIONS)
    model = finite_state.model_of(Case(1.0, 40.0), settings, printed=True)
    state = potential.steady_state(model, result.tau)
    exact = rigid_cylinder.inflow(state, STATIONS.r, STATIONS.psi, model, DiskQuadrature(160, 256))
    np.testing.assert_allclose(result.exact_image_inflow, exact, atol=2e-5 * float(result.mean_inflow))


def test_ground_condition_holds_on_every_slope_of_the_study(settings, sloped):
    steep = finite_state.from_loads(Case(1.0, 40.0), settings, LOADS, STATIONS)
    assert float(sloped.ground_normal_velocity_rms) < 0.03
    assert float(steep.ground_normal_velocity_rms) < 0.03


def test_axisymmetric_loads_on_level_ground_make_axisymmetric_inflow(settings):
    result = finite_state.from_loads(Case(1.0), settings, LOADS[:1] / (1 + 0.2 * R), STATIONS)
    np.testing.assert_allclose(result.inflow, np.tile(result.inflow[0], (12, 1)), atol=1e-14)


@pytest.mark.parametrize("climb", [0.0, 0.02, 0.1])
def test_one_pressure_term_climbs_as_momentum_theory(climb):
    settings = study_settings(climb_ratio=climb)
    model = finite_state.model_of(Case(), settings)
    thrust = 0.006
    tau = jnp.zeros(len(model.modes)).at[model.modes.index(0, 1)].set(np.sqrt(3) / 4 * thrust)
    result = finite_state.of_pressure(Case(), settings, tau, STATIONS)
    induced = float(result.mean_inflow)
    np.testing.assert_allclose(2 * induced * (climb + induced), thrust, rtol=1e-10)


def test_alone_carries_the_loads_of_its_own_inflow(settings):
    result, own = finite_state.alone(Case(1.0, 15.0), settings)
    stations = own.stations
    through = jnp.broadcast_to(stations.r, result.inflow.shape), result.inflow
    sections = section_loads(settings.rotor, settings.operating, stations.r, *through)
    inner = 1 - np.cumsum(stations.widths[::-1])[::-1]
    lifting = np.clip((0.97 - inner) / np.asarray(stations.widths), 0, 1)  # up to the UH-60's tip loss
    loads = np.asarray(disk_loading(settings.rotor, sections)) * lifting
    back = finite_state.from_loads(Case(1.0, 15.0), settings, loads, stations)
    np.testing.assert_allclose(back.tau, result.tau, atol=1e-10)
    assert 0.004 < float(own.CT) < 0.012


@pytest.mark.parametrize(("loads", "words"), [(LOADS * np.nan, "must be finite"), (-LOADS, "positive thrust")])
def test_loads_that_cannot_drive_it(settings, loads, words):
    with pytest.raises(InputError, match=words):
        finite_state.from_loads(Case(), settings, loads, STATIONS)


def test_no_thrust_no_answer():
    with pytest.raises(InputError, match=r"thrusts upward.* but at -15 deg"):
        finite_state.alone(Case(), study_settings(collective_deg=-15.0))
