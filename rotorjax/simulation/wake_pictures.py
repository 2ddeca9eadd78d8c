"""Pictures of a marched wake: from above, from the side, how it changes; and a film of it."""

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from rotorjax.bench import plotting
from rotorjax.bench.film import write_film
from rotorjax.simulation.ground_view import ground_line

_VIEWS = {"from above": (0, 1), "from the side": (0, 2)}
_LABELS = {0: "forward ← x/R → aft", 1: "port ← y/R → starboard", 2: "z/R"}


def wake_picture(data: xr.Dataset) -> Figure:
    """The wake at the last frame from above and from the side, and its change over a revolution so far."""
    with plotting.style():
        figure = plotting.new_figure(11.0, 3.8)
        above, side, change = figure.subplots(1, 3, width_ratios=(1.2, 1.2, 1.0))
        last = data.isel(frame=-1)
        for axes, title in ((above, "from above"), (side, "from the side")):
            _prepare(axes, data, title)
            _draw(_lines(axes, data, title), last, title)
        turns = data["azimuth"].values / (2 * np.pi)
        moved = data["wake_change"].values
        if np.any(moved > 0):
            change.semilogy(turns, moved, color=plotting.FREE_WAKE)
        else:
            change.text(0.5, 0.5, "less than a revolution", ha="center", transform=change.transAxes)
        change.set(xlabel="revolutions", ylabel="change of the nodes over a revolution, rms/R")
    return figure


def wake_film(data: xr.Dataset, thrust: np.ndarray, path: str | Path, frames_per_second: int = 15) -> None:
    """Write a GIF: the wake from above and from the side, and the thrust so far. thrust: smoothed, at all saves."""
    t, frames = data["time"].values, data["frame"].values

    def build(figure: Figure) -> Any:
        above, side, history = figure.subplots(1, 3, width_ratios=(1.2, 1.2, 0.9))
        drawn = []
        for axes, title in ((above, "from above"), (side, "from the side")):
            _prepare(axes, data, title)
            drawn.append((title, _lines(axes, data, title)))
        history.plot(t, thrust, color=plotting.FREE_WAKE)
        (dot,) = history.plot([], [], "o", color=plotting.INK, ms=5)
        history.set(xlabel="time, s", ylabel=r"$C_T$, mean over the last revolution")

        def draw(frame: int) -> None:
            one = data.isel(frame=frame)
            for title, lines in drawn:
                _draw(lines, one, title)
            at = int(frames[frame])
            dot.set_data([t[at]], [thrust[at]])
            history.set_title(f"t = {t[at]:.2f} s")

        return draw

    write_film(path, build, len(frames), (10.0, 3.6), frames_per_second)


def _prepare(axes: Any, data: xr.Dataset, title: str) -> None:
    """Limits that hold every frame, and the ground where the side view shows it level."""
    places = data["wake_filaments"].values
    i, j = _VIEWS[title]
    spans = [(min(places[..., k].min(), -1.0), max(places[..., k].max(), 1.0)) for k in (i, j)]
    if j == 2:
        spans[1] = (places[..., 2].min(), max(places[..., 2].max(), 0.3))
        if "height" in data:
            spans[1] = (min(spans[1][0], -float(data["height"].max())), spans[1][1])
    axes.set(
        aspect="equal",
        xlim=(spans[0][0] - 0.1, spans[0][1] + 0.1),
        ylim=(spans[1][0] - 0.1, spans[1][1] + 0.1),
        title=title,
        xlabel=_LABELS[i],
        ylabel=_LABELS[j],
    )


def _lines(axes: Any, data: xr.Dataset, title: str) -> dict[str, list[Any]]:
    colours = plotting.series_colours(data.sizes["blade"])
    inboard = data.sizes["filament"] - 1
    floor = title == "from the side" and "height" in data
    return {
        "inboard": [axes.plot([], [], color="#bbbbbb", lw=0.7)[0] for _ in colours for _ in range(inboard)],
        "tip": [axes.plot([], [], color=colour, lw=1.2)[0] for colour in colours],
        "blade": [axes.plot([], [], color=plotting.INK, lw=2.5)[0] for _ in colours],
        "floor": [axes.plot([], [], color="#888888", lw=3)[0]] if floor else [],
    }


def _draw(lines: dict[str, list[Any]], one: xr.Dataset, title: str) -> None:
    i, j = _VIEWS[title]
    strands, leading = one["wake_filaments"].values, one["wake_leading"].values
    inner = strands[:, 1:].reshape(-1, *strands.shape[2:])
    for name, paths in (("inboard", inner), ("tip", strands[:, 0]), ("blade", leading)):
        for line, path in zip(lines[name], paths, strict=True):
            line.set_data(path[:, i], path[:, j])
    for line in lines["floor"]:
        x = np.array(line.axes.get_xlim())
        line.set_data(x, ground_line(x, one, int(one["frame"])))
