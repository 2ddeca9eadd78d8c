"""A scene is one file that needs nothing else, and a browser shows it."""

import base64
import json
import re

import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.io.scene import Layer, Scene, write_scene
from tests.browser import needs_browser, seen

PSI = np.linspace(0, 4 * np.pi, 60)
HELIX = np.stack([np.cos(PSI), np.sin(PSI), -PSI / 15], axis=-1)[None, None]
BLADE = np.array([[[[[0.1, 0.05, 0.0], [1.0, 0.05, 0.0]], [[0.1, -0.05, 0.0], [1.0, -0.05, 0.0]]]]])


def scene(**changes):
    layers = (
        Layer("tip vortices", HELIX, 0.01, {"age, deg": np.rad2deg(PSI)[None, None]}),
        Layer("blades", BLADE, surface=True),
    )
    return Scene(**({"title": "A <helix> & more", "layers": layers, "facts": {"C_T": "0.006"}, "spin": True} | changes))


def test_the_page_holds_what_it_shows_and_asks_for_nothing(tmp_path):
    write_scene(tmp_path / "a.html", scene(height=1.0, slope_deg=10.0))
    text = (tmp_path / "a.html").read_text()
    assert "://" not in text, "a page that opens offline has no addresses"
    assert "<title>A &lt;helix&gt; &amp; more</title>" in text
    held = json.loads(re.search(r'<script id="scene"[^>]*>(.*?)</script>', text, re.DOTALL)[1])
    found = np.frombuffer(base64.b64decode(held["layers"][0]["points"]), "<f4").reshape(HELIX.shape)
    np.testing.assert_allclose(found, HELIX, atol=1e-6)
    assert held["layers"][0]["shape"] == [1, 1, 60]
    assert held["slope"] == pytest.approx(np.deg2rad(10.0))


@pytest.mark.parametrize(
    ("layer", "told"),
    [
        (Layer("a", np.repeat(HELIX, 3, axis=0)), "1 or 2 frames, but 'points' of 'a' has 3"),
        (Layer("a", HELIX * np.nan), "'points' of 'a' is not"),
    ],
)
def test_what_cannot_be_shown_is_refused(tmp_path, layer, told):
    with pytest.raises(InputError, match=told):
        write_scene(tmp_path / "a.html", scene(layers=(layer,), times=("0", "1")))
    assert not list(tmp_path.iterdir())


@needs_browser
@pytest.mark.parametrize("times", [("",), ("0 s", "1 s")], ids=["spinning", "frames"])
def test_a_browser_draws_it_without_complaint(tmp_path, times):
    write_scene(tmp_path / "a.html", scene(times=times, spin=len(times) == 1, height=0.9))
    picture, said = seen(tmp_path / "a.html", tmp_path)
    assert said == []
    red, green, blue = np.moveaxis(picture[100:600, 250:750], -1, 0)
    coloured = np.max([abs(red - green), abs(green - blue)], axis=0) > 0.2  # the scale's colours; all else is grey
    assert coloured.mean() > 0.01
