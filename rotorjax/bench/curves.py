"""The curves of a picture as numbers, so that a page can tell the values under the mouse (io/page.html)."""

import json
import re
import unicodedata
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

KEYWORD = "rotorjax-curves"  # of the text in a PNG file
MOST = 300  # points of a curve that are kept


def curves(figure: Figure) -> str:
    """JSON in ASCII, of a figure that was drawn: for each rectangular axes its box (left, top, width, height over the
    figure's), limits, scales, labels, and every curve's name and points (four digits). Others are left out.
    """
    told = [_axes(one) for one in figure.axes if one.name == "rectilinear" and one.get_visible()]
    return json.dumps([one for one in told if one["curves"]], separators=(",", ":"))


def _axes(axes: Axes) -> dict[str, Any]:
    left, bottom, width, height = axes.get_position().bounds
    return {
        "box": [round(v, 5) for v in (left, 1 - bottom - height, width, height)],
        "x": [*map(float, axes.get_xlim()), axes.get_xscale(), plain(_label(axes, "x"))],
        "y": [*map(float, axes.get_ylim()), axes.get_yscale(), plain(axes.get_ylabel())],
        "curves": [_curve(line) for line in axes.lines if line.get_visible() and _in_data(line)],
    }


def _label(axes: Axes, of: str) -> str:
    """The axis' own label, or that of the axes below that share it."""
    shared = (one.xaxis.get_label_text() for one in axes.get_shared_x_axes().get_siblings(axes))
    return axes.get_xlabel() or next(filter(None, shared), "")


def _in_data(line: Line2D) -> bool:
    """Whether both of its coordinates are the axes' own: a line right across is none to read."""
    return all(line.get_transform().contains_branch_seperately(line.axes.transData))  # type: ignore[union-attr]


def _curve(line: Line2D) -> list[Any]:
    x, y = (np.ma.filled(np.ma.asarray(v, float), np.nan) for v in line.get_data(orig=False))
    finite = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    kept = finite[:: -(-len(finite) // MOST) or 1]
    name = str(line.get_label())
    return [
        "" if name.startswith("_") else plain(name),
        *([float(f"{v:.4g}") for v in values[kept]] for values in (x, y)),
    ]


def plain(text: str) -> str:
    """A label without the signs of formulas: Greek letters as such."""
    text = re.sub(r"\\sqrt\{([^}]*)\}", r"√(\1)", text)
    text = re.sub(r"\\(?:mathrm|mathbf|text|rm|bar|dot|left|right)(?![a-zA-Z])", "", text)
    return re.sub(r"[${}\\]", "", re.sub(r"\\([A-Za-z]+)", _greek, text)).replace("\n", " ")


def _greek(found: re.Match[str]) -> str:
    size = "CAPITAL" if found[1][0].isupper() else "SMALL"
    try:
        return unicodedata.lookup(
            f"GREEK {size} LETTER {found[1].replace('lambda', 'lamda').replace('Lambda', 'Lamda')}"
        )
    except KeyError:
        return found[1]
