"""Films: animated GIF files."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.figure import Figure

from rotorjax.bench import plotting
from rotorjax.errors import InputError
from rotorjax.io.atomic import write_bytes


def write_film(
    path: str | Path,
    build: Callable[[Figure], Callable[[int], None]],
    frames: int,
    size: tuple[float, float],
    frames_per_second: int = 15,
) -> None:
    """Write a whole GIF. build: puts everything into an empty figure and returns what draws one frame by number.

    Raises InputError where it cannot be written.
    """
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
        write_bytes(path, _saved(film, frames_per_second))


def _saved(film: FuncAnimation, frames_per_second: int) -> bytes:
    """The film as a file's content, by way of a temporary file: matplotlib writes films to paths only."""
    try:
        with tempfile.TemporaryDirectory(prefix="rotorjax-") as folder:
            made = Path(folder) / "film.gif"
            film.save(made, writer=PillowWriter(fps=frames_per_second))
            return made.read_bytes()
    except OSError as error:
        raise InputError(
            f"{tempfile.gettempdir()}: the folder for temporary files must take a film, but does not: {error.strerror}"
        ) from None
