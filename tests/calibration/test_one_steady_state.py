"""One steady state for all who ask: the model itself, the study, calibrations and the dynamic rotor."""

import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.bench.finite_state import Stations, evaluate
from rotorjax.calibration.calibration_file import Calibration
from rotorjax.ground import plane
from rotorjax.potential.dynamics import InflowInputs, rhs
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.model import finite_state_model, mean_inflow, steady_state
from rotorjax.region import half_plane

TAU = jnp.array([np.sqrt(3) / 4 * 0.006, 3e-4, 1e-4])
SMALL = DiskQuadrature(12, 12)
SIZES = {"ground_harmonics": 2, "ground_radial_terms": 4, "quadrature": SMALL}
STATIONS = Stations(jnp.array([0.5]), jnp.array([1.0]), jnp.array([0.0, 2.0]))


@pytest.mark.parametrize("climb", [0.0, 0.02])
def test_region_ground_disk_and_climb_give_one_number(climb):
    model = finite_state_model(plane(1.0), region=half_plane(0.0), ground_radius=1.5, **SIZES)
    mine = float(mean_inflow(steady_state(model, TAU, climb), model))
    whole = finite_state_model(plane(1.0), **SIZES)
    assert abs(float(mean_inflow(steady_state(whole, TAU, climb), whole)) - mine) > 0.05 * mine

    same = {name: float(getattr(model.wake, name)) for name in ("radius", "clearance")}
    calibrated, state = Calibration("hayden", same, True, 0.0).apply(model, TAU, climb)
    np.testing.assert_allclose(mean_inflow(state, calibrated), mine, rtol=1e-12)


def test_the_study_sees_the_ground_disk_and_the_climb():
    model = finite_state_model(plane(1.0), ground_radius=1.5)
    studied = evaluate((model, finite_state_model(plane(1.0), printed=True)), TAU, STATIONS, jnp.asarray(0.02))
    np.testing.assert_allclose(studied.mean_inflow, mean_inflow(steady_state(model, TAU, 0.02), model), rtol=1e-12)


@pytest.mark.parametrize("climb", [0.0, 0.02])
def test_the_steady_state_stays_where_it_is(climb):
    model = finite_state_model(plane(1.0), region=half_plane(0.0), ground_harmonics=2, radial_terms=1, quadrature=SMALL)
    tau, inputs = TAU[:1], InflowInputs(TAU[:1], jnp.zeros(()), jnp.asarray(climb))
    state = steady_state(model, tau, climb)
    assert float(jnp.abs(rhs(jnp.zeros(()), state, inputs, model).a).max()) < 1e-14
