"""Films: animated GIF files."""

import io
from collections.abc import Callable, Iterator
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image  # matplotlib's own

from rotorjax.bench import plotting
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
        first, *others = _pictures(figure, draw, frames)
    file = io.BytesIO()
    first.save(file, "GIF", save_all=True, append_images=others, duration=round(1000 / frames_per_second), loop=0)
    write_bytes(path, file.getvalue())


def _pictures(figure: Figure, draw: Callable[[int], None], frames: int) -> Iterator[Image.Image]:
    """Each frame, drawn once."""
    canvas = FigureCanvasAgg(figure)
    for frame in range(frames):
        draw(frame)
        canvas.draw()
        yield Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3])
