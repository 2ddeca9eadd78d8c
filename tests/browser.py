"""A page in a real browser: a picture of it, and what it complained of."""

import shutil
import subprocess

import pytest

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader"),
    *("--enable-unsafe-swiftshader", "--no-first-run", "--disable-background-networking", "--disable-sync"),
    *(
        "--disable-component-update",
        "--disable-quic",
        "--host-resolver-rules=MAP * ~NOTFOUND",
        "--enable-logging=stderr",
    ),
    *("--enable-logging=stderr", "--window-size=1000,700", "--virtual-time-budget=3000"),
)
needs_browser = pytest.mark.skipif(BROWSER is None, reason="no Chromium here")


def seen(page, tmp_path):
    """(picture as (H, W, 3) in 0 … 1, what the page wrote to the console) of a file."""
    import matplotlib.pyplot as plt

    picture = tmp_path / "seen.png"
    own = (f"--user-data-dir={tmp_path / 'profile'}", f"--screenshot={picture}", page.as_uri())
    ran = subprocess.run([BROWSER, *FLAGS, *own], capture_output=True, text=True, timeout=120, check=True)
    said = [line for line in ran.stderr.splitlines() if "CONSOLE" in line]
    return plt.imread(picture)[..., :3], [line for line in said if "GPU stall due to ReadPixels" not in line]


def opens(page, tmp_path):
    """Whether a report is drawn, its pictures inside, without a complaint; true where no browser is."""
    if BROWSER is None:
        return True
    picture, said = seen(page, tmp_path)
    inside = "data:image/" in page.read_text(encoding="utf-8")
    return inside and said == [] and picture.std() > 0.02
