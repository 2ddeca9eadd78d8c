"""A free wake as a scene to turn: blades, near wake, vortices, streamlines of the mean flow, the ground."""

import numpy as np
from jaxtyping import Float

from rotorjax.bench.mean_flow import streamlines
from rotorjax.io.scene import Layer, Scene
from rotorjax.wake.seen import Seen, seen_around
from rotorjax.wake.solution import Solution


def solved_scene(found: Solution, streams: bool = True) -> Scene:
    """The scene of a periodic wake: an axisymmetric one turns as it is, another has a frame for each azimuth.

    streams: with streamlines of the mean flow, which take some seconds.
    """
    model = found.model
    frames = seen_around(model, found.state)
    count = len(frames.bound)
    psi = 360 / count * np.arange(count)
    where = "out of ground effect" if model.ground is None else f"h = {float(model.ground.height):g} R"
    slope = 0.0 if model.ground is None else float(np.rad2deg(model.ground.slope))
    return Scene(
        title=f"{model.rotor.name}, {where}" + (f", slope {slope:g}°" if slope else ""),
        layers=(
            *layers(frames, np.rad2deg(np.asarray(model.settings.filament_ages))),
            *((Layer("streamlines", streamlines(found)[None], 0.004, shown=False),) if streams else ()),
        ),
        facts=_facts(found),
        times=tuple(f"ψ = {p:.0f}°" for p in psi),
        height=None if model.ground is None else float(model.ground.height),
        slope_deg=slope,
        spin=count == 1,
    )


def layers(frames: Seen, ages_deg: Float[np.ndarray, " A"]) -> tuple[Layer, ...]:
    """What is drawn of wakes with leading axes (frames T, blades B)."""
    strands, lattice, circulation = (np.asarray(v) for v in (frames.filaments, frames.lattice, frames.circulation))
    count = strands.shape[:3]
    shape = (len(strands), -1, strands.shape[3])
    age = np.broadcast_to(ages_deg, strands.shape[:-1])
    tip = np.broadcast_to(np.arange(count[2]) == 0, count)

    def chosen(values: np.ndarray, of: np.ndarray) -> np.ndarray:
        return values[of].reshape(*shape, *values.shape[4:])

    def filaments(name: str, of: np.ndarray, width: float) -> Layer:
        values = {"age, deg": chosen(age, of), "circulation over ΩR²": chosen(circulation, of)}
        return Layer(name, chosen(strands, of), width, values)

    lattice = lattice.reshape(len(strands), -1, *lattice.shape[3:])
    blades = np.stack([np.asarray(frames.leading), np.asarray(frames.trailing)], axis=2)
    found = [
        Layer("blades", blades, surface=True),
        Layer("near wake", lattice, 0.0015),
        filaments("tip vortices", tip, 0.010),
    ]
    return (*found, filaments("inboard filaments", ~tip, 0.004)) if count[2] > 1 else tuple(found)


def _facts(found: Solution) -> dict[str, str]:
    numbers = {
        "collective": f"{np.rad2deg(float(found.model.operating.collective)):.1f}°",
        "C_T": f"{found.CT:.5f}",
        "mean inflow": f"{found.mean_inflow:.4f} ΩR",
    }
    if np.isfinite(found.CP):
        numbers["C_P"] = f"{found.CP:.6f}"
    return numbers | {"wake": "converged" if found.converged else f"NOT CONVERGED: {found.why}"}
