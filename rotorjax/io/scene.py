"""Wakes to turn and zoom in a browser: one HTML file that needs no network, made of lines and surfaces that move."""

import base64
import html
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from rotorjax.errors import InputError
from rotorjax.io.atomic import write_text

TEMPLATE = Path(__file__).with_name("scene.html")


@dataclass(frozen=True)
class Layer:
    """Lines (F, L, N, 3) or, `surface`, strips between two edges (F, L, 2, N, 3) over F frames; one frame stands still.

    width: of lines, over R. values: a number a node (F, L, N), by what it is ("age, deg"). shown: at first.
    """

    name: str
    points: Float[np.ndarray, "F L ... N 3"]
    width: float = 0.008
    values: Mapping[str, Float[np.ndarray, "F L N"]] = field(default_factory=dict)
    surface: bool = False
    shown: bool = True


@dataclass(frozen=True)
class Scene:
    """What is seen, lengths over R in the hub frame (z up). facts: rows of a name and a value. times: of the frames, as
    text. height (over R), slope_deg: of the ground, rising along +x; height None: none. spin: one frame, turned about
    the shaft as time goes on.
    """

    title: str
    layers: Sequence[Layer]
    facts: Mapping[str, str]
    times: Sequence[str] = ("",)
    height: float | None = None
    slope_deg: float = 0.0
    spin: bool = False


def write_scene(path: str | Path, scene: Scene) -> None:
    """Write a scene as one HTML file that opens offline.

    Raises InputError where a layer's frames are neither one nor those of `times`, a number is not finite, or the file
    cannot be written.
    """
    content = {
        "title": scene.title,
        "facts": list(scene.facts.items()),
        "times": list(scene.times),
        "height": scene.height,
        "slope": float(np.deg2rad(scene.slope_deg)),
        "spin": scene.spin,
        "layers": [_layer(layer, len(scene.times)) for layer in scene.layers],
    }
    text = TEMPLATE.read_text(encoding="utf-8").replace("{{title}}", html.escape(scene.title))
    write_text(path, text.replace("{{scene}}", json.dumps(content, allow_nan=False).replace("</", "<\\/")))


def _layer(layer: Layer, frames: int) -> dict[str, Any]:
    for name, array in {"points": layer.points, **layer.values}.items():
        if array.shape[0] not in (1, frames):
            raise InputError(
                f"Argument `layers` must hold 1 or {frames} frames, but {name!r} of {layer.name!r} has {array.shape[0]}"
            )
        if not np.all(np.isfinite(array)):
            raise InputError(f"Argument `layers` must be finite, but {name!r} of {layer.name!r} is not")
    return {
        "name": layer.name,
        "shape": layer.points.shape[:-1],
        "points": _packed(layer.points),
        "width": layer.width,
        "values": {name: _packed(np.broadcast_to(v, v.shape)) for name, v in layer.values.items()},
        "surface": layer.surface,
        "shown": layer.shown,
    }


def _packed(array: np.ndarray) -> str:
    """Single-precision numbers, little endian, in base 64."""
    return base64.b64encode(np.ascontiguousarray(array, dtype="<f4").tobytes()).decode()
