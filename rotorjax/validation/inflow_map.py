"""Elliott and Althoff's rotor at advance ratio 0.15: inflow over the disk, measured and by each inflow model.

The rotor is trimmed to the measured thrust, without cyclic flapping about a shaft that stands as the measured tip-path
plane did. The laser measured one chord above that plane; models that know the flow there are read there.
"""

import csv
from collections.abc import Callable, Mapping
from importlib import resources
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from matplotlib.figure import Figure
from scipy.signal import resample

from rotorjax.bench.plotting import new_figure, polar_contour, shared_levels, style
from rotorjax.inflow.finite_state import FiniteStateInflow
from rotorjax.potential.model import velocity, with_ground
from rotorjax.rotor.geometry import chord
from rotorjax.trim import run as trimming
from rotorjax.trim.free_wake import InWake, flown
from rotorjax.trim.in_wake import TrimmedInWake
from rotorjax.trim.means import evaluated
from rotorjax.trim.problem import inputs_at
from rotorjax.trim.run import FREE_WAKE, INFLOWS, Request, Result
from rotorjax.validation.case import Comparison, Subject, ValidationCase, Wakes
from rotorjax.validation.point import Point
from rotorjax.validation.row import Against, Row, between, relative
from rotorjax.wake.field import velocity as wake_velocity

NAME = "inflow-map"
THRUST, ADVANCE, TILT_DEG = 0.0064, 0.15, 3.0
DRAWN_R = np.linspace(0.2, 1.0, 33)
SOURCE = "Elliott, Althoff & Sailey, NASA (1988)"
SCATTER = "standard deviation within a point about 0.009, of the mean of some thousand samples far less"
BETTER = Against(SOURCE, SCATTER, "a model of the inflow has to be better than the next simpler one")
FAITHFUL = 0.012
CLOSE = Against(SOURCE, SCATTER, "a free wake has to be clearly the best")
MEAN = Against(SOURCE, SCATTER, "what momentum theory leaves out of a rotor's mean inflow")

FINER, PARTS = 3, 4
"""Azimuths of a wake over those of its trim, and points for the arc between two of them."""

Map = Callable[[Float[np.ndarray, "N 2"]], Float[np.ndarray, " N"]]
"""λ over ΩR at places (r, ψ) of the disk."""


class Measured(NamedTuple):
    """The measured map. r over R, psi (rad), inflow λ over ΩR, positive down, scatter, area: weights, all (N,).

    Points beyond the tip have no area. psi runs from 0 up to but not 2π.
    """

    r: Float[np.ndarray, " N"]
    psi: Float[np.ndarray, " N"]
    inflow: Float[np.ndarray, " N"]
    scatter: Float[np.ndarray, " N"]
    area: Float[np.ndarray, " N"]


def measured() -> Measured:
    """The map that ships with the package."""
    text = (resources.files("rotorjax.reference") / "data" / "elliott_althoff_mu015.csv").read_text(encoding="utf-8")
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    columns = [np.array([float(row[k]) for row in rows]) for k in ("psi", "r/R", "Mean", "std")]
    once = columns[0] < 360  # 360° repeats 0°
    psi, r, downwash, scatter = (c[once] for c in columns)
    return Measured(r, np.deg2rad(psi), -downwash, scatter, area_weights(r, psi))


def area_weights(r: Float[np.ndarray, " N"], psi_deg: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """Share of the disk that each point stands for: half-way to its neighbours in radius and azimuth, to the tip."""
    rays = np.unique(psi_deg)
    spans = (np.diff(np.append(rays, rays[0] + 360)) + np.diff(np.append(rays[-1] - 360, rays))) / 2
    weights = np.zeros_like(r)
    for ray, span in zip(rays, spans, strict=True):
        on = np.flatnonzero((psi_deg == ray) & (r <= 1))
        edges = np.concatenate([[r[on][0]], (r[on][1:] + r[on][:-1]) / 2, [1.0]])
        weights[on] = span * np.diff(edges**2)
    return weights / weights.sum()


def rms(weights: Float[np.ndarray, " N"], values: Float[np.ndarray, " N"]) -> float:
    """Root of the weighted mean square."""
    return float(np.sqrt(weights @ values**2))


def request(inflow: str) -> Request:
    """The measured flight."""
    return trimming.request("elliott_althoff", THRUST, inflow, ADVANCE, tilt_deg=TILT_DEG)


def map_of(result: Result) -> Map:
    """Mean inflow of a trim, one chord above the disk where the model reaches there, else on it."""
    found = result.trimmed
    if isinstance(found, TrimmedInWake):
        return _wake_map(found)
    state = jax.tree.map(lambda v: jnp.mean(v, axis=0), found.z.inflow)
    inputs, p = inputs_at(found.z.controls, found.flight), found.p

    def at(places: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, " N"]:
        points = _cartesian(places)
        if isinstance(p.inflow, FiniteStateInflow):
            above = points.at[:, 2].set(chord(p.rotor, jnp.asarray(0.75)))
            flow = velocity(with_ground(state, p.inflow.model), above, p.inflow.model)
        else:
            flow = p.inflow.velocity(state, points, inputs)
        return -np.asarray(flow[:, 2])

    return at


def _wake_map(trimmed: TrimmedInWake) -> Map:
    """Mean over the azimuths of the free wake.

    Blades pass a chord below the points with upflow ahead of them and downflow behind. A few azimuths miss their
    balance where blades lag: the trim's harmonics are evaluated at more, and points stand for the arc between two.
    """
    z = _finer(trimmed.z)
    model, state = flown(z, trimmed.p), evaluated(z, trimmed.p)[0].state
    height = chord(model.rotor, jnp.asarray(0.75))
    turns = 2 * np.pi / z.flap.shape[0] * ((np.arange(PARTS) + 0.5) / PARTS - 0.5)

    def at(places: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, " N"]:
        arcs = places + np.stack([np.zeros(PARTS), turns], axis=-1)[:, None]
        flow = _wake_velocity(state, _cartesian(arcs.reshape(-1, 2)).at[:, 2].set(height), model)
        return -np.asarray(jnp.mean(flow[..., 2], axis=0)).reshape(PARTS, -1).mean(axis=0)

    return at


def _finer(z: InWake) -> InWake:
    """The same periodic motion at more azimuths."""

    def at_more(a):
        return jnp.asarray(resample(np.asarray(a), FINER * a.shape[0], axis=0))

    return InWake(jax.tree.map(at_more, z.wake), at_more(z.flap), at_more(z.lag), z.controls)


_wake_velocity = eqx.filter_jit(wake_velocity)


def points(subject: Subject) -> tuple[Point, ...]:
    """No free wake in hover is needed."""
    return ()


def compare(subject: Subject, wakes: Wakes) -> Comparison:
    """Trim with each inflow model, in a quick look without the free wake; rows and picture."""
    data = measured()
    names = [name for name in INFLOWS if name != FREE_WAKE or not subject.quick]
    trims = {name: trimming.run(request(name)) for name in names}
    maps = {name: map_of(result) for name, result in trims.items()}
    return Comparison(rows(data, trims, maps), lambda: draw(data, maps))


def rows(data: Measured, trims: Mapping[str, Result], maps: Mapping[str, Map]) -> list[Row]:
    """Rms over the disk, each below the next simpler model's, and the mean."""
    places = np.stack([data.r, data.psi], axis=1)
    found = []
    limits = {"uniform": rms(data.area, data.inflow)}  # no inflow at all
    for name, field in maps.items():
        told = trimming.numbers(trims[name])
        note = "" if told["converged"] else f"not converged: {told['why']}"
        ours = field(places)
        error = rms(data.area, ours - data.inflow) if told["converged"] else float("nan")
        below = FAITHFUL if name == FREE_WAKE else limits.get(name, limits["uniform"])
        quantity = f"rms of λ over the disk, {name} (θ₀ {told['collective_deg']:.2f}°, θ₁c {told['theta_1c_deg']:.2f}°"
        quantity += f", θ₁s {told['theta_1s_deg']:.2f}°)"
        found.append(Row(NAME, quantity, error, between(0.0, below), CLOSE if name == FREE_WAKE else BETTER, note))
        mean, wanted = float(data.area @ ours), float(data.area @ data.inflow)
        found.append(Row(NAME, f"mean λ over the measured points, {name}", mean, relative(0.15, wanted), MEAN, note))
        if name == "uniform":
            limits = {"uniform": error}
    return found


def draw(data: Measured, maps: Mapping[str, Map]) -> Figure:
    """Contours of the measurement and of each model, at the same places and levels."""
    rays = np.unique(data.psi)
    on_grid = {name: _on_rays(field, rays) for name, field in maps.items()}
    measured_grid = np.stack([np.interp(DRAWN_R, data.r[data.psi == p], data.inflow[data.psi == p]) for p in rays])
    fields = {"measured": measured_grid, **on_grid}
    levels = shared_levels(list(fields.values()))
    even = np.deg2rad(np.arange(0, 360, 30))
    with style():
        figure = new_figure(3.4 * len(fields), 4.2)
        axes = figure.subplots(1, len(fields), subplot_kw={"projection": "polar"})
        filled = []
        for ax, (name, field) in zip(axes, fields.items(), strict=True):
            filled.append(polar_contour(ax, DRAWN_R, even, _even(even, rays, field), levels, ("aft", "forward")))
            ax.set_title(name)
        figure.colorbar(filled[-1], ax=list(axes), label=r"$\lambda$, positive down", shrink=0.7, location="bottom")
    return figure


def _on_rays(field: Map, rays: np.ndarray) -> Float[np.ndarray, "K R"]:
    places = np.stack([np.tile(DRAWN_R, rays.size), np.repeat(rays, DRAWN_R.size)], axis=1)
    return field(places).reshape(rays.size, DRAWN_R.size)


def _even(even: np.ndarray, rays: np.ndarray, field: Float[np.ndarray, "K R"]) -> Float[np.ndarray, "E R"]:
    """Values on equally spaced azimuths, by straight lines between the rays that were measured."""
    closed = np.vstack([field, field[:1]])
    return np.stack([np.interp(even, np.append(rays, 2 * np.pi), column) for column in closed.T], axis=1)


def _cartesian(places: Float[np.ndarray, "N 2"]) -> Float[Array, "N 3"]:
    r, psi = jnp.asarray(places).T
    return jnp.stack([r * jnp.cos(psi), r * jnp.sin(psi), jnp.zeros_like(r)], axis=-1)


KNOWN = (
    "The collective's reference radius is not stated with the data: the reported 9.37° is neither the trimmed pitch at "
    "0.75 R nor that at the axis."
)
CASE = ValidationCase(NAME, "Elliott and Althoff's rotor at advance ratio 0.15", points, compare, KNOWN, length=5.0)
