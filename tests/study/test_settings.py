"""The fingerprint sees every setting; what is not allowed is refused."""

from dataclasses import replace

import equinox as eqx
import pytest

from rotorjax.bench.settings import differences, study_settings
from rotorjax.errors import InputError


def test_fingerprint_is_reproducible_and_sees_every_change():
    here = study_settings()
    assert here.fingerprint() == study_settings().fingerprint()
    rotor = eqx.tree_at(lambda rotor: rotor.twist.values, here.rotor, here.rotor.twist.values * 1.001)
    twisted = replace(here, rotor=rotor)
    others = [study_settings(collective_deg=17.0), study_settings(harmonics=2), study_settings(quick=True), twisted]
    others += [study_settings("caradonna_tung"), study_settings(tip_core=0.031), study_settings(climb_ratio=0.01)]
    prints = {here.fingerprint(), *(other.fingerprint() for other in others)}
    assert len(prints) == 1 + len(others)


def test_differences_in_words():
    ours, theirs = study_settings().table(), study_settings(harmonics=2).table()
    assert differences(ours, theirs) == ["vpbfsm.harmonics 2 instead of 1"]


def test_azimuths_suit_the_blades():
    settings = study_settings("caradonna_tung")
    assert settings.wake.azimuths % settings.rotor.blades == 0


@pytest.mark.parametrize(
    ("words", "given"),
    [("`harmonics`", {"harmonics": 0}), ("`collective`", {"collective_deg": 100.0}), ("`climb`", {"climb_ratio": 2.0})],
)
def test_what_is_not_allowed(words, given):
    with pytest.raises(InputError, match=words):
        study_settings(**given)
