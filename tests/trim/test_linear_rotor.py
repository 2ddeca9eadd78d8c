"""The linear rotor in hover: time-invariant, with the blades' modes seen from the hub, and its static responses."""

from dataclasses import replace

import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ode.harmonic import average
from rotorjax.rotor.flap_lag import flap_frequency, lag_frequency
from rotorjax.trim.linear import linear_model
from rotorjax.trim.run import request, run

INPUTS = ("theta_0", "theta_1s", "w", "q")


@pytest.fixture(scope="module")
def hover():
    return run(request("uh60", 0.00575, "pitt-peters")).trimmed


@pytest.fixture(scope="module")
def periodic(hover):
    return linear_model(hover, INPUTS, nodes=4)


@pytest.fixture(scope="module")
def linear(periodic):
    return average(periodic)


def test_hover_is_time_invariant_seen_from_the_hub(periodic):
    np.testing.assert_allclose(periodic.a, np.broadcast_to(periodic.a[:1], periodic.a.shape), atol=1e-9)
    assert periodic.order == 19
    assert periodic.states[1] == "rotor.flap[1]"


def test_modes_are_the_blades_shifted_by_the_rotation(hover, linear):
    """Collective and differential at a blade's own frequencies, cyclic ones a rotation away; all damped."""
    values = np.linalg.eigvals(linear.a)
    assert np.all(values.real < 0)
    # the inflow does not hear the differential modes: those are the single blade's
    names = list(linear.states)
    own = [names.index(f"rotor.{n}[3]") for n in ("flap", "flap_rate", "lag", "lag_rate")]
    blade = np.linalg.eigvals(linear.a[np.ix_(own, own)])
    others = np.delete(np.arange(len(names)), own)
    np.testing.assert_allclose(linear.a[np.ix_(others, own)], 0.0, atol=1e-9)
    flap, lag = blade[np.argmax(blade.imag)], min(blade[blade.imag > 0], key=lambda v: v.imag)
    # damped about as −γ/16 with the offset, at the rotating frequency
    assert abs(flap) == pytest.approx(float(flap_frequency(hover.p.blade)), rel=0.03)
    assert -0.5 < flap.real < -0.3
    assert abs(lag) == pytest.approx(float(lag_frequency(hover.p.blade)), rel=0.1)
    # lag, which the inflow hardly hears: regressing and advancing stand one per rev away
    for shift in (-1, 1):
        assert np.min(np.abs(values - (lag + 1j * shift))) < 0.05


def test_static_gains(linear):
    """Collective and going down add thrust, longitudinal cyclic tips the disk a quarter turn later."""
    gain = linear.d - linear.c @ np.linalg.solve(linear.a, linear.b)
    row = {name: k for k, name in enumerate(linear.outputs)}
    column = {name: k for k, name in enumerate(linear.inputs)}
    assert gain[row["CT"], column["theta_0"]] > 0
    assert gain[row["CT"], column["w"]] > 0
    flap = -np.linalg.solve(linear.a, linear.b)
    names = list(linear.states)
    tilt = flap[names.index("rotor.flap[1]"), column["theta_1s"]]
    assert tilt == pytest.approx(-1.0, abs=0.15)  # β_1c = −θ_1s for a blade without offset
    # a nose-up rate leaves the disk behind: up aft
    assert flap[names.index("rotor.flap[1]"), column["q"]] > 0


def test_a_trim_that_failed_is_refused(hover):
    failed = replace(hover, outcome=replace(hover.outcome, converged=False))
    with pytest.raises(InputError, match="converged"):
        linear_model(failed, hover.flight, hover.p)
