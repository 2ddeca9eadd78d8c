"""Blades left to flap in their wake."""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from wakes import COARSE

from rotorjax.bench.cases import Case
from rotorjax.bench.dataset import combine
from rotorjax.bench.flapping import flap_harmonics_deg, flapping_dataset
from rotorjax.bench.record import summary_entry
from rotorjax.bench.settings import study_settings
from rotorjax.rotor.catalogue import load
from rotorjax.rotor.flap_lag import blade_of, flap_frequency
from rotorjax.study.reading import Reading
from rotorjax.study.report import flapping_table
from rotorjax.trim.held import let_flap
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.solution import solve


@pytest.fixture(scope="module")
def rigid():
    return solve(free_wake(*load("uh60"), None, wake_settings(**COARSE, azimuths=4)))


@pytest.fixture(scope="module")
def flapped(rigid):
    return let_flap(rigid)


@pytest.mark.slow
def test_blades_cone_as_lift_and_weight_ask(flapped, rigid):
    """Air's moment against centrifugal force and weight; a steady blade flies where they balance."""
    assert flapped.solution.converged, flapped.solution.why
    model = rigid.model
    blade = blade_of(model.rotor, model.operating)
    beta_0, beta_1c, beta_1s = flapped.harmonics
    assert beta_1c == beta_1s == 0
    lift = np.pi / model.rotor.blades * flapped.solution.dct_dr[0]
    moment = blade.air * np.sum(lift * (flapped.solution.r - blade.offset) * flapped.solution.widths)
    balance = (moment - blade.first_moment * blade.gravity) / flap_frequency(blade) ** 2
    assert beta_0 == pytest.approx(float(balance), rel=0.01)
    assert 0.98 < flapped.solution.CT / rigid.CT < 1.0


@pytest.mark.slow
def test_a_stiff_spring_makes_them_rigid(rigid):
    stiff = eqx.tree_at(lambda m: m.rotor.hinge.flap_spring, rigid.model, replace_fn=lambda k: jnp.full_like(k, 1e14))
    found = let_flap(replace(rigid, model=stiff))
    assert abs(found.flap[0]) < 1e-6
    assert pytest.approx(rigid.CT, rel=1e-6) == found.solution.CT
    assert found.solution.mean_inflow == pytest.approx(rigid.mean_inflow, rel=1e-6)


@pytest.mark.slow
def test_the_study_keeps_both(rigid):
    settings = study_settings(flapping=True, **COARSE, azimuths=4)
    freed = let_flap(rigid)
    data = flapping_dataset(Case(), rigid, freed.solution, freed.flap, settings)
    assert float(data["rigid_CT"]) == rigid.CT
    assert 3.0 < flap_harmonics_deg(data)[0] < 4.5
    entry = summary_entry(data, None)["flapping"]
    assert entry["beta_1c_deg"] == 0
    assert entry["rigid_CT"] == rigid.CT > float(data["CT"])
    np.testing.assert_array_equal(data["wake_state_near"], rigid.state.near)
    assert "β₁c" in flapping_table(Reading(combine([data], settings)))
    assert study_settings("caradonna_tung", flapping=True).flapping is False
