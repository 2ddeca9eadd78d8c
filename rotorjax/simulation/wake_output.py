"""The free wake of a flight as labelled arrays and as files for ParaView."""

from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Float

from rotorjax.bench.wake_scene import layers
from rotorjax.coupled import CoupledState, blades_at
from rotorjax.coupled_wake import CoupledWake, model_of
from rotorjax.io import vtk
from rotorjax.io.atomic import make_folder
from rotorjax.io.scene import Scene
from rotorjax.rotor.hub import RotorInputs
from rotorjax.simulation.run import SAVES, Simulated
from rotorjax.wake.above import above_ground
from rotorjax.wake.seen import Seen, seen_slice

KINDS = {"blade": 0, "tip vortex": 1, "inboard filament": 2}
"""Numbers of `kind` in the VTK files."""
MOST_SEEN, STILL = 48, 0.01  # frames of a page; R that the ground may move there


def seen(x: CoupledState, u: RotorInputs, p: CoupledWake) -> Seen:
    """Look at the wakes of all blades of a state."""
    blades = blades_at(x, u, p)
    model = model_of(u, blades, p)
    wake = above_ground(model, x.inflow, blades.psi[0])
    rows = (jnp.arange(p.rotor.blades), wake, blades.psi, blades.theta)
    return jax.vmap(lambda k, now, psi, theta: seen_slice(model.of_slice(k), now, psi, theta))(*rows)


@eqx.filter_jit
def _all_seen(x: CoupledState, u: RotorInputs, p: CoupledWake) -> Seen:
    return jax.lax.map(lambda row: seen(row[0], row[1], p), (x, u))


def wake_arrays(found: Simulated, at: np.ndarray) -> dict[str, xr.DataArray]:
    """The wake at the saves `at` along the coordinate `frame`, and how much it changes over all of them."""
    p = found.start.p
    assert isinstance(p, CoupledWake)
    x, u = jax.tree.map(lambda v: v[at], (found.flown.x, found.flown.u))
    looks = _all_seen(x, u, p)
    settings = p.settings
    degrees = {"units": "deg"}
    coords = {
        "frame": at,
        "filament": ["tip vortex", *(f"inboard {r:g} R" for r in settings.inboard)],
        "age": ("age", np.rad2deg(settings.filament_ages), degrees),
        "near_age": ("near_age", np.rad2deg(settings.age_step) * np.arange(settings.near_ages + 1), degrees),
        "axis": ["aft", "starboard", "up"],
    }
    dims = {
        "filaments": ("frame", "blade", "filament", "age", "axis"),
        "circulation": ("frame", "blade", "filament", "age"),
        "core": ("frame", "blade", "filament", "segment"),
        "lattice": ("frame", "blade", "edge", "near_age", "axis"),
        "leading": ("frame", "blade", "edge", "axis"),
        "trailing": ("frame", "blade", "edge", "axis"),
        "bound": ("frame", "blade", "section"),
    }
    arrays = {}
    for name, axes in dims.items():
        own = {k: v for k, v in coords.items() if k in axes}
        unit = "over ΩR²" if name in ("circulation", "bound") else "over R"
        arrays[f"wake_{name}"] = xr.DataArray(
            np.asarray(getattr(looks, name)), own, axes, attrs={"long_name": f"{name} {unit}"}
        )
    told = {"long_name": "rms distance over R of the nodes from where they were a revolution before"}
    moved = change(found.flown.x)
    moved[-1] = np.nan if found.finished else moved[-1]  # the end comes less than a twelfth of a turn after the rest
    return arrays | {"wake_change": xr.DataArray(moved, dims=("time",), attrs=told)}


def change(x: CoupledState) -> Float[np.ndarray, " T"]:
    """Rms distance over R of all nodes from where they were SAVES instants before, seen from their own blades.

    x: states with a leading axis T. NaN in the first revolution. In a steady flight it says how far the march has left
    the periodic wake.
    """
    nodes = np.concatenate([np.asarray(v).reshape(v.shape[0], -1, 3) for v in (x.inflow.near, x.inflow.far)], axis=1)
    found = np.full(len(nodes), np.nan)
    found[SAVES:] = np.sqrt(np.mean(np.sum((nodes[SAVES:] - nodes[:-SAVES]) ** 2, axis=2), axis=1))
    return found


def wake_scene(data: xr.Dataset) -> Scene:
    """The flight's wake to turn and play; at most MOST_SEEN of its frames, ground as far as it stays where it is."""
    one = data.isel(frame=slice(None, None, -(-data.sizes["frame"] // MOST_SEEN)))
    frames = Seen(**{name: jnp.asarray(one[f"wake_{name}"].to_numpy()) for name in Seen._fields})
    times = one["time"].to_numpy()[one["frame"].to_numpy()]
    height = one["height"].to_numpy() if "height" in one else np.array([np.nan])
    still = bool(np.all(np.isfinite(height))) and float(np.ptp(height)) < STILL
    facts = {"flight": f"{times[0]:.2f} to {times[-1]:.2f} s"}
    if "height" in one and not still:
        facts["ground"] = "moves, not drawn"
    return Scene(
        title=f"{data.attrs['rotor']} in flight",
        layers=layers(frames, one["age"].to_numpy()),
        facts=facts,
        times=tuple(f"{t:.3f} s" for t in times),
        height=float(height.mean()) if still else None,
        slope_deg=float(data.attrs.get("slope_deg", 0.0) or 0.0),
    )


def write_vtk(folder: str | Path, data: xr.Dataset) -> list[Path]:
    """Write wake_NNNN.vtk for each frame and wake.vtk.series with their times, to be opened in ParaView.

    Raises InputError where the folder cannot be written.
    """
    folder = make_folder(folder)
    paths = [folder / f"wake_{k:04d}.vtk" for k in range(data.sizes["frame"])]
    for k, path in enumerate(paths):
        vtk.write_polydata(path, *pieces(data.isel(frame=k)))
    vtk.write_series(folder / "wake.vtk.series", [path.name for path in paths], data["time"].values[data["frame"]])
    return paths


def pieces(one: xr.Dataset) -> tuple[np.ndarray, list[list[int]], list[list[int]], dict[str, np.ndarray]]:
    """Points, lines, polygons and data of one frame: filaments as lines, blades as surfaces of one panel's width."""
    strands = one["wake_filaments"].values
    blades, filaments, ages, _ = strands.shape
    count = blades * filaments * ages
    lines = np.arange(count).reshape(-1, ages)
    core = one["wake_core"].values
    core = np.concatenate([core[..., :1], 0.5 * (core[..., 1:] + core[..., :-1]), core[..., -1:]], axis=-1)
    skin = np.stack([one["wake_leading"].values, one["wake_trailing"].values], axis=2)
    corner = count + np.arange(skin[..., 0].size).reshape(skin.shape[:3])
    quads = np.stack([corner[:, :-1, 0], corner[:, 1:, 0], corner[:, 1:, 1], corner[:, :-1, 1]], axis=-1)
    bound = np.pad(one["wake_bound"].values, ((0, 0), (1, 1)))
    bound = np.repeat(0.5 * (bound[:, 1:] + bound[:, :-1])[..., None], 2, axis=-1)
    kind = np.where(np.arange(filaments) == 0, KINDS["tip vortex"], KINDS["inboard filament"])[:, None]
    own = np.arange(blades)[:, None, None]

    def joined(of_strands, of_skin) -> np.ndarray:
        parts = (np.broadcast_to(of_strands, strands.shape[:3]), np.broadcast_to(of_skin, skin.shape[:3]))
        return np.concatenate([part.ravel() for part in parts]).astype(float)

    data = {
        "circulation": joined(one["wake_circulation"].values, bound),
        "core": joined(core, 0.0),
        "kind": joined(kind, KINDS["blade"]),
        "blade": joined(own, own),
    }
    points = np.concatenate([strands.reshape(-1, 3), skin.reshape(-1, 3)])
    return points, lines.tolist(), quads.reshape(-1, 4).tolist(), data
