"""Verdicts, limits and the formulas that wakes are compared with."""

import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.reference import published as reference
from rotorjax.rotor.catalogue import load
from rotorjax.rotor.geometry import solidity
from rotorjax.validation import landgrebe
from rotorjax.validation.row import Against, Row, above_zero, absolute, between, relative

NOTHING = Against("a source", "none", "a reason")


def row(ours, limits):
    return Row("case", "quantity", ours, limits, NOTHING)


@pytest.mark.parametrize(
    ("ours", "limits", "met"),
    [
        (1.029, relative(0.03, 1.0), True),
        (1.031, relative(0.03, 1.0), False),
        (-1.02, relative(0.03, -1.0), True),
        (0.5, absolute(0.02, 0.49), True),
        (0.5, absolute(0.02, 0.47), False),
        (1.25, between(1.0, 1.25), True),
        (0.9999, between(1.0, 1.25), False),
        (5.0, between(1.0, np.inf), True),
        (0.0, above_zero(), False),
        (1e-9, above_zero(), True),
        (float("nan"), between(-np.inf, np.inf), False),
    ],
)
def test_verdict(ours, limits, met):
    assert row(ours, limits).met is met
    assert row(ours, limits).verdict == ("met" if met else "out")


def test_a_row_as_a_table_holds_its_range_and_difference():
    table = row(1.1, relative(0.08, 1.0)).table()
    assert table["difference"] == pytest.approx(0.1)
    assert (table["low"], table["high"]) == pytest.approx((0.92, 1.08))
    assert table["allowed"] == "±8 %"
    assert row(1.1, between(1.0, 1.25)).table()["difference"] is None


def test_the_measurements_are_those_of_the_report():
    hover, path = reference.caradonna_tung(), reference.caradonna_tung_path()
    assert hover.thrust == 0.00459
    np.testing.assert_array_equal(hover.r, [0.5, 0.68, 0.8, 0.89, 0.96])
    assert path.z[-2] == -0.275
    assert np.rad2deg(path.age[-2]) == pytest.approx(360)
    assert np.all(np.diff(path.z) <= 0)


def test_cheeseman_and_bennetts_ratio_at_constant_thrust_is_theirs_at_constant_power():
    """What lifts T∞ with a power far away lifts T with it near the ground: P ∝ k T^1.5, so k = (T∞/T)^1.5."""
    for height in (0.5, 1.0, 2.0):
        at_constant_power = 1 / (1 - 1 / (16 * height**2))
        assert reference.cheeseman_bennett(height) * at_constant_power**1.5 == pytest.approx(1)


def test_the_measured_ground_effect_is_the_curves_and_ends_with_it():
    assert [reference.isolated_rotors(h) for h in (0.5, 1.0, 1.5, 2.0)] == [0.72, 0.848, 0.925, 0.972]
    assert reference.isolated_rotors(0.75) == pytest.approx(0.7925)
    assert reference.isolated_rotors(3.0) is None


@pytest.mark.parametrize(("blades", "solidity_"), [(2, 0.0424), (4, 0.0849)])
def test_knight_and_hefners_polars_are_those_of_the_catalogues_rotors(blades, solidity_):
    polar = reference.knight_hefner(blades)
    body, operating = load(f"knight_hefner_{blades}")
    assert body.blades == blades
    assert float(solidity(body)) == pytest.approx(solidity_, abs=1e-4)
    reynolds = operating.tip_speed(body.radius) * body.chord(jnp.ones(())) / operating.viscosity
    assert float(reynolds) == pytest.approx(242000, rel=2e-3)
    assert np.all(np.diff(polar.thrust) > 0)
    assert np.all(np.diff(polar.torque) > 0)
    at8 = list(polar.pitch_deg).index(8)
    measured = {2: 0.5304, 4: 0.5281}[blades]  # as the report has it
    assert reference.figure_of_merit(polar.thrust[at8], polar.torque[at8]) == pytest.approx(measured, abs=1e-3)


def test_references_have_their_limits():
    assert reference.induced_power_factor(0.006, 0.006**1.5 / np.sqrt(2)) == pytest.approx(1)
    assert reference.cheeseman_bennett(100.0) == pytest.approx(1, abs=1e-5)
    assert reference.cheeseman_bennett(0.5) == pytest.approx(0.75**1.5)
    assert reference.hayden(1.0) == pytest.approx(1 / (0.9926 + 0.0379 * 4))
    path = reference.landgrebe(np.array([0.0, 100.0]), 0.005, 0.1, 0.0, 2)
    np.testing.assert_allclose(path.r, [1.0, 0.78])
    assert path.z[1] - path.z[0] == pytest.approx(
        -0.25 * 0.05 * np.pi - 1.41 * np.sqrt(0.0025) * (100 - np.pi), rel=1e-12
    )


def test_the_step_response_is_the_linear_limit_of_the_published_equation():
    """0.849 λ' + 2λ² = C_T(θ, λ), marched for a tiny step with a fine Euler scheme."""
    inflow, sigma, theta = 0.05, 0.08, 0.2
    lift = 0.5 * sigma * reference.SLOPE
    constant = 2 * inflow**2 - lift * (theta / 3 - inflow / 2)  # makes λ the state before the step
    step, count = 1e-5, 20000
    psi = np.linspace(0, 6, count + 1)
    now, states = inflow, [inflow]
    for _ in range(count):
        now += 6 / count / reference.MASS * (lift * ((theta + step) / 3 - now / 2) + constant - 2 * now**2)
        states.append(now)
    final = inflow + lift * step / 3 / (4 * inflow + lift / 2)
    share, thrust = reference.step_response(psi, inflow, sigma)
    np.testing.assert_allclose((np.array(states) - inflow) / (final - inflow), share, atol=1e-3)
    assert thrust[0] == pytest.approx(lift * step / 3 / (4 * inflow * (final - inflow)), rel=1e-9)
    assert thrust[-1] < 1.1


def test_what_landgrebes_fit_misses_is_what_is_allowed():
    margin, share = landgrebe.misses()
    measured = reference.caradonna_tung_path()
    body, _ = load("caradonna_tung")
    fit = reference.landgrebe(measured.age, 0.00459, float(solidity(body)), 0.0, 2)
    assert margin == pytest.approx(np.abs(fit.r - measured.r).max())
    assert 0.03 < margin < 0.06
    assert 0.05 < share < 0.2
