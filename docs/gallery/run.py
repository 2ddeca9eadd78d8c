"""Draw the gallery: `python docs/gallery/run.py [NAME ...]` writes docs/gallery/NAME.webp, small enough to be kept."""

import io
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("JAX_ENABLE_X64", "1")
os.environ.setdefault("MPLBACKEND", "Agg")

HERE = Path(__file__).parent
WIDTH, MOST = 640, 60_000  # pixels, bytes


def scripts():
    """Paths of the scripts by name."""
    return {path.stem: path for path in sorted(HERE.glob("*.py")) if path.name != Path(__file__).name}


def figure_of(path):
    """The `figure` that a script leaves."""
    import matplotlib as mpl

    from rotorjax.bench.plotting import style

    found = {}
    with style(), mpl.rc_context({"figure.constrained_layout.use": True}):
        exec(compile(path.read_text(), str(path), "exec"), found)
        found["figure"].draw_without_rendering()
    return found["figure"]


def webp(figure):
    """The picture as WebP, as large as a thumbnail may be. Raises ValueError where it takes more than that."""
    from PIL import Image

    drawn, small = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", dpi=200)
    picture = Image.open(drawn).convert("RGB")
    picture.resize((WIDTH, round(picture.height * WIDTH / picture.width)), Image.Resampling.LANCZOS).save(
        small, "WEBP", quality=88
    )
    if small.tell() > MOST:
        raise ValueError(f"a picture of {small.tell()} bytes is no thumbnail")
    return small.getvalue()


def main(names):
    """Draw some, or all."""
    import matplotlib.pyplot as plt

    for name, path in scripts().items():
        if names and name not in names:
            continue
        begun = time.perf_counter()
        (HERE / f"{name}.webp").write_bytes(webp(figure_of(path)))
        plt.close("all")
        print(f"{name}: {time.perf_counter() - begun:.1f} s", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
