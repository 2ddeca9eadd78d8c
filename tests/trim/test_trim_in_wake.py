"""Trim in a small free wake: what it was asked for, power balance, symmetry, derivatives, the commands' numbers."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from wakes import COARSE

from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.rotor import flap_lag
from rotorjax.rotor.catalogue import load
from rotorjax.rotor.hub import rotor_inputs
from rotorjax.rotor.moving_blade import AirLoads
from rotorjax.simulation.start import from_wake
from rotorjax.simulation.step import instant
from rotorjax.trim import in_wake
from rotorjax.trim.free_wake import hub_moment, residual
from rotorjax.trim.in_wake import (
    QUICK,
    ROUGH,
    THICK,
    TOL,
    _by_way_of_washout,
    _damped,
    _Stages,
    _thinner,
    _with_cores,
    alike,
    trim_in_wake,
    wake_trim,
)
from rotorjax.trim.means import evaluated, means
from rotorjax.trim.run import check, numbers, request, restored, run, table, unknowns
from rotorjax.trim.verdict import verdict
from rotorjax.wake.settings import flight_settings, wake_settings

THRUST = 0.0058
TINY = {"panels": 6, "age_step_deg": 30.0, "near_wake_deg": 120.0, "closure_turns": 1, "closure_bundles": 0}


@pytest.fixture(scope="module")
def cruise():
    settings = flight_settings(4, **TINY, azimuths=8)
    return run(request("uh60", THRUST, "freewake", 0.2, tilt_deg=4.0, wake=settings))


@pytest.fixture(scope="module")
def told(cruise):
    return numbers(cruise)


@pytest.mark.slow
def test_a_plain_flight_at_the_settings_of_users_is_found():
    """An upright shaft in free air: it once stalled at 5e-6 (`benchmarks/anywhere.py --parts known` has others)."""
    found = run(request("uh60", 0.00578, "freewake", 0.15))
    assert found.converged, found.verdict
    assert found.trimmed.outcome.residual < 1e-7
    assert found.trimmed.p.model.settings == flight_settings(4)  # nothing damped
    ideal = 0.00578**2 / (2 * np.hypot(0.15, 0.019))  # Glauert's, of a wing of the disk's span
    assert 1 < numbers(found)["CP_induced"] / ideal < 1.5


@pytest.mark.slow
def test_forward_flight_is_trimmed(told):
    assert told["converged"]
    assert told["residual"] < 1e-7
    assert told["CT"] == pytest.approx(THRUST, rel=1e-6)
    assert abs(told["beta_1c_deg"]) < 1e-5
    assert abs(told["beta_1s_deg"]) < 1e-5
    assert told["theta_1s_deg"] < -1 < 0.5 < told["theta_1c_deg"]


@pytest.mark.slow
def test_a_trim_starts_from_its_neighbour_as_from_nothing(cruise):
    """From μ = 0.2 to 0.22 and back; what a sweep keeps of a trim is the same trim."""
    aside = run(replace(cruise.request, advance=0.22), cruise.trimmed)
    back = run(cruise.request, restored(aside.request, unknowns(aside.trimmed)))
    assert aside.converged
    assert back.converged
    assert aside.trimmed.iterations < 0.5 * cruise.trimmed.iterations
    assert abs(aside.means.CQ / cruise.means.CQ - 1) > 1e-3
    np.testing.assert_allclose(back.means.controls, cruise.means.controls, atol=1e-5)
    np.testing.assert_allclose(back.means.CQ, cruise.means.CQ, rtol=1e-5)
    assert not alike(wake_trim(*load("uh60"), rotor_inputs(height=1.0), THRUST, plane(1.0)), cruise.trimmed.p)


@pytest.mark.slow
def test_power_adds_up(told):
    """The shaft's work goes into induced flow, drag and flight; blades keep none over a revolution."""
    parts = sum(told[f"CP_{part}"] for part in ("induced", "profile", "parasite", "damper"))
    assert parts == pytest.approx(told["CP"], rel=2e-5)
    assert 0 < told["CP_damper"] < 1e-3 * told["CP"]


@pytest.mark.slow
def test_induced_power_is_above_glauerts_least(told):
    wind = np.hypot(told["advance_ratio"], 0.03)
    assert 1.0 < told["CP_induced"] / (THRUST**2 / (2 * wind)) < 1.6


@pytest.mark.slow
def test_residual_has_the_derivative_of_finite_differences(cruise):
    z, p = cruise.trimmed.z, cruise.trimmed.p
    keys = iter(jax.random.split(jax.random.key(1), 20))
    way = jax.tree.map(lambda a: jax.random.normal(next(keys), a.shape), z)
    function = eqx.filter_jit(residual)
    slope = eqx.filter_jit(lambda z, p, v: jax.jvp(lambda y: residual(y, p), (z,), (v,))[1])(z, p, way)

    def at(step):
        return function(jax.tree.map(lambda a, v: a + step * v, z, way), p)

    step = 1e-6
    near = jax.tree.map(lambda a, b: (a - b) / (2 * step), at(step), at(-step))
    flat = [np.concatenate([np.ravel(a) for a in jax.tree.leaves(t)]) for t in (slope, near)]
    assert np.linalg.norm(flat[0] - flat[1]) < 1e-6 * np.linalg.norm(flat[1])


@pytest.mark.slow
def test_hover_needs_no_cyclic_and_is_a_steady_state_of_the_coupled_rotor():
    settings = wake_settings(**COARSE, azimuths=4)
    p = wake_trim(*load("uh60"), rotor_inputs(), THRUST, settings=settings)
    found = trim_in_wake(p, jnp.array([0.31, 0.0, 0.0]), 0.05)
    flown = means(found)
    assert found.outcome.converged
    assert pytest.approx(flown.CT, rel=1e-6) == THRUST
    assert flown.CP_induced + flown.CP_profile == pytest.approx(flown.CQ, rel=1e-6)
    assert flown.CP_parasite == 0
    assert 0.04 < flown.flap[0] < 0.07
    _lag_balances_the_torque(found, flown)
    start = from_wake(found)
    rates, out = instant(start.x, start.inputs, start.p)
    still = (rates.rotor, rates.inflow)
    assert max(float(jnp.max(jnp.abs(leaf))) for leaf in jax.tree.leaves(still)) < 1e-6
    assert float(out.CT) == pytest.approx(THRUST, rel=1e-6)
    assert float(out.CQ) == pytest.approx(flown.CQ, rel=1e-6)
    _lag_frequency_without_air(start)


def _lag_balances_the_torque(found, flown):
    """The air's moment about the lag hinge against e S Ω² ζ; by torque as large as with Pitt and Peters' inflow."""
    blade, loads = found.p.blade, evaluated(found.z, found.p)[1]
    ahead = np.array([np.sin(flown.lag[0]), np.cos(flown.lag[0]), 0.0])
    against = -float(blade.air * loads.moment[0] @ ahead)
    assert np.sin(flown.lag[0]) == pytest.approx(against / float(blade.offset * blade.first_moment), rel=1e-6)
    lag_0_deg, torque = 5.1333, 4.00552e-4  # `rotorjax trim --thrust-coefficient 0.0058 --json FILE`
    assert np.rad2deg(flown.lag[0]) / flown.CQ == pytest.approx(lag_0_deg / torque, rel=0.01)


def _lag_frequency_without_air(start):
    """The coupled wake's own equations: 0.268 per rev from hinge offset and inertia."""
    p = eqx.tree_at(lambda p: p.blade.air, start.p, jnp.asarray(1e-12))
    still = eqx.tree_at(lambda x: x.rotor, start.x, jax.tree.map(jnp.zeros_like, start.x.rotor))
    step = 1e-4

    def pull(lag):
        x = eqx.tree_at(lambda x: x.rotor.lag, still, still.rotor.lag.at[0].set(lag))
        return float(instant(x, start.inputs, p)[0].rotor.lag_rate[0])

    stiffness = -(pull(step) - pull(-step)) / (2 * step)
    assert np.sqrt(stiffness) == pytest.approx(float(flap_lag.lag_frequency(p.blade)), rel=1e-6)
    assert np.sqrt(stiffness) == pytest.approx(0.268, abs=5e-4)


def test_hub_moment_of_flapping_blades_without_air():
    """Free blades pull at their offset hinges: B/2 e S ν² β₁ for small flapping, nose up where the disk is low aft."""
    p = wake_trim(*load("uh60"), rotor_inputs(), THRUST)
    p = eqx.tree_at(lambda p: p.blade.gravity, p, jnp.zeros(()))
    psi, size = 2 * np.pi / 8 * np.arange(8), 1e-4
    none = AirLoads(*(jnp.zeros((8, *s)) for s in ((14, 3), (3,), (3,), (), ())), loads=None)
    blade = p.blade
    stiff = float(flap_lag.flap_frequency(blade)) ** 2 * float(blade.offset * blade.first_moment / blade.air)
    found = hub_moment(jnp.asarray(size * np.cos(psi)), jnp.zeros(8), none, p)
    np.testing.assert_allclose(found, [0, -4 / np.pi / 2 * stiff * size, 0], rtol=1e-6, atol=1e-12)
    found = hub_moment(jnp.asarray(size * np.sin(psi)), jnp.zeros(8), none, p)
    np.testing.assert_allclose(found, [4 / np.pi / 2 * stiff * size, 0, 0], rtol=1e-6, atol=1e-12)


def test_what_the_free_wake_cannot_do_is_refused():
    with pytest.raises(InputError, match="did you mean 'freewake'"):
        check(request("uh60", THRUST, "freewak"))
    climbing = rotor_inputs(w=-0.02, height=1.0)
    p = wake_trim(*load("uh60"), climbing, THRUST, plane(1.0))
    with pytest.raises(InputError, match="away from it: set climb = 0"):
        trim_in_wake(p, jnp.zeros(3), 0.0)


@pytest.mark.slow
def test_a_trim_says_what_it_is_worth(cruise, told):
    """Converged: nothing moves. Called off a little early: the loads hold, and within what. Far off: no solution."""
    assert told["verdict"] == "converged"
    assert told["load_change"] < 1e-5
    assert told["node_movement"] < 1e-5
    assert "converged: loads change by" in table(told)

    def judged(size):
        z = eqx.tree_at(lambda z: z.wake.gamma_bound, cruise.trimmed.z, (1 + size) * cruise.trimmed.z.wake.gamma_bound)
        outcome = replace(cruise.trimmed.outcome, converged=False, why="called off")
        return verdict(replace(cruise.trimmed, z=z, outcome=outcome))

    early, far = judged(1e-4), judged(0.5)
    assert early.word == "stalled"
    assert 1e-7 < early.load_change < 1e-2
    assert 1e-7 < early.node_movement < 1e-3
    assert "loads good to about" in str(early)
    assert far.word == "no solution"
    assert "called off" in str(far)


@pytest.mark.slow
def test_damping_the_highest_harmonics_is_told_and_changes_little(cruise):
    damped = _damped(cruise.trimmed.p, 0.3)
    outcome = _Stages(None).found("trim", cruise.trimmed.z, damped, TOL)
    found = replace(cruise.trimmed, z=outcome.x, p=damped, outcome=outcome)
    assert "converged with its highest harmonics damped (azimuth_damping = 0.3)" in str(verdict(found))
    assert str(verdict(cruise.trimmed)).startswith("converged: ")
    assert not np.allclose(found.z.wake.far, cruise.trimmed.z.wake.far, atol=1e-5)
    np.testing.assert_allclose(means(found).CQ, cruise.means.CQ, rtol=0.01)
    with pytest.warns(UserWarning, match=r"azimuth_damping = 0\.3\); a march and a linear model have no such damping"):
        from_wake(found)


def test_as_much_is_damped_as_leads_to_a_trim(cruise, monkeypatch):
    """By no less than asked for, and once."""
    made, start = cruise.trimmed.p, (jnp.asarray(cruise.means.controls[:3]), float(cruise.means.flap[0]))

    def tried(asked, enough):
        rates = []

        def thinner(p, *_):
            rates.append(p.model.settings.azimuth_damping)
            return replace(cruise.trimmed.outcome, converged=rates[-1] >= enough)

        monkeypatch.setattr(in_wake, "_thinner", thinner)
        p = replace(made, model=replace(made.model, settings=replace(made.model.settings, azimuth_damping=asked)))
        found = in_wake._from_wind(p, *start, _Stages(None))
        return rates, found.outcome.converged and found.p.model.settings.azimuth_damping

    lost = replace(cruise.trimmed.outcome, converged=False)
    monkeypatch.setattr(_Stages, "passes", lambda *_: cruise.trimmed.outcome)
    monkeypatch.setattr(in_wake, "_lost", lambda *_: replace(cruise.trimmed, outcome=lost))
    assert tried(0.0, 0.3) == ([0.0, 0.0, 0.3], 0.3)
    assert tried(0.0, 1.0) == ([0.0, 0.0, 0.3, 1.0], 1.0)
    assert tried(2.0, 9.0) == ([2.0, 2.0, 2.0], False)


@pytest.mark.slow
def test_the_long_way_round_comes_to_the_same_trim(cruise):
    """Thicker cores and an auxiliary flow, which slow flight needs, and back."""
    controls, coning = jnp.asarray(cruise.means.controls[:3]), float(cruise.means.flap[0])
    seen = []
    stages = _Stages(lambda stage, residual: seen.append(stage))
    thick = _by_way_of_washout(_with_cores(cruise.trimmed.p, THICK), controls, coning, stages)
    found = _thinner(cruise.trimmed.p, thick.x, QUICK, ROUGH, stages)
    assert found.converged
    stages_seen = ["auxiliary flow", "less auxiliary flow", "thinner cores", "trim"]
    assert list(dict.fromkeys(seen)) == stages_seen
    np.testing.assert_allclose(found.x.controls, cruise.trimmed.z.controls, atol=1e-6)
    np.testing.assert_allclose(found.x.wake.far, cruise.trimmed.z.wake.far, atol=1e-4)
