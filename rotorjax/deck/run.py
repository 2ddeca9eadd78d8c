"""A rotor over a ship's deck: from a case to its time histories, labelled and with units."""

import time

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float

from rotorjax.deck.blades import SectionBlades, stations
from rotorjax.deck.case import DeckCase
from rotorjax.deck.march import History, simulate
from rotorjax.deck.over_ground import DeckControls, DiskState, Output, OverGround, controls, output, over_ground, trim
from rotorjax.deck.tip_path import tip_path
from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.potential.dynamics import hover_inputs
from rotorjax.potential.field import disk_functions
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.ground_table import disk_modes, ground_table
from rotorjax.potential.model import FiniteStateModel, finite_state_model, rotor_flow
from rotorjax.potential.moving_ground import GroundMotion, Variant, ground_states, residual
from rotorjax.potential.wake_transport import WakeTransport, wake_transport
from rotorjax.region import half_plane

SAVED_PER_TURN = 2
FRAMES = 60  # instants at which the field over the disk and the ground condition are kept
FLAPPING = {
    "0": "coning of the blades, up positive",
    "1c": "tilt of the tip-path plane, up aft",
    "1s": "tilt of the tip-path plane, up to starboard",
}
GRID_R, GRID_PSI = np.linspace(0.0, 0.97, 24), 2 * np.pi / 36 * np.arange(36)


def rotor_model(case: DeckCase) -> FiniteStateModel:
    """The finite states of a case: six harmonics of sources under an edge, the rotor's own otherwise."""
    if case.edge is None:
        terms = min(7, (14 - case.harmonics) // 2 + 1)  # enough to close a pitching deck to 3 %
        return finite_state_model(
            None, case.harmonics, case.radial_terms, case.harmonics, terms, quadrature=DiskQuadrature(20, 20)
        )
    azimuth = float(np.rad2deg(case.edge_azimuth))
    return finite_state_model(
        None,
        case.harmonics,
        case.radial_terms,
        ground_harmonics=6,
        ground_radial_terms=5,
        quadrature=DiskQuadrature(20, 28),
        region=half_plane(0.0, azimuth),
    )


def build(case: DeckCase, variant: Variant | None = None) -> tuple[OverGround, Float[np.ndarray, " T"], DeckControls]:
    """Tabulate the ground over the case's heights, slopes and edges; return model, instants (rad) and controls."""
    variant = case.variant if variant is None else variant
    rotor, psi = rotor_model(case), case.instants()
    motion = case.motion(psi)
    steepest = float(np.rad2deg(np.abs(motion["slope"]).max()))
    heights = (float(motion["height"].min()), float(motion["height"].max()))
    transport: WakeTransport | None = None
    if variant == "dynamic":
        transport = wake_transport(1.01 * (heights[1] + np.tan(np.deg2rad(steepest))), 8)
    edge = None if case.edge is None else (float(motion["edge"].min()), float(motion["edge"].max()))
    coarse = edge is not None
    table = ground_table(
        rotor,
        heights,
        (-steepest, steepest),
        edge,
        transport,
        nodes=(10, 3, 33) if coarse else (18, 5, 1),
        tolerance=1e-4 if coarse else 1e-6,
    )
    blades = SectionBlades(case.rotor, case.operating)
    at = stations(float(case.rotor.root_cutout), 8, max(6, 2 * case.harmonics + 2))
    flapping = None if case.rigid else tip_path(case.rotor, case.operating)
    model = over_ground(rotor, table, blades, variant, transport, at, flapping)
    ground = GroundMotion(*(jnp.asarray(motion[k]) for k in ("height", "slope", "height_rate", "slope_rate")))
    along = {name: jnp.asarray(motion[name]) for name in ("climb", "climb_rate", "edge", "collective")}
    return model, psi, controls(ground, rotor, **along)


def run_case(case: DeckCase) -> tuple[xr.Dataset, dict[str, float]]:
    """Simulate a case, and beside it the static ground effect at each instant; return histories and measured figures.

    Raises InputError where the collective gives no steady thrust at the start, or the march leaves finite numbers.
    """
    began = time.perf_counter()
    model, psi, given = build(case)
    every = max(1, case.steps_per_turn // SAVED_PER_TURN)
    count = (psi.size - 1) // every * every + 1
    psi, given = jnp.asarray(psi[:count]), jax.tree.map(lambda v: v[:count], given)
    first = jax.tree.map(lambda v: v[0], given)
    built = time.perf_counter() - began
    start = _trimmed(model, first, case)
    flown = model, start, psi, given, every
    march = simulate.lower(*flown).compile()
    began = time.perf_counter()
    history = jax.block_until_ready(march(*flown))
    marched = time.perf_counter() - began
    if not bool(jnp.all(jnp.isfinite(history.outputs.thrust))):
        raise InputError("Argument `steps_per_turn` must be larger: the march left finite numbers")
    kept = jax.tree.map(lambda v: v[::every], given)
    steady = _static(case, model, kept, start)
    data = _dataset(case, model, history, kept, steady)
    figures = {
        "build_s": built,
        "march_s": marched,
        "steps": count - 1,
        "step_us": 1e6 * marched / (count - 1),
        "simulated_s": float(psi[-1]) / case.omega,
        "ground_residual_max": float(data["ground_residual"].max()),
    }
    return data, figures


def _trimmed(model: OverGround, first: DeckControls, case: DeckCase) -> DiskState:
    still = eqx.tree_at(lambda c: (c.ground.height_rate, c.ground.slope_rate), first, (jnp.zeros(()),) * 2)
    try:
        state = trim(model, _without_climb(still))
    except RuntimeError:
        state = None
    if state is None or not float(state.a[model.rotor.modes.index(0, 1)]) > 0:
        degrees = float(np.rad2deg(case.collective[0]))
        raise InputError(f"Argument `collective_deg` must give a steady thrust at the start, but is {degrees:g}")
    return state


def _without_climb(now: DeckControls) -> DeckControls:
    return eqx.tree_at(lambda c: (c.climb, c.climb_rate), now, (jnp.zeros_like(now.climb),) * 2)


def _static(case: DeckCase, model: OverGround, kept: DeckControls, start: DiskState) -> Output:
    """What the rotor does in the steady state of each instant's geometry; start: the one at the first."""
    if model.transport is None:  # the same table
        still = over_ground(model.rotor, model.table, model.blades, "static", None, model.at, model.tip_path)
    else:
        still = build(case, "static")[0]

    @jax.jit
    def march(guess: Array) -> tuple:
        def one(a: Array, now: DeckControls) -> tuple[Array, Output]:
            state = trim(still, now, a)
            return state.a, output(jnp.zeros(()), state, now, still)

        return jax.lax.scan(one, guess, _without_climb(kept))

    return march(start.a)[1]


def _dataset(case: DeckCase, model: OverGround, history: History, kept: DeckControls, steady: Output) -> xr.Dataset:
    frames = np.unique(np.linspace(0, history.psi.size - 1, FRAMES).astype(int))
    x, y = GRID_R * np.cos(GRID_PSI)[:, None], GRID_R * np.sin(GRID_PSI)[:, None]
    rotor, out = model.rotor, history.outputs
    x, y = jnp.asarray(x), jnp.asarray(y)
    own, answer = rotor_flow(rotor, None, x, y), disk_functions(disk_modes(rotor), x, y)
    field = jnp.tensordot(history.states.a[frames], own, 1) - jnp.tensordot(out.ground[frames], answer, 1)
    left = _residuals(model, history, kept, frames)
    seconds = np.asarray(history.psi) / case.omega
    return xr.Dataset(
        {
            **_series(kept, out, steady, flapping=not case.rigid),
            "has_edge": float(case.edge is not None),
            "inflow": (("frame", "psi", "r"), np.asarray(field), {"units": "ΩR"}),
            "ground_residual": ("frame", np.asarray(left), {"units": "-", "long_name": "left on the deck, rms"}),
            "frame_time": ("frame", seconds[frames], {"units": "s"}),
            "states": (("time", "state"), np.asarray(history.states.a), {"units": "ΩR"}),
        },
        coords={"time": ("time", seconds, {"units": "s"}), "psi": GRID_PSI, "r": GRID_R},
        attrs={
            "rotor": case.rotor.name,
            "variant": case.variant,
            "collective_deg": float(np.rad2deg(case.collective[0])),
        },
    )


def _series(kept: DeckControls, out: Output, steady: Output, flapping: bool) -> dict[str, tuple]:
    """Variables of time: what was prescribed and what came of it, marched and steady at each instant."""
    now = ", steady at each instant"
    rows = [
        ("height", kept.ground.height, "R", "hub over deck"),
        ("slope", jnp.rad2deg(kept.ground.slope), "deg", "slope of the deck, rising aft"),
        ("edge", kept.edge, "R", "edge of the deck, positive aft of the hub"),
        ("climb", kept.climb, "ΩR", "climb of the hub"),
        ("collective", jnp.rad2deg(kept.collective), "deg", "collective pitch"),
        ("uniform", out.uniform, "ΩR", "mean inflow"),
        ("cosine", out.cosine, "ΩR", "fore-and-aft inflow, positive aft"),
        ("sine", out.sine, "ΩR", "lateral inflow, positive to starboard"),
        ("thrust", out.thrust, "-", "thrust coefficient"),
        ("static_uniform", steady.uniform, "ΩR", "mean inflow" + now),
        ("static_cosine", steady.cosine, "ΩR", "fore-and-aft inflow" + now),
        ("static_thrust", steady.thrust, "-", "thrust coefficient" + now),
    ]
    for kind, values, more in (("", out, ""), ("static_", steady, now)) if flapping else ():
        angles = {n: jnp.rad2deg(getattr(values, f"beta_{n}")) for n in FLAPPING}
        rows += [(f"{kind}beta_{n}", angle, "deg", FLAPPING[n] + more) for n, angle in angles.items()]
    return {name: ("time", np.asarray(v), {"units": unit, "long_name": text}) for name, v, unit, text in rows}


def _residuals(model: OverGround, history: History, kept: DeckControls, frames: np.ndarray) -> Float[Array, " F"]:
    """What the untabulated sources leave on the deck, where some of it is under the disk."""

    @eqx.filter_jit
    def one(state, now: DeckControls) -> Array:
        rotor = model.rotor
        if rotor.region is not None:
            rotor = eqx.tree_at(lambda m: m.region.edge, rotor, now.edge)
        rotor = eqx.tree_at(lambda m: m.ground, rotor, Plane(now.ground.height, now.ground.slope), is_leaf=_none)
        inputs = eqx.tree_at(lambda i: (i.mu, i.climb), hover_inputs(now.tau), (now.mu, now.climb))
        settings = (now.ground, inputs, rotor, model.variant, model.transport, state.wake)
        left = residual(ground_states(state.a, *settings), state.a, *settings)
        return jnp.where(now.edge < -0.5, jnp.nan, left) if rotor.region is not None else left

    states, given = jax.tree.map(lambda v: v[frames], (history.states, kept))
    return jax.lax.map(lambda pair: one(*pair), (states, given))


def _none(value: object) -> bool:
    return value is None
