"""VTK files say what they were given, to nine digits."""

import json

import meshio
import numpy as np
import pytest
from vtk_file import read_polydata

from rotorjax.errors import InputError
from rotorjax.io.vtk import write_polydata, write_series


def test_round_trip(tmp_path):
    points = np.random.default_rng(0).normal(size=(7, 3))
    lines, polygons, data = [[0, 1, 2], [3, 4]], [[2, 3, 5, 6]], {"core": np.arange(7) / 3}
    write_polydata(tmp_path / "a.vtk", points, lines, polygons, data)
    found = read_polydata(tmp_path / "a.vtk")
    np.testing.assert_allclose(found[0], points, rtol=1e-8)
    assert [list(c) for c in found[1]] == lines
    assert [list(c) for c in found[2]] == polygons
    np.testing.assert_allclose(found[3]["core"], data["core"], rtol=1e-8)


def test_meshio_reads_what_is_cut_into_segments(tmp_path):
    points = np.random.default_rng(0).normal(size=(7, 3))
    data = {"age_deg": np.arange(7) / 3, "core": np.ones(7)}
    write_polydata(tmp_path / "a.vtu", points, [[0, 1, 2], [3, 4]], [[2, 3, 5, 6], [0, 4, 5]], data)
    found = meshio.read(tmp_path / "a.vtu")
    np.testing.assert_allclose(found.points, points, rtol=1e-8)
    assert found.cells_dict["line"].tolist() == [[0, 1], [1, 2], [3, 4]]
    assert found.cells_dict["quad"].tolist() == [[2, 3, 5, 6]]
    assert found.cells_dict["triangle"].tolist() == [[0, 4, 5]]
    np.testing.assert_allclose(found.point_data["age_deg"].ravel(), data["age_deg"], rtol=1e-8)


def test_an_ending_that_readers_take_for_another_format_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"must end in \.vtk .* or \.vtu .*, but is '.*wake\.vtp'"):
        write_polydata(tmp_path / "wake.vtp", np.zeros((4, 3)), [], [], {})


def test_data_that_does_not_fit_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"one number a point \(4\).*'core' holds 3"):
        write_polydata(tmp_path / "a.vtk", np.zeros((4, 3)), [], [], {"core": np.zeros(3)})
    assert not list(tmp_path.iterdir())


def test_series_gives_each_file_its_time(tmp_path):
    write_series(tmp_path / "a.vtk.series", ["a.vtk", "b.vtk"], [0.0, 0.5])
    told = json.loads((tmp_path / "a.vtk.series").read_text())
    assert told["files"][1] == {"name": "b.vtk", "time": 0.5}
