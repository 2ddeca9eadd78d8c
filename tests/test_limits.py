"""What each model is for: the page, the doors of models and commands, descent at fixed collective, both precisions."""

from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.bench.cases import Case
from rotorjax.bench.finite_state import alone, axial_state
from rotorjax.bench.settings import study_settings
from rotorjax.bench.single import check_case
from rotorjax.errors import InputError
from rotorjax.inflow.momentum import flight_state, induced_inflow
from rotorjax.limits import TABLE, check_flight, check_place, markdown, of_the_instant, steady_thrusts
from rotorjax.potential.model import finite_state_model, mean_inflow
from rotorjax.rotor import catalogue
from rotorjax.rotor.derived import derived, doubts, notes
from rotorjax.simulation.output import vortex_ring
from rotorjax.trim.run import check, figure_of_merit, numbers, request, run

CT = 0.0064
HOVER = np.sqrt(CT / 2)


def test_the_page_holds_the_table_that_commands_ask():
    page = (Path(__file__).parents[1] / "docs" / "limits.md").read_text(encoding="utf-8")
    assert markdown() in page


@pytest.mark.parametrize("model", TABLE)
def test_limits_hold_at_their_edges(model):
    limits = TABLE[model]
    check_place(model, limits.height)
    check_place(model, None)
    with pytest.raises(InputError, match=f"must be at least {limits.height:g}"):
        check_place(model, 0.99 * limits.height)
    for ratio in (-0.46, -1.0, -1.99):
        with pytest.raises(InputError, match=r"vortex ring state, .*between -0.45 and -2 v_h"):
            check_flight(model, CT, ratio * HOVER)
    if "windmill brake" in limits.states:
        assert check_flight(model, CT, -2.5 * HOVER) == "windmill brake"
    else:
        with pytest.raises(InputError, match="knows hover, climb, slow descent only"):
            check_flight(model, CT, -2.5 * HOVER)


@pytest.mark.parametrize(("height", "slope", "climb"), [(0.1, 0.0, 0.0), (1e-30, 0.0, 0.0), (None, 0.0, -0.5)])
@pytest.mark.parametrize("model", ["vpbfsm", "freewake", "both"])
def test_commands_refuse_what_no_model_is_for(model, height, slope, climb):
    with pytest.raises(InputError, match=r"height|climb"):
        check_case(Case(height, slope), study_settings("uh60", climb_ratio=climb), model)


@pytest.mark.parametrize("inflow", ["uniform", "pitt-peters", "vpbfsm", "freewake"])
def test_every_trim_refuses_the_vortex_ring(inflow):
    with pytest.raises(InputError, match="vortex ring"):
        check(request("uh60", 0.00575, inflow, climb=-0.05))


def descending(ratios):
    """Estimated C_T of the UH-60 at its collective over climb/ΩR."""
    rotor, operating = catalogue.load("uh60")
    tip = float(operating.omega) * float(rotor.radius)
    return [steady_thrusts(rotor, eqx.tree_at(lambda o: o.climb, operating, jnp.asarray(v * tip))) for v in ratios]


def test_descent_at_fixed_collective_passes_the_states_in_their_order():
    """0 to −3 v_h at 18°: hover, slow descent, vortex ring, nothing, windmill brake."""
    states = [found[0][1] if found else "none" for found in descending(-np.arange(0.0, 0.301, 0.02))]
    assert [s for i, s in enumerate(states) if s != states[i - 1] or i == 0] == [
        *("hover", "slow descent", "vortex ring", "none", "windmill brake")
    ]


def test_one_pressure_term_has_momentum_theorys_mean_inflow_in_every_state():
    """Upside down too: with a single radial term the finite state's mean is v of the same thrust and climb."""
    model = finite_state_model(None, 0, 1)
    tau = jnp.array([np.sqrt(3) / 4 * CT])
    for sign in (1, -1):
        for ratio in (-3.0, -2.2, -0.4, 0.0, 1.0):
            climb = sign * ratio * HOVER
            found = mean_inflow(axial_state(model, sign * tau, jnp.asarray(climb)), model)
            np.testing.assert_allclose(found, induced_inflow(sign * CT, climb), rtol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("climb", [-0.25, -0.02, 0.0])
def test_the_rotors_own_loads_keep_the_branch(climb):
    """Mean inflow within a fifth of momentum theory's at its C_T, where the climb branch gives 4 times as much."""
    result, total = alone(Case(), study_settings("uh60", climb_ratio=climb))
    thrust = float(total.CT)
    assert flight_state(thrust, climb) == {-0.25: "windmill brake", -0.02: "slow descent", 0.0: "hover"}[climb]
    np.testing.assert_allclose(result.mean_inflow, induced_inflow(thrust, climb), rtol=0.2)


@pytest.mark.slow
def test_a_wind_turbines_thrust_points_down():
    result, total = alone(Case(), study_settings("uh60", 10.0, 0.2))
    assert float(total.CT) < 0
    np.testing.assert_allclose(result.mean_inflow, induced_inflow(float(total.CT), 0.2), rtol=0.25)


def test_a_figure_of_merit_is_of_hover_alone():
    hover, climbing = (request("uh60", 0.00575, climb=v) for v in (0.0, 0.02))
    assert figure_of_merit(0.006, 0.0005, hover) == pytest.approx(0.006**1.5 / np.sqrt(2) / 0.0005)
    assert figure_of_merit(0.006, 0.0005, climbing) is None
    assert figure_of_merit(-0.006, 0.0005, hover) is None
    assert figure_of_merit(0.006, -0.0005, hover) is None


def test_derived_numbers_are_the_published_ones():
    """UH-60: solidity 0.0822 with the published chord, tip Mach 27·8.178/340.3; the lag damper is there, so no note."""
    rotor, operating = catalogue.load("uh60")
    found = derived(rotor, operating)
    np.testing.assert_allclose(found.solidity, 0.0822, atol=5e-5)
    np.testing.assert_allclose(found.tip_mach, 27 * 8.177784 / 340.294, rtol=1e-6)
    np.testing.assert_allclose(found.reynolds, 0.75 * 27 * 8.177784 * 0.5325 / 1.4607e-5, rtol=2e-3)
    assert found.lock is not None
    assert 7 < found.lock < 11
    assert notes(rotor) == []
    assert "without a damper" in notes(catalogue.load("elliott_althoff")[0])[0]


def test_numbers_of_a_wrong_unit_are_doubted_by_name():
    """Slugs and feet, km/h, radians a second, grams; none of the catalogue's rotors."""
    assert all(doubts(*catalogue.load(name)) == [] for name in catalogue.names())
    changes = {
        "density": {"operating": {"density": 0.002377}},
        "sound_speed": {"operating": {"sound_speed": 1225.0}},
        "tip Mach": {"operating": {"rpm": 27.0}},
        "first_moment/blade_mass": {"hinge": {"blade_mass": 1e5}},
    }
    for what, changed in changes.items():
        assert what in " ".join(doubts(*catalogue.load("uh60", changed)))


def test_seconds_in_the_vortex_ring():
    class Flown:
        class flown:
            class u:
                u, v, w = np.zeros(5), np.zeros(5), HOVER * np.array([0.0, 0.5, 1.0, 2.1, 0.1])

            class y:
                CT = np.full(5, CT)

    assert vortex_ring(Flown, np.arange(5.0)) == 2.0  # type: ignore[arg-type]


@pytest.mark.slow
def test_single_precision_trims_to_its_stated_tolerance():
    """Collective to 1e-6, power to 1e-5 of double precision's."""
    double = numbers(run(request("uh60", 0.00575, "uniform", advance=0.1)))
    with jax.enable_x64(False):
        single = numbers(run(request("uh60", 0.00575, "uniform", advance=0.1)))
    assert single["converged"], single["why"]
    np.testing.assert_allclose(single["collective_deg"], double["collective_deg"], rtol=2e-6)
    np.testing.assert_allclose(single["CP"], double["CP"], rtol=2e-5)


@pytest.mark.slow
def test_single_precision_solves_the_readmes_case():
    double = alone(Case(1.0, 15.0), study_settings("uh60"))
    with jax.enable_x64(False):
        single = alone(Case(1.0, 15.0), study_settings("uh60"))
    np.testing.assert_allclose(single[1].CT, double[1].CT, rtol=5e-6)
    np.testing.assert_allclose(single[0].mean_inflow, double[0].mean_inflow, rtol=5e-6)


def test_a_level_flight_over_a_slope_is_told_to_be_of_the_instant():
    assert of_the_instant(0.1, 0.0) is None
    assert of_the_instant(0.0, 5.0) is None
    assert "a slope of 5 deg" in of_the_instant(0.1, 5.0)
