"""Edge of the ground under the free wake: `python benchmarks/partial_ground.py [--height 1] [--quick] [--out DIR]`.

Takes the periodic wake over level ground as it is, frozen, and asks what a part of that ground does to the disk: images
cut off at the edge, or sources on the region (`rotorjax.wake.partial_ground`). Prints what each leaves of the flow
through the region, the ground's mean upflow on the disk as the edge moves, and the finite-state model's beside it.
"""

import argparse
import time
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.bench import plotting
from rotorjax.frames import disk_points
from rotorjax.ground import Plane, plane
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.model import finite_state_model, mean_inflow, steady_state
from rotorjax.region import half_plane
from rotorjax.validation.point import Point
from rotorjax.wake.biot_savart import segment_velocity
from rotorjax.wake.partial_ground import PartialGround, all_segments, ground_velocity, partial_ground
from rotorjax.wake.segments import Segments
from rotorjax.wake.solution import solve

EDGES = np.linspace(-2.5, 2.5, 21)
R, PSI = np.sqrt((np.arange(6) + 0.5) / 6), 2 * np.pi / 16 * np.arange(16)
DISK = disk_points(*(jnp.asarray(v.ravel()) for v in np.meshgrid(R, PSI, indexing="ij")))  # equal areas
CHECK = np.stack(np.meshgrid(np.linspace(-2, 2, 41), np.linspace(-2, 2, 41), indexing="ij"), axis=-1).reshape(-1, 2)


def over(at: Plane, edge: float, nodes: int = 60) -> PartialGround:
    return partial_ground(at, half_plane(edge), nodes)


def clipped(segments: Segments, ground: PartialGround) -> Segments:
    """Strengths times the mask at the feet of the segments' middles."""
    middle = 0.5 * (segments.start + segments.end)
    foot = middle - ground.plane.distance(middle)[:, None] * ground.plane.normal
    return segments._replace(strength=segments.strength * ground.mask(foot))


@eqx.filter_jit
def cut_off(points: jax.Array, segments: Segments, ground: PartialGround) -> jax.Array:
    """Velocity of the images that are cut off at the edge."""
    mirror = segment_velocity(ground.plane.reflect_points(points), *clipped(segments, ground))
    return ground.plane.reflect_vectors(mirror)


@eqx.filter_jit
def left_by_images(segments: Segments, ground: PartialGround) -> jax.Array:
    """Flow through the region that cut-off images leave, rms over the wake's own there, within 2 R of the shaft."""
    at = jnp.concatenate([jnp.asarray(CHECK), jnp.full((len(CHECK), 1), -1.0) * ground.plane.height], axis=1)
    own, images = (segment_velocity(at, *part)[:, 2] for part in (segments, clipped(segments, ground)))
    solid = ground.mask(at)
    return jnp.sqrt(jnp.sum(solid * (own - images) ** 2) / jnp.sum(solid * own**2))


velocity = eqx.filter_jit(ground_velocity)


def finite_state(height: float) -> np.ndarray:
    """Share of the whole ground's upflow that the finite-state model has at each edge."""
    settings = {"ground_harmonics": 6, "ground_radial_terms": 5, "ground_parity": "odd", "harmonics": 1}
    model = finite_state_model(
        plane(height), quadrature=DiskQuadrature(24, 32), region=half_plane(0.0), ground_radius=2.0, **settings
    )
    tau = jnp.zeros(len(model.modes)).at[:3].set(jnp.array([np.sqrt(3) / 4 * 0.006, 5e-4, 2e-4]))

    @eqx.filter_jit
    def one(place: jax.Array) -> jax.Array:
        chosen = eqx.tree_at(lambda m: m.region.edge, model, place)
        return mean_inflow(steady_state(chosen, tau), chosen)

    mean = np.array([one(jnp.asarray(e)) for e in (-60.0, *EDGES, 60.0)])
    return (mean[0] - mean[1:-1]) / (mean[0] - mean[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--height", type=float, default=1.0, help="hub over ground, over R")
    parser.add_argument("--quick", action="store_true", help="coarser free wake")
    parser.add_argument("--out", type=Path, help="folder for the figure")
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    solution = solve(Point("uh60", 18.0, options.height).model(options.quick))
    print(f"UH-60, h = {options.height:g}: C_T {solution.CT:.5f}, residual {solution.residual:.1e}, {solution.why}")
    at = plane(options.height)
    states = jax.tree.map(jnp.asarray, solution.state)
    instants = [all_segments(solution.model, states, psi) for psi in (0.0, np.pi / 4)]
    whole = np.array([velocity(DISK, s, over(at, 60.0)) for s in instants])
    size = np.sqrt(np.mean(whole**2))
    shares = []
    print(
        "edge | images cut off: left on the region, upflow | sources: upflow over the whole ground's | c = 0 against 1"
    )
    for edge in EDGES:
        ground = over(at, edge)
        images, sources = (np.array([f(DISK, s, ground) for s in instants]) for f in (cut_off, velocity))
        ends = [np.array(velocity(DISK, instants[0], ground, jnp.asarray(c))) for c in (0.0, 1.0)]
        left = float(left_by_images(instants[0], ground))
        both = [float(v[..., 2].mean() / whole[..., 2].mean()) for v in (images, sources)]
        apart = np.sqrt(np.mean((images - sources) ** 2, axis=(0, 1))) / size
        shares.append([left, *both])
        print(
            f"{edge:5.2f} | {left:6.3f} {both[0]:7.4f}, off by {np.round(apart, 3)} (x, y, z) | {both[1]:7.4f} | "
            f"{np.abs(ends[0] - ends[1]).max() / size:.1e}"
        )
    shares = np.array(shares)
    print(f"monotone: {bool(np.all(np.diff(shares[:, 2]) > 0))}")
    print(f"largest difference over the limits: {shares[0, 2]:.2e} and {shares[-1, 2] - 1:.2e}")
    began, ground = time.perf_counter(), over(at, 0.3)
    jax.block_until_ready(velocity(DISK, instants[0], ground))
    print(f"one evaluation at {len(DISK)} points: {time.perf_counter() - began:.2f} s, "
          f"{len(ground.grid()[1])} sources, {len(instants[0].strength)} segments")  # fmt: skip
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        with plotting.style():
            figure = plotting.new_figure(9, 3.4)
            first, second = figure.subplots(1, 2)
            first.plot(EDGES, shares[:, 2], "o-", color=plotting.FREE_WAKE, label="free wake, sources on the region")
            first.plot(EDGES, shares[:, 1], ":", color=plotting.FREE_WAKE, label="free wake, images cut off")
            first.plot(EDGES, finite_state(options.height), color=plotting.VPBFSM, label="finite states")
            first.set(xlabel="edge aft of the hub, x/R", ylabel="upflow over that of the whole ground")
            first.legend(loc="lower right")
            second.plot(EDGES, shares[:, 0], ":", color=plotting.FREE_WAKE)
            second.set(xlabel="edge aft of the hub, x/R", ylabel="cut-off images: left on the region, rms")
        plotting.save(figure, options.out / "partial_ground", ("png",))


if __name__ == "__main__":
    main()
