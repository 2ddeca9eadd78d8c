"""The rotor in its free wake in hover as a linear system, one azimuthal wave number at a time.

Over level ground or none nothing tells one azimuth from another: in multi-blade coordinates the model does not change
with time, and a disturbance that goes round as e^{ikψ} stays one. The collective coordinates, cosine and sine of each k
and the differential ones are systems of their own, of one blade's states each; with z = q_kc − i q_ks a pair of them is
one complex system. All follow from what moving one blade does to all of them: as many columns as a blade has states.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Complex, Float, Int

from rotorjax.coupled import stations
from rotorjax.errors import InputError
from rotorjax.linearisation import drive, readings, rotor
from rotorjax.linearisation.rotor import Base, SteadyState
from rotorjax.ode.models import LinearModel, Notes, Resolvent
from rotorjax.ode.orbit import require_converged
from rotorjax.rotor import multiblade
from rotorjax.wake.search import Progress

CHUNK = 32
"""Columns of a pass."""
NOTHING = 1e-9
"""Share of the largest entry of B below which it is rounding."""


@dataclass(frozen=True)
class Wave:
    """Disturbances of one wave number: z' = A z + B u and y = Re(C z), z real where its coordinate is one alone.

    a (n, n), b (n, m), c (q, n). coordinates: "0", or "1c" and "1s", or "D".
    """

    a: Complex[np.ndarray, "n n"]
    b: Complex[np.ndarray, "n m"]
    c: Complex[np.ndarray, "q n"]
    coordinates: tuple[str, ...]

    @property
    def real(self) -> bool:
        """Whether z is."""
        return len(self.coordinates) == 1

    @cached_property
    def resolvent(self) -> Resolvent:
        """(s − A)⁻¹, factorised once."""
        return Resolvent(self.a)

    def response(self, s: complex) -> Complex[np.ndarray, "q m"]:
        """Its part of the transfer matrix at s: half of C z and half of its conjugate, which is what z makes of s̄."""
        there = self.c @ self.resolvent.solve(s, self.b)
        if self.real:
            return there
        return 0.5 * (there + (self.c @ self.resolvent.solve(np.conj(s), self.b)).conj())

    def in_real(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A, B, C of the real coordinates: cosines first, then sines."""
        if self.real:
            return self.a, self.b, self.c
        (ar, ai), (br, bi), (cr, ci) = ((np.real(v), np.imag(v)) for v in (self.a, self.b, self.c))
        # q_c = Re z and q_s = −Im z
        return np.block([[ar, ai], [-ai, ar]]), np.concatenate([br, -bi]), np.concatenate([cr, ci], axis=1)


@dataclass(frozen=True)
class HoverModel:
    """The linear rotor in its free wake in hover. waves: by wave number. d (q, m). names, units: of a blade's states.

    u (m,), y (q,): trim. x (n, B): trim values of the states, by coordinate.
    """

    waves: tuple[Wave, ...]
    d: Float[np.ndarray, "q m"]
    names: tuple[str, ...]
    units: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    u: Float[np.ndarray, " m"]
    y: Float[np.ndarray, " q"]
    x: dict[str, Float[np.ndarray, " n"]]
    notes: Notes = field(default_factory=dict)

    @property
    def order(self) -> int:
        """States of all waves."""
        return sum(len(wave.coordinates) * len(self.names) for wave in self.waves)

    @property
    def reached(self) -> tuple[Wave, ...]:
        """Waves that some input moves, by more than rounding."""
        most = max(float(np.abs(wave.b).max()) for wave in self.waves)
        return tuple(wave for wave in self.waves if np.abs(wave.b).max() > NOTHING * most)

    def response(self, frequencies: Float[np.ndarray, " W"]) -> Complex[np.ndarray, "W q m"]:
        """Transfer matrix at angular frequencies (per radian of azimuth), as seen from the hub."""
        return np.array([sum(wave.response(1j * w) for wave in self.reached) + self.d for w in frequencies])

    def step(self, times: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N q m"]:
        """Outputs at equally spaced times from 0 after a unit step of each input, exact at those times."""
        return sum((_stepped(wave, times) for wave in self.reached), np.zeros((times.size, *self.d.shape))) + self.d

    def linear(self) -> LinearModel:
        """One real model of the waves that the inputs reach."""
        waves = self.reached
        coordinates = [coordinate for wave in waves for coordinate in wave.coordinates]
        names = tuple(name.format(c) for c in coordinates for name in self.names)
        return self.joined(
            waves, names, self.units * len(coordinates), np.concatenate([self.x[c] for c in coordinates])
        )

    def joined(
        self, waves: Sequence[Wave], states: tuple[str, ...], units: tuple[str, ...], x: Float[np.ndarray, " n"]
    ) -> LinearModel:
        """One real model of some waves, in the order of their coordinates. states, units, x: of all."""
        parts = [wave.in_real() for wave in waves]
        return LinearModel(
            a=np.asarray(scipy.linalg.block_diag(*(a for a, _, _ in parts))),
            b=np.concatenate([b for _, b, _ in parts]),
            c=np.concatenate([c for _, _, c in parts], axis=1),
            d=self.d,
            states=states,
            inputs=self.inputs,
            outputs=self.outputs,
            input_units=tuple(drive.UNITS[name] for name in self.inputs),
            output_units=tuple(map(readings.unit_of, self.outputs)),
            state_units=units,
            x=x,
            u=self.u,
            y=self.y,
            notes=self.notes,
        )


def _stepped(wave: Wave, times: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N q m"]:
    n, m = wave.b.shape
    leap = scipy.linalg.expm(np.block([[wave.a, wave.b], [np.zeros((m, n + m))]]) * (times[1] - times[0]))
    x, out = np.zeros((n, m)), []
    for _ in times:
        out.append(np.real(wave.c @ x))
        x = leap[:n, :n] @ x + leap[:n, n:]
    return np.array(out)


def hover_model(
    base: Base,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> HoverModel:
    """Linearise a hover in the free wake, all equations as they are marched.

    inputs, outputs: names, None for all but section loads. progress(stage, 0): called after each pass, with how far it
    is. Raises InputError where the trim has not converged or changes with the azimuth, a name is unknown, or there are
    fewer than three blades, whose cyclic motion does.
    """
    _check(base)
    inputs, outputs = rotor.chosen_names(base, inputs, outputs)
    x, blades = base.orbit.start, base.p.rotor.blades
    members = members_of(x, blades)
    first = np.zeros((members.shape[1], ravel_pytree(x)[0].size))
    first[np.arange(members.shape[1])[:, None], members.T] = np.asarray(multiblade.inverse(jnp.zeros(()), blades))[:, 0]
    value, columns, of_inputs, rows = _derivatives(base, first, inputs, outputs, progress)
    moved = np.moveaxis(columns[:, members], 0, -1)  # coordinate, state of a blade, state of the blade that moved
    driven, seen = np.moveaxis(of_inputs[:, members], 0, -1), np.moveaxis(rows[:, members], 1, 0)
    order = multiblade.names(blades)
    names, units = rotor.state_names(x, base.p)
    flat, n = np.asarray(ravel_pytree(x)[0]), members.size
    return HoverModel(
        waves=tuple(_wave(part, moved, driven, seen, order) for part in _parts(order)),
        d=of_inputs[:, n:].T,
        names=tuple(names[k].replace("_0", "_{}", 1) for k in members[0]),
        units=tuple(units[k] for k in members[0]),
        inputs=inputs,
        outputs=readings.expanded(outputs, stations(base.p).size),
        u=np.array([float(base.u[name]) for name in inputs]),
        y=value,
        x={name: flat[k] for name, k in zip(order, members, strict=True)},
        notes=rotor.notes(base),
    )


def _check(base: Base) -> None:
    require_converged(base.orbit)
    if not base.steady or float(base.u.get("pitch", 0.0)):
        raise InputError(
            "Argument `base` must be a hover, the shaft upright over level ground or none, but changes with the azimuth"
        )
    if base.p.rotor.blades < 3:
        raise InputError(
            "Argument `rotor` must have at least three blades, whose cyclic motion in the free wake looks the same "
            f"from every azimuth, but has {base.p.rotor.blades}: take an inflow model for two"
        )


def members_of(x: SteadyState, blades: int) -> Int[np.ndarray, "B n"]:
    """Where each multi-blade coordinate's states stand in `ravel_pytree` of the whole."""
    numbered = jax.tree.map(lambda v: np.zeros(v.shape) + np.arange(blades).reshape(-1, *[1] * (v.ndim - 1)), x)
    which = np.concatenate([leaf.ravel() for leaf in jax.tree.leaves(numbered)])
    return np.stack([np.flatnonzero(which == k) for k in range(blades)])


def _parts(order: tuple[str, ...]) -> list[tuple[int, ...]]:
    """Coordinates of each wave number."""
    pairs = [(k, k + 1) for k in range(1, len(order) - 1, 2)]
    lone = [(len(order) - 1,)] if order[-1] == "D" else []
    return [(0,), *pairs, *lone]


def _wave(part, moved, driven, seen, order: tuple[str, ...]) -> Wave:
    """One wave's system. moved (B, n, n): by moving blade 0; driven (B, n, m); seen (B, q, n), each by coordinate."""
    blades = len(order)
    turn = np.array([1.0]) if len(part) == 1 else np.array([1.0, -1j])
    share = blades if len(part) == 1 else blades / 2  # the motion of blade 0 alone has 1/B or 2/B of the coordinate
    a, b = (np.tensordot(turn, v[list(part)], axes=1) for v in (moved, driven))
    return Wave(share * a, b, np.tensordot(turn.conj(), seen[list(part)], axes=1), tuple(order[k] for k in part))


def _derivatives(
    base: Base, first: Float[np.ndarray, "n N"], inputs: tuple[str, ...], outputs: tuple[str, ...], progress
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Outputs (q,); rates (n, N) along given directions of the state; rates and outputs (m, N + q) by inputs; outputs'
    rows (q, N) by the state.
    """
    x = ravel_pytree(base.orbit.start)[0]
    z = jnp.concatenate([x, jnp.stack([base.u[name] for name in inputs])])
    function, start = Flat(base.orbit.start, inputs, outputs), base.orbit.t[0]
    along = np.zeros((len(first) + len(inputs), z.size))
    along[: len(first), : x.size], along[len(first) :, x.size :] = first, np.eye(len(inputs))
    found = products(function, z, start, base.u, base.p, along, progress)
    value, rows = pulled(function, z, start, base.u, base.p)
    return np.asarray(value), found[: len(first), : x.size], found[len(first) :], np.asarray(rows)[:, : x.size]


def products(
    function: "Flat", z: Array, psi: Array, u, p, along: Float[np.ndarray, "k N"], progress: Progress | None = None
) -> Float[np.ndarray, "k M"]:
    """Rates and outputs along directions, CHUNK at a time by one program, or as many as there are."""
    passes, width = [], min(CHUNK, len(along))
    for k in range(0, len(along), CHUNK):
        chunk = np.zeros((width, z.size))
        chunk[: len(along[k : k + CHUNK])] = along[k : k + CHUNK]
        passes.append(np.asarray(pushed(function, z, psi, u, p, jnp.asarray(chunk))))
        if progress is not None:
            progress(f"linearisation {min(k + CHUNK, len(along)) / len(along):.0%}", 0.0)
    return np.concatenate(passes)[: len(along)]


class Flat(eqx.Module):
    """State and chosen inputs to rates and chosen outputs, between flat vectors, with blade 0 at psi."""

    start: SteadyState
    inputs: tuple[str, ...] = eqx.field(static=True)
    outputs: tuple[str, ...] = eqx.field(static=True)

    def __call__(self, z: Array, psi: Array, u, p) -> tuple[Array, Array]:
        """Rates (N,) and outputs (q,) of z (N + m,)."""
        split, unravel = z.size - len(self.inputs), ravel_pytree(self.start)[1]
        u = {**u, **dict(zip(self.inputs, z[split:], strict=True))}
        rate, read = rotor.rate_and_readings(psi, unravel(z[:split]), u, p)
        return ravel_pytree(rate)[0], _chosen(read, self.outputs)


def _chosen(read: dict[str, Array], outputs: Sequence[str]) -> Array:
    return jnp.concatenate([jnp.atleast_1d(read[name]) for name in outputs])


@eqx.filter_jit
def pushed(function: Flat, z: Array, psi: Array, u, p, along: Float[Array, "k N"]) -> Float[Array, "k M"]:
    """Rates and outputs along directions, one after the other: the pairs of one fill the caches."""
    product = jax.linearize(lambda z: jnp.concatenate(function(z, psi, u, p)), z)[1]
    return jax.lax.map(product, along)


@eqx.filter_jit
def pulled(function: Flat, z: Array, psi: Array, u, p) -> tuple[Float[Array, " q"], Float[Array, "q N"]]:
    """Outputs and their derivatives by everything, row by row."""
    value, back = jax.vjp(lambda z: function(z, psi, u, p)[1], z)
    return value, jax.lax.map(lambda row: back(row)[0], jnp.eye(value.size))
