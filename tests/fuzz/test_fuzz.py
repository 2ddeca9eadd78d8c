"""The short run of the generated inputs, and inputs that hypothesis makes of whole texts and numbers."""

import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rotorjax.calibration.calibration_file import load as load_calibration
from rotorjax.deck.case import read_case as read_deck
from rotorjax.errors import InputError
from rotorjax.rotor import catalogue
from rotorjax.simulation.case import read_case as read_flight
from rotorjax.trim.solve import flight
from tests.fuzz.__main__ import run
from tests.fuzz.targets import CALIBRATION, DECK, FLIGHT, TARGETS, refusal


@pytest.mark.parametrize("target", TARGETS, ids=lambda t: t.__name__)
def test_generated_inputs_are_refused_or_make_sense(target):
    counts, findings = run(25, seed=1000, only=target.__name__)
    assert not findings, findings[0]
    assert sum(counts.values()) == 25


def test_what_is_spoiled_was_right(tmp_path):
    """A file that is refused as it stands would hide what spoiling it does."""
    for text, read in ((DECK, read_deck), (FLIGHT, read_flight), (CALIBRATION, load_calibration)):
        (tmp_path / "file.toml").write_text(text)
        assert read(tmp_path / "file.toml") is not None


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(text=st.text(max_size=200))
def test_any_text_as_a_rotor_file(tmp_path, text):
    path = tmp_path / "rotor.toml"
    path.write_text(text, encoding="utf-8", errors="surrogatepass")
    with pytest.raises(InputError) as caught:
        catalogue.load(path)
    refusal(caught.value, "rotor.toml")


@settings(max_examples=60, deadline=None)
@given(st.floats(), st.floats(), st.floats())
def test_any_numbers_as_a_flight(thrust, advance, climb):
    try:
        found = flight(thrust, advance, climb)
    except InputError as error:
        refusal(error)
    else:
        assert float(found.thrust) > 0
        assert all(math.isfinite(float(v)) for v in (found.thrust, found.advance, found.climb))
