"""Verdicts turn with the numbers: each claim is shown data for which it holds and data for which it does not."""

import numpy as np
import pytest

from rotorjax.bench.cases import Case
from rotorjax.study import claims, level_claims, slope_claims
from rotorjax.study.claim import GOOD_AGREEMENT
from rotorjax.study.reading import Reading, falls


def changed(merged, **fields):
    """The data set with some variables put through functions of (values, case names)."""
    names = [str(n) for n in merged["case"].to_numpy()]
    return Reading(
        merged.assign({k: merged[k].copy(data=f(merged[k].to_numpy().copy(), names)) for k, f in fields.items()})
    )


def reverse(values, names):
    """Mountain and valley side exchanged."""
    return np.roll(values, values.shape[1] // 2, axis=1)


def set_to(other):
    return lambda values, names: other


def test_what_made_up_wakes_must_show(merged):
    reading = Reading(merged)
    rigid = reading.as_printed  # of the default's tilt, whose edge gives way, the made-up loads leave nothing
    assert claims.ground_effect(reading)[0]
    assert claims.tilts_grow(rigid)[0]
    assert claims.converged(reading)[0]
    assert level_claims.inflow_falls(reading)[0]
    assert slope_claims.sides_part(rigid)[0]
    assert slope_claims.gentle_slopes(reading)[0]


def test_verdicts_turn(merged):
    upside_down = changed(merged, CT=lambda v, names: v[::-1])
    assert claims.ground_effect(upside_down)[0] is False
    exchanged = changed(merged, free_wake_inflow=reverse, free_wake_dct_dr=reverse)
    assert claims.tilts_grow(exchanged)[0] is False
    assert slope_claims.sides_part(exchanged)[0] is False
    assert slope_claims.gentle_slopes(exchanged)[0] is False
    assert claims.converged(changed(merged, free_wake_residual=lambda v, names: v + 1e-2))[0] is False
    assert (
        level_claims.ground_condition(changed(merged, vpbfsm_ground_normal_velocity_rms=lambda v, n: v + 1))[0] is False
    )


def test_agreement_is_a_tenth_of_what_the_figures_span(merged):
    judge = level_claims.close_at(Case(1.0))
    assert judge(changed(merged, vpbfsm_inflow_rms_difference=lambda v, n: 0 * v + GOOD_AGREEMENT - 0.01))[0] is True
    assert judge(changed(merged, vpbfsm_inflow_rms_difference=lambda v, n: 0 * v + GOOD_AGREEMENT + 0.01))[0] is False


def test_closer_on_the_valley_side(merged):
    judge = slope_claims.closer_on_valley(Case(1.0, 15.0))
    free = merged["free_wake_inflow"].to_numpy()
    mountain = np.cos(merged["station_azimuth"].to_numpy()) > 0.1
    assert judge(changed(merged, vpbfsm_inflow=set_to(free * np.where(mountain, 1.2, 1.01)[:, None])))[0] is True
    assert judge(changed(merged, vpbfsm_inflow=set_to(free * np.where(mountain, 1.01, 1.2)[:, None])))[0] is False


def test_peaks_and_sectors_are_found_where_they_are(merged):
    psi, r = merged["azimuth"].to_numpy(), merged["radius"].to_numpy()
    bump = np.exp(-8 * (1 - np.cos(psi - np.deg2rad(270)))[:, None] - 50 * (r - r[10]) ** 2)
    reading = changed(merged, free_wake_dct_dr=lambda v, names: 0 * v + bump)
    value, radius, azimuth = reading.peak(Case(1.0, 15.0), (0.2, 1.0))
    assert (value, radius, round(azimuth)) == (1.0, r[10], 270)
    sides = [reading.sector(Case(1.0, 15.0), (0.2, 1.0), side) for side in (0, 90, 180, 270)]
    assert int(np.argmax(sides)) == 3


def test_without_cases_nothing_is_claimed(merged):
    few = Reading(merged.sel(case=["oge"]))
    verdicts = {claim.where: claim.holds for claim in claims.paper_claims(few)}
    assert verdicts["Fig. 9"] is None
    assert verdicts["Fig. 14"] is None


@pytest.mark.parametrize(("values", "expected"), [([3, 2, 1], True), ([3, 3], False), ([1], True)])
def test_falls(values, expected):
    assert falls(values) is expected


def test_cases_that_did_not_converge_bear_no_witness(merged):
    lost = changed(merged, converged=lambda v, names: np.where(np.array(names) == "h1", 0.0, v))
    assert level_claims.close_at(Case(1.0))(lost)[0] is None
    assert Case(1.0) not in lost.level()
    assert claims.converged(lost)[0] is False
