"""Pictures carry the numbers of their curves, and the page tells the one under the mouse."""

import io
import json

import numpy as np
import pytest
from PIL import Image

from rotorjax.bench import plotting
from rotorjax.bench.curves import KEYWORD, plain
from rotorjax.io.page import write_page
from tests.browser import needs_browser, seen

RED, SPOT = "#ff0000", (0.7, 40.0)  # one red point at x = 0.7, y = 40 on a logarithmic axis


@pytest.fixture(scope="module")
def picture():
    figure = plotting.new_figure(5, 3)
    left, right = figure.subplots(1, 2)
    left.plot([0, 1, np.nan, 2], [0.123456, 1, 2, 3], label=r"$C_T/\sigma$")
    left.axhline(0.5, label="none to read")
    right.semilogy([0.1, SPOT[0], 1.0], [1.0, SPOT[1], 2.0], lw=0, marker="o", ms=9, color=RED, label="spot")
    right.set(xlabel="height\nover R", ylabel=r"$\Omega$")
    return plotting.drawn(figure)


def test_the_picture_is_still_one_and_tells_its_curves(picture):
    opened = Image.open(io.BytesIO(picture))
    opened.verify()  # checksums of all chunks
    left, right = json.loads(Image.open(io.BytesIO(picture)).text[KEYWORD])
    assert left["curves"] == [["C_T/σ", [0, 1, 2], [0.1235, 1, 3]]]
    assert right["x"][3] == "height over R"
    assert right["y"][2:] == ["log", "Ω"]


def test_a_curves_point_is_where_the_picture_has_it(picture):
    """Box, limits and scale put the middle of the three red spots on a red pixel."""
    _, told = json.loads(Image.open(io.BytesIO(picture)).text[KEYWORD])
    seen = np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")).astype(int)
    (x0, x1, *_), (y0, y1, *_), (left, top, width, height) = told["x"], told["y"], told["box"]
    across = left + width * (SPOT[0] - x0) / (x1 - x0)
    down = top + height * (1 - np.log(SPOT[1] / y0) / np.log(y1 / y0))
    red = seen[round(down * seen.shape[0]), round(across * seen.shape[1])]
    np.testing.assert_allclose(red, [255, 0, 0], atol=10)


@pytest.mark.parametrize(
    ("label", "told"),
    [(r"$\lambda/\Omega R$", "λ/Ω R"), (r"inflow over $\sqrt{C_T/2}$", "inflow over √(C_T/2)"), ("h/R", "h/R")],
)
def test_labels_without_formulas(label, told):
    assert plain(label) == told


@needs_browser
def test_the_page_tells_the_value_under_the_mouse(picture, tmp_path):
    write_page(tmp_path / "a.html", "# A\n\n![spot](spot.png)\n", {"spot.png": picture})
    _, told = json.loads(Image.open(io.BytesIO(picture)).text[KEYWORD])
    left, top, width, height = told["box"]
    page = (tmp_path / "a.html").read_text()
    point = f"""<script>addEventListener("load", () => {{
      const img = document.querySelector("img"), at = img.getBoundingClientRect();
      img.dispatchEvent(new PointerEvent("pointermove", {{ bubbles: true,
        clientX: at.left + {left + 0.65 * width} * at.width, clientY: at.top + {top + 0.1 * height} * at.height }}));
      console.log(document.getElementById("told").textContent.replaceAll("\\n", "; ")); }});</script>"""
    (tmp_path / "a.html").write_text(page.replace("</body>", point + "</body>"))
    _, said = seen(tmp_path / "a.html", tmp_path)
    assert len(said) == 1, said
    assert "spot" in said[0]
    assert "height over R: 0.7" in said[0]
    assert "Ω: 40" in said[0]
