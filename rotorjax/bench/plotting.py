"""Pictures of rotor inflow: style, curves across the disk's diameter, polar contours, files in PNG and PDF.

One colour belongs to each model throughout (Okabe and Ito's palette, told apart without colour vision too); series over
height or slope run along a perceptually uniform map. Drawing needs no display and changes no global setting.
"""

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rotorjax.bench.azimuth import refine_azimuth
from rotorjax.bench.curves import KEYWORD, curves
from rotorjax.io.atomic import write_bytes
from rotorjax.io.png_text import with_text

FREE_WAKE, VPBFSM, PRINTED, EXACT_IMAGE, INK = "#0072B2", "#D55E00", "#E69F00", "#009E73", "#222222"
MODEL_STYLE: dict[str, dict[str, Any]] = {
    "free_wake": {"color": FREE_WAKE, "linestyle": "-", "marker": "o", "label": "free wake"},
    "vpbfsm": {"color": VPBFSM, "linestyle": "--", "label": "VPBFSM"},
    "printed": {"color": PRINTED, "linestyle": "-.", "label": "VPBFSM, as printed"},
    "exact_image": {"color": EXACT_IMAGE, "linestyle": ":", "label": "cylinder, exact image"},
}
STYLE = {
    "figure.dpi": 100,
    "savefig.dpi": 150,
    "font.size": 10,
    "font.family": "DejaVu Sans",
    "axes.titlesize": 10,
    "axes.grid": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.6,
    "lines.markersize": 3.2,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "pdf.fonttype": 42,
    "svg.hashsalt": "rotorjax",
}


@contextmanager
def style() -> Iterator[None]:
    """Apply the style to what is drawn and saved in the block."""
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        yield


def new_figure(width: float = 6.0, height: float = 4.0) -> Figure:
    """An empty figure of a size in inches, laid out so that labels never overlap."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, stem: str | Path, formats: Sequence[str] = ("png", "pdf")) -> list[Path]:
    """Write whole files stem.png and stem.pdf. Raises InputError where the folder cannot be written."""
    paths = [Path(f"{stem}.{ending}") for ending in formats]
    with style():
        figure.draw_without_rendering()
    figure.set_layout_engine(None)  # laid out once: with any engine each format is drawn twice
    for path in paths:
        save_file(figure, path)
    return paths


def save_file(figure: Figure, path: str | Path) -> None:
    """Write one whole picture, its format from the name's ending; the same picture gives the same file."""
    write_bytes(path, drawn(figure, Path(path).suffix.lower().removeprefix(".")))


def drawn(figure: Figure, ending: str = "png") -> bytes:
    """A picture as the content of a file of a format; a PNG knows the numbers of its curves."""
    metadata = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}.get(ending, {})
    file = io.BytesIO()
    with style():
        figure.savefig(file, format=ending, metadata=metadata)
    found = file.getvalue()
    return with_text(found, KEYWORD, curves(figure)) if ending == "png" else found


def series_colours(count: int) -> list[Any]:
    """Colours of a series over height or slope, dark to bright, no near-white."""
    return list(mpl.colormaps["viridis"](np.linspace(0.0, 0.85, max(count, 1))))


def diameter_axes(axes: Axes, ylabel: str, *, sides: bool = False) -> None:
    """Label axes for curves across the diameter; `sides` marks valley (ψ = 180°) and mountain (ψ = 0°)."""
    axes.set(xlabel=r"$r/R$", ylabel=ylabel, xlim=(-1, 1))
    axes.set_xticks(np.linspace(-1, 1, 5), ["1", "0.5", "0", "0.5", "1"])
    if sides:
        for x, align, text in ((0.01, "left", "valley side, ψ = 180°"), (0.99, "right", "mountain side, ψ = 0°")):
            look = {"ha": align, "va": "bottom", "fontsize": 9, "fontstyle": "italic", "color": INK}
            axes.text(x, 1.01, text, transform=axes.transAxes, **look)


def legend_below(axes: Axes, columns: int) -> None:
    """A legend under the axes, where it hides no curve."""
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=columns)


def across(r: np.ndarray, mountain: np.ndarray, valley: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One curve from the valley's tip (−1) to the mountain's (1), broken where no blade reaches."""
    gap = [] if r[0] < 0.02 else [np.nan]
    return np.concatenate([-r[::-1], gap, r]), np.concatenate([valley[::-1], gap, mountain])


def polar_contour(
    axes: Any,
    r: np.ndarray,
    psi: np.ndarray,
    values: np.ndarray,
    levels: np.ndarray,
    sides: tuple[str, str] = ("mountain side", "valley side"),
) -> Any:
    """Filled contours of values (K, R) over the disk; seen from above: ψ = 0 (aft, mountain) at the right,
    ψ = 90° (starboard) at the top.

    axes: polar. psi: equally spaced over a turn (rad); few azimuths are refined by their Fourier series. sides: names
    of ψ = 0 and 180°. Returns the contour set, for a colour bar.
    """
    psi, values = refine_azimuth(psi, values)
    closed_psi, closed = np.append(psi, psi[0] + 2 * np.pi), np.vstack([values, values[:1]])
    filled = axes.contourf(closed_psi, r, closed.T, levels=levels, cmap="viridis", extend="both")
    axes.contour(closed_psi, r, closed.T, levels=levels[::2], colors="white", linewidths=0.4, alpha=0.6)
    axes.set_theta_zero_location("E")
    axes.set(ylim=(0, 1), yticks=[0.5, 1.0])
    axes.set_yticklabels(["0.5", ""], color="white", fontsize=8)
    axes.set_thetagrids(range(0, 360, 90), ["", "ψ = 90°", "", "ψ = 270°"], fontsize=8)
    axes.grid(color="white", linewidth=0.4, alpha=0.5)
    axes.tick_params(pad=1)
    axes.set_xlabel("seen from above", fontsize=8)
    for x, rotation, text in ((1.05, 270, f"{sides[0]}, ψ = 0°"), (-0.05, 90, f"{sides[1]}, ψ = 180°")):
        look = {"rotation": rotation, "ha": "center", "va": "center", "fontstyle": "italic", "fontsize": 8}
        axes.text(x, 0.5, text, transform=axes.transAxes, **look)
    return filled


def shared_levels(fields: Sequence[np.ndarray], count: int = 15) -> np.ndarray:
    """Round contour levels that span several fields, for one colour scale."""
    low, high = min(np.nanmin(f) for f in fields), max(np.nanmax(f) for f in fields)
    if not high > low:
        low, high = low - 0.5, high + 0.5
    return np.asarray(mpl.ticker.MaxNLocator(count, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))  # type: ignore[attr-defined]
