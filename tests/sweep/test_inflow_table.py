"""Inflow tables: exact at their nodes, smooth between, refused outside; read back by us and by C."""

import shutil
import subprocess
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr

import rotorjax as rj
from rotorjax.errors import InputError
from rotorjax.sweep.inflow_table import COLUMNS, tabulated, write_table

H, MU = np.array([0.6, 0.8, 1.0, 1.5, 2.0]), np.array([0.0, 0.1, 0.25])


def cubic(h, mu):
    """Cubic in the height, quadratic in the speed: what not-a-knot splines hold exactly."""
    return 0.05 + 0.01 * h - 0.02 * h**2 + 0.004 * h**3 * (1 - mu) + 0.3 * mu**2


@pytest.fixture
def data():
    h, mu = np.meshgrid(H, MU, indexing="ij")
    columns = {name: (["height", "advance_ratio"], (k + 1) * cubic(h, mu)) for k, name in enumerate(COLUMNS.values())}
    found = xr.Dataset(columns, attrs={"design": "grid", "title": "made up"})
    about = {"units": "1", "long_name": "over ΩR"}
    found = found.assign_coords(height=("height", H, about), advance_ratio=("advance_ratio", MU, about))
    return found.assign(verdict=(("height", "advance_ratio"), np.full(h.shape, "converged", object)))


def test_a_written_table_comes_back_exact_at_its_nodes(data, tmp_path):
    write_table(tmp_path / "t.txt", data)
    found = rj.inflow_table(tmp_path / "t.txt")
    assert found.names == ("height", "advance_ratio")
    assert (tmp_path / "t.txt").read_bytes().isascii()
    for i, h in enumerate(H):
        for j, mu in enumerate(MU):
            at = found(height=h, advance_ratio=mu)
            for name, there in COLUMNS.items():
                np.testing.assert_allclose(getattr(at, name), data[there][i, j], rtol=1e-14)


def test_it_is_smooth_between_them_with_the_derivatives_of_what_it_holds(data):
    found = tabulated(data)

    def inflow(place):
        return found(height=place[0], advance_ratio=place[1]).lambda_0

    places = jnp.array([[0.7, 0.05], [0.8, 0.1], [1.3, 0.2], [1.99, 0.24]])  # a node among them
    np.testing.assert_allclose(jax.vmap(inflow)(places), jax.vmap(lambda p: cubic(*p))(places), rtol=1e-12)
    for of in (jax.jacfwd, jax.jacrev):
        slopes = jax.jit(jax.vmap(of(inflow)))(places)
        np.testing.assert_allclose(slopes, jax.vmap(jax.jacfwd(lambda p: cubic(*p)))(places), rtol=1e-9)
    step = 1e-5
    near = (inflow(jnp.array([0.7 + step, 0.05])) - inflow(jnp.array([0.7 - step, 0.05]))) / (2 * step)
    assert float(jax.grad(inflow)(places[0])[0]) == pytest.approx(float(near), rel=1e-8)
    curved = data.assign(CT=data["CT"] + np.sin(9 * data["height"]))  # no cubic: across a knot only up to curvature
    thrust = jax.jacfwd(jax.jacfwd(lambda h: tabulated(curved)(height=h, advance_ratio=0.05).CT))
    assert float(thrust(1.0 - 1e-9)) == pytest.approx(float(thrust(1.0 + 1e-9)), rel=1e-5)


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ({"height": 0.5, "advance_ratio": 0.1}, r"height` must lie in the table, \[0.6, 2\], but is 0.5"),
        ({"height": float("nan"), "advance_ratio": 0.1}, "height"),
        ({"height": 1.0}, "advance_ratio` must be given"),
        ({"heigth": 1.0, "advance_ratio": 0.1}, "did you mean 'height'"),
    ],
)
def test_what_is_outside_is_refused(data, place, words):
    with pytest.raises(InputError, match=words):
        tabulated(data)(**place)
    if place == {"height": 0.5, "advance_ratio": 0.1}:
        with pytest.raises(Exception, match="must lie in the table"):
            jax.jit(lambda h: tabulated(data)(height=h, advance_ratio=0.1).CT)(0.5)


def test_points_that_did_not_converge_make_no_table(data, tmp_path):
    data["verdict"][1, 1] = "stalled (loads within 1e-3: made up)"
    with pytest.raises(InputError, match="1 of 15 did not"):
        write_table(tmp_path / "t.txt", data)
    with pytest.raises(InputError, match="two or more finite values, but height holds"):
        tabulated(data.assign_coords(height=[0.6, 0.8, 1.0, 1.5, np.inf]))


@pytest.mark.parametrize(
    "cut", ["", "rotorjax-inflow-table 2", "rotorjax-inflow-table 1 axes x", "short", "nan", "swap"]
)
def test_a_damaged_file_is_one_line(data, tmp_path, cut):
    path = tmp_path / "t.txt"
    write_table(path, data)
    text = path.read_text()
    changed = {
        "short": text[: len(text) // 2],
        "nan": text.rstrip()[:-5] + " nan\n",
        "swap": text.replace("0.8", "0.5", 1),
    }
    path.write_text(changed.get(cut, cut))
    with pytest.raises(InputError, match=r"t\.txt: the file must be a whole inflow table") as caught:
        rj.inflow_table(path)
    assert "\n" not in str(caught.value)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_c_reads_it_as_the_page_shows(data, tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "sweep.md").read_text()
    (tmp_path / "read.c").write_text(page.split("```c\n")[1].split("```")[0])
    write_table(tmp_path / "t.txt", data)
    subprocess.run(["cc", "-o", "read", "read.c"], cwd=tmp_path, check=True)
    told = subprocess.run(["./read", "t.txt"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout.split()
    assert int(told[0]) == 15
    np.testing.assert_allclose(float(told[1]), float(data["CT"][-1, -1]), rtol=1e-15)
