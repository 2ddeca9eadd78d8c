"""Films of a flight."""

from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.figure import Figure

from rotorjax.bench import plotting
from rotorjax.io.atomic import whole_file


def write_film(
    path: str | Path,
    build: Callable[[Figure], Callable[[int], None]],
    frames: int,
    size: tuple[float, float],
    frames_per_second: int = 15,
) -> None:
    """Write a whole GIF. build: puts everything into an empty figure and returns what draws one frame by number."""
    with mpl.rc_context({**plotting.STYLE, "figure.dpi": 80}):  # type: ignore[arg-type]
        figure = plotting.new_figure(*size)
        draw = build(figure)
        draw(0)
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # laid out once, not again for each frame

        def again(frame: int) -> list:
            draw(frame)
            return []

        film = FuncAnimation(figure, again, frames=frames, blit=False)
        with whole_file(path) as temporary:
            film.save(temporary, writer=PillowWriter(fps=frames_per_second))
