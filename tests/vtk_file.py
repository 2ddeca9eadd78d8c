"""A reader for legacy VTK polydata in plain text, as the format's description has it."""

import numpy as np


def read_polydata(path):
    """Points (N, 3), lines, polygons (lists of index arrays), data (name to array)."""
    head, _, rest = path.read_text().partition("DATASET POLYDATA\n")
    assert head.splitlines()[0].startswith("# vtk DataFile Version")
    assert head.splitlines()[2] == "ASCII"
    words = iter(rest.split())
    points, cells, data = np.zeros((0, 3)), {"LINES": [], "POLYGONS": []}, {}

    def numbers(count):
        return np.array([float(next(words)) for _ in range(count)])

    for word in words:
        if word == "POINTS":
            count, _ = int(next(words)), next(words)
            points = numbers(3 * count).reshape(-1, 3)
        elif word in cells:
            count, size = int(next(words)), int(next(words))
            cells[word] = [numbers(int(next(words))).astype(int) for _ in range(count)]
            assert sum(len(c) + 1 for c in cells[word]) == size
        elif word == "POINT_DATA":
            assert int(next(words)) == len(points)
        else:
            assert word == "SCALARS"
            name = next(words)
            assert [next(words) for _ in range(4)] == ["double", "1", "LOOKUP_TABLE", "default"]
            data[name] = numbers(len(points))
    return points, cells["LINES"], cells["POLYGONS"], data
