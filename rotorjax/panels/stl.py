"""Surfaces from a mesh file: STL, binary or ASCII."""

import re
from collections import Counter
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rotorjax.errors import InputError
from rotorjax.panels.surface import Panels

FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
VERTEX = re.compile(rb"^\s*vertex\s+(\S+)\s+(\S+)\s+(\S+)\s*$", re.MULTILINE)


def read_stl(
    path: str | Path, scale: float = 1.0, place: tuple[float, float, float] = (0, 0, 0), *, open_: bool = False
):
    """Read a surface from an STL file, binary or ASCII: one panel a facet.

    scale: R a unit of the file (1/R for metres). place: where the file's origin lies from the hub, over R (x aft, y to
    starboard, z up). Corners must run counter-clockwise seen from the air; the file's own normals are not read. open_:
    whether the surface may have a rim, as a patch of terrain has, or a body that stands on the ground without a foot.

    Raises InputError, naming file and facet, where the file is cut short or no STL, a facet has no area, a closed
    surface has a hole, neighbours face opposite ways, or normals point inside.
    """
    path = Path(path)
    corners = _corners(path)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    flat = np.flatnonzero(~(area > 1e-12 * np.ptp(corners, axis=(0, 1)).max() ** 2))
    if flat.size:
        raise _wrong(path, flat[0], f"has no area: its corners are {corners[flat[0]].tolist()}", "remove it")
    _check_edges(path, corners, open_)
    volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    if not open_ and volume < 0:
        raise InputError(f"{path}: normals must point out into the air, but point inside: turn all facets round")
    placed = corners * scale + np.asarray(place, float)
    return Panels(jnp.asarray(placed[:, [0, 1, 2, 2]]))


def _corners(path: Path) -> Float[np.ndarray, "P 3 3"]:
    """Corners of all facets, in the file's units."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else -1
    if len(data) == 84 + 50 * count:
        corners = np.frombuffer(data, FACET, count, 84)["corners"].astype(float)
    elif data.lstrip()[:5].lower() == b"solid" and b"facet" in data:
        corners = _of_text(path, data)
    else:
        promised = (
            f"promises {count} facets in {84 + 50 * count} bytes, but holds {len(data)}" if count >= 0 else "is short"
        )
        raise InputError(
            f"{path}: must be an STL file, but begins with neither `solid` nor a full header: it {promised}"
        )
    if not len(corners):
        raise InputError(f"{path}: must hold facets, but has none")
    bad = np.flatnonzero(~np.all(np.isfinite(corners), axis=(1, 2)))
    if bad.size:
        raise _wrong(path, bad[0], f"is not finite: {corners[bad[0]].tolist()}", "export it again")
    return corners


def _of_text(path: Path, data: bytes) -> Float[np.ndarray, "P 3 3"]:
    """Corners of an ASCII file."""
    facets = len(re.findall(rb"^\s*facet\b", data, re.MULTILINE))
    found = VERTEX.findall(data)
    if len(found) != 3 * facets or data.lower().count(b"vertex") != 3 * facets:
        raise _wrong(path, len(found) // 3, "does not have three corners of three numbers each", "export it again")
    try:
        return np.array(found, dtype="S64").astype(float).reshape(-1, 3, 3)
    except ValueError:
        bad = next(i for i, row in enumerate(found) if not _are_numbers(row))
        word = b" ".join(found[bad]).decode(errors="replace")
        raise _wrong(path, bad // 3, f"has a corner that is no number: {word}", "export it again") from None


def _are_numbers(row: tuple[bytes, ...]) -> bool:
    try:
        return all(np.isfinite(float(v)) for v in row)
    except ValueError:
        return False


def _check_edges(path: Path, corners: Float[np.ndarray, "P 3 3"], open_: bool) -> None:
    """Raise InputError where two facets run along an edge the same way, or one alone does in a closed surface."""
    nearest = np.ptp(corners, axis=(0, 1)).max() * 1e-6
    number = np.unique(np.round(corners.reshape(-1, 3) / nearest), axis=0, return_inverse=True)[1].reshape(-1, 3)
    edges = [(int(row[i]), int(row[(i + 1) % 3])) for row in number for i in range(3)]
    runs = Counter(edges)
    for i, edge in enumerate(edges):
        if runs[edge] > 1:
            raise _wrong(path, i // 3, "faces the other way than its neighbour, or is there twice", "turn it round")
        if not open_ and edge[::-1] not in runs:
            raise _wrong(path, i // 3, "has an edge without a neighbour", "close the surface, or set open_ = True")


def _wrong(path: Path, facet: int, found: str, remedy: str) -> InputError:
    return InputError(f"{path}: facet {int(facet) + 1} {found}: {remedy}")
