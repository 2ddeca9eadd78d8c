"""The far filaments beyond their free part: closure, fading and cores."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.frames import rotate_about_shaft
from rotorjax.ground import Plane, component
from rotorjax.wake.model import FreeWake
from rotorjax.wake.roll_up import rolled_up
from rotorjax.wake.vortex_core import core_radius

STILL = 0.01
"""Wind over ΩR below which the closure over ground is that of hover."""

REACH = 0.5
"""Height over R up to which a plane slows the edge of the jet that comes down on it: on the free streamline of a round
jet of radius a, about z = a²/2r near the plane, dz/ds is 0.66 at a height of 0.5 R and 0.96 at R (a = 0.75 R)."""

STEADY = 0.02
"""Fall of ln sinh(z/REACH) in a turn below which a turn is held where it is: one that rises, in the air that comes up
under the hub of a rotor close to the ground, must not be repeated through the disk and beyond."""

HIGH = 20.0
"""Where sinh x is e^x/2 to rounding."""

FARTHEST = {4: 1e8, 8: 1e60}
"""How much thinner than under the last free turn, by bytes of a number, the layer under the turns to come gets: what
lies there induces nothing."""

LEAST = 0.005
"""Height over R that a turn's mean does not fall below: a search may put it under the plane."""


class Repeats(NamedTuple):
    """The turns that follow the last free one: how many turns after it each stands, and how many it stands for."""

    after: tuple[float, ...]
    weight: tuple[int, ...]


def repeats(model: FreeWake) -> Repeats:
    """`closure_turns` turns one by one, then bundles of 2, 4, 8, … turns, each in one place.

    A bundle is seen from about as far away as it is long, so one turn of its strength will do, at the place where a
    dipole induces at the disk what the bundle does: ∫ d⁻³ over its length. A wake of C_T = 0.002 that ends after eight
    turns, 1.6 R below the disk, lacks 13 % of its inflow.
    """
    settings = model.settings
    ones = range(1, settings.closure_turns + 1)
    weights = [2**i for i in range(1, settings.closure_bundles + 1)]
    free = float(settings.filament_ages[-1]) / (2 * np.pi)
    ends = free + settings.closure_turns + np.cumsum([0, *weights])
    middles = (2 * np.array(weights) / (ends[:-1] ** -2.0 - ends[1:] ** -2.0)) ** (1 / 3)
    return Repeats((*map(float, ones), *(middles - free + 0.5)), (*(1 for _ in ones), *weights))


def closure(model: FreeWake, nodes: Float[Array, "F P+1 3"], psi: Float[Array, ""]) -> Float[Array, "F C 3"]:
    """Nodes of the turns that follow the free ones: the last free turn, repeated under the flow in which it ends.

    Out of ground effect the turn moves on by its own pitch, and with the wind. Over ground it comes down at a speed
    that goes as tanh(z/REACH), so at a steady one far above the plane and as in a stagnation flow next to it, and its
    radius grows so that the flow through it is kept; far out it runs along the plane at a steady speed again. A jet
    that meets the plane aslant keeps what moves it along the plane: it comes down along the shaft and runs off
    downhill, and the stagnation point lies uphill. As h → ∞ all this becomes the first. A wake cut off without closure
    expands and bunches at its end and pulls the inflow at the disk with it. Over surfaces the plane is the rotor's
    floor (`FreeWake.floor`); what of it comes into a closed surface is shut off there.
    """
    turn = model.settings.old_segments_per_turn
    last, before = nodes[:, -turn - 1 :], nodes[:, -2 * turn - 1 : -turn]
    along = None if model.flight is None else model.flight.wind * np.array([1.0, 1.0, 0.0])
    # all repeats at once, (F, repeats, N, 3)
    after = jnp.asarray(repeats(model).after)[:, None]
    if model.floor is None:
        pitch = jnp.mean(last[..., 2] - before[..., 2], axis=1)
        down = pitch[:, None] * np.array([0.0, 0.0, 1.0]) + (0.0 if along is None else _drift(along, psi))
        return _in_line(model, last[:, None] + after[..., None] * down[:, None, None])
    return _in_line(model, _over_plane(model.floor, last, before, after, along, psi))


def _over_plane(
    plane: Plane,
    last: Float[Array, "F N 3"],
    before: Float[Array, "F N 3"],
    after: Float[Array, "K 1"],
    along: Float[Array, " 3"] | None,
    psi: Float[Array, ""],
) -> Float[Array, "F K N 3"]:
    """The last free turn, repeated as it comes down to a plane; along: wind in the disk, None for hover."""
    # heights do not depend on the frame, so only the foot and the normal have to be turned into the blade's
    normal = rotate_about_shaft(plane.normal, -psi)
    # where the shaft meets the plane, which a hub that has turned sees elsewhere than under its height
    foot = -plane.height * jnp.cos(plane.slope) / normal[2] * np.array([0.0, 0.0, 1.0])
    height = _heights(last, normal, plane)
    flat = last - height[..., None] * normal - foot
    drift = jnp.zeros(3, last.dtype)
    if along is not None:
        # in a wind the stagnation point goes with the turn; in none it stays on the shaft, as in hover
        drift = _drift(along, psi)
        drift = drift - (drift @ normal) * normal
        share = (along @ along) / (along @ along + STILL**2)
        foot = foot + share * jnp.mean(flat, axis=1, keepdims=True)
        flat = last - height[..., None] * normal - foot
    foot = jnp.broadcast_to(foot, (len(last), 1, 3))[:, None]
    x = height / REACH
    # what ln sinh x falls by in a turn is the same for every turn
    mean, mean_before = jnp.mean(x, axis=1), jnp.mean(_heights(before, normal, plane), axis=1) / REACH
    fall = after * (STEADY * jax.nn.softplus((_log_sinh(mean_before) - _log_sinh(mean)) / STEADY))[:, None, None]
    fall = jnp.minimum(fall, np.log(FARTHEST[fall.dtype.itemsize]))
    free = (2 * REACH / jnp.sqrt(jnp.mean(jnp.sum(flat**2, axis=-1), axis=1)))[:, None, None]
    fall = _at_the_jets_speed(mean[:, None, None], free, fall)
    lower, thinned = _lowered(x[:, None], fall), _thinned(x[:, None], fall)
    wider = _widening(free, thinned)
    downhill = normal - np.array([0.0, 0.0, 1.0]) / normal[2]
    run = REACH * _along(x[:, None], thinned, fall)[..., None] * downhill
    spread = (flat[:, None] + run) * wider[..., None] + REACH * lower[..., None] * normal
    return foot + after[..., None] * drift + spread


def _at_the_jets_speed(
    x: Float[Array, "F 1 1"], free: Float[Array, "F 1 1"], fall: Float[Array, "F K 1"]
) -> Float[Array, "F K 1"]:
    """What ln sinh of turns of mean height x falls by, from what it would in a stagnation flow.

    There the speed along the plane grows for ever, as s = r/2REACH; a free jet's, the same close to the shaft, comes to
    an end: s/(1 + s) = V/(f + V) for a turn that has grown to V of its radius r₀, f = 2REACH/r₀ (`free`). In the time
    in which it would grow to W by the first it grows by the second to V with f ln V + V = 1 + (1 + f) ln W. What is
    used is that within some per cent, V = 1 + (1 + f) ln((f + W)/(f + 1)): like W at first, a step a turn in the end.
    """
    thinned = _thinned(x, fall)
    wide = 1 + (1 + free) * jnp.log((free + jnp.sqrt(thinned)) / (free + 1))
    return fall - jnp.log(thinned * (free + wide) / (wide**2 * (1 + free)))


def _thinned(x: Float[Array, "*#n"], fall: Float[Array, "*#n"]) -> Float[Array, "*#n"]:
    """tanh x/tanh y where ln sinh y is that of x less `fall`: how much thinner the layer under a turn has become."""
    small = jnp.exp(-2 * jnp.abs(x))  # tanh² + e^{2 fall}/cosh², whose cosh must not overflow
    return jnp.sqrt((1 - small) ** 2 + 4 * small * jnp.exp(2 * fall)) / (1 + small)


def _widening(free: Float[Array, "F 1 1"], thinned: Float[Array, "F K N"]) -> Float[Array, "F K N"]:
    """V at which the flow under a turn is what it was, V²/(f + V) · tanh y = tanh x/(f + 1)."""
    share = thinned / (1 + free)
    return 0.5 * (share + jnp.sqrt(share * (share + 4 * free)))


def _drift(along: Float[Array, " 3"], psi: Float[Array, ""]) -> Float[Array, " 3"]:
    """How far the wind carries a turn in a revolution, in the blade's frame."""
    return 2 * jnp.pi * rotate_about_shaft(along, -psi)


def _in_line(model: FreeWake, turns: Float[Array, "F K N 3"]) -> Float[Array, "F C 3"]:
    """Repeated turns one behind the other; a turn that goes on where the one before ends leaves out its start."""
    ones = model.settings.closure_turns
    parts = turns[:, :ones, 1:], turns[:, ones:, :: model.settings.bundle_skip]
    return jnp.concatenate([p.reshape(len(p), -1, 3) for p in parts], axis=1)


def _lowered(x: Float[Array, "*n"], fall: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """y with sinh y = sinh x · e^−fall: where what moves as dx/dt = −tanh x has come to in the time `fall`.

    Odd in x, so a node that a search puts under the plane is no accident; sinh must not overflow high above it.
    """
    steady = x - fall
    low = jnp.minimum(steady, HIGH)
    return jnp.arcsinh(0.5 * (jnp.exp(low) - jnp.exp(-x - fall))) + steady - low


def _along(x: Float[Array, "*#n"], thinned: Float[Array, "*#n"], fall: Float[Array, "*#n"]) -> Float[Array, "*#n"]:
    """How far a uniform flow of speed 1 along the plane carries what falls from x to y as dx/dt = −tanh x does.

    In place of before it, that is over the widening √(tanh x/tanh y): ∫ √(tanh y/tanh x) dt along the way. With
    ∫ dy/√tanh y = artanh √tanh y + arctan √tanh y, artanh u as ½ ln((1 + u)² (1 + u²)/(1 − u⁴)), 1 − tanh² = cosh⁻².
    """
    root = jnp.sqrt(jnp.tanh(_lifted(x)))
    end = root / jnp.sqrt(thinned)
    ratio = (1 + root) * jnp.sqrt(1 + root**2) / (thinned * (1 + end) * jnp.sqrt(1 + end**2))
    return (jnp.log(ratio) + fall + jnp.arctan((root - end) / (1 + root * end))) / root


def _lifted(x: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """x, smoothly kept above LEAST."""
    return 0.5 * (x + jnp.sqrt(x**2 + (2 * LEAST / REACH) ** 2))


def _log_sinh(x: Float[Array, "*n"]) -> Float[Array, "*n"]:
    x = _lifted(x)
    return x + jnp.log(-0.5 * jnp.expm1(-2 * x))


def _heights(nodes: Float[Array, "*n 3"], normal: Float[Array, "3"], plane: Plane) -> Float[Array, "*n"]:
    return component(nodes, normal) + plane.height * jnp.cos(plane.slope)


def _steps(model: FreeWake) -> tuple[Float[np.ndarray, " S"], Float[np.ndarray, " S"]]:
    """Age (rad) of the middle of each far segment, closure included, and how many segments it stands for.

    What joins one bundle to the next is not there. Where a bundle's chords are longer than the free part's they count
    for more: from far away a turn is its impulse, Γ times its area, and chords enclose less.
    """
    ends, turn, skip = model.settings.segment_ages, model.settings.old_segments_per_turn, model.settings.bundle_skip
    last, larger = ends[-turn - 1 :], _chord_area(turn) / _chord_area(turn // skip)
    ages, weights = [_middles(ends)], [np.ones(len(ends) - 1)]
    for k, w in zip(*repeats(model), strict=True):
        within, each = (_middles(last), 1.0) if w == 1 else (_middles(last[::skip]), w * larger)
        if w > 1:
            ages.append(within[:1] + k * 2 * np.pi)
            weights.append(np.zeros(1))
        ages.append(within + k * 2 * np.pi)
        weights.append(np.full(len(within), each))
    return np.concatenate(ages), np.concatenate(weights)


def _middles(v: Float[np.ndarray, " N+1"]) -> Float[np.ndarray, " N"]:
    return 0.5 * (v[1:] + v[:-1])


def _chord_area(turn: int) -> float:
    """Area of a polygon over that of its circle: what a turn of chords keeps of the impulse of a turn of arcs."""
    return float(np.sinc(2 / turn))


def segment_ages(model: FreeWake) -> Float[np.ndarray, " S"]:
    """Age (rad) at the middle of each far segment, closure included, counted from the blade."""
    return _steps(model)[0]


def turns_each(model: FreeWake) -> Float[np.ndarray, " S"]:
    """How many turns each far segment stands for, closure included."""
    return _steps(model)[1]


def faded(model: FreeWake, strength: Float[Array, "F S"], age: Float[np.ndarray, " S"]) -> Float[Array, "F S"]:
    """What far filaments of these strengths carry at these ages (rad, from the blade): of what has not faded, the share
    that has rolled up.

    Inboard filaments fade, and the impulse of a turn, Σ Γ r², changes as they do: but for the share `impulse_kept`, for
    which the tip vortex gives up (r_i/r_tip)² of what the filament released at r_i loses.
    """
    settings = model.settings
    turns = (age - settings.filament_ages[0]) / (2 * np.pi)
    left = jnp.exp(-settings.inboard_decay * turns - (settings.mixing * _mixed(age)) ** 2)
    arms = (np.array(settings.inboard)[:, None] / settings.release) ** 2
    tip = strength[0] + settings.impulse_kept * jnp.sum(arms * (1 - left) * strength[1:], axis=0)
    return rolled_up(settings, age) * jnp.concatenate([tip[None], left * strength[1:]])


def _mixed(age: Float[np.ndarray, " S"]) -> Float[Array, " S"]:
    """Turns for which wake of these ages (rad) has lain beside other turns."""
    return jnp.maximum(jnp.asarray(age) / (2 * np.pi) - 1, 0)


def cores(model: FreeWake, tip_strength: Float[Array, ""], ages: Float[np.ndarray, " S"]) -> Float[Array, "F S"]:
    """Core radii over R of far segments of these ages (Eq. 16): r₀ at the blade, growing with the vortex's strength."""
    settings = model.settings
    aged = jnp.asarray(ages)
    tip = core_radius(aged, settings.tip_core, tip_strength, model.viscosity, settings.turbulence, model.speed)
    tip = jnp.sqrt(tip**2 + (settings.spreading * _mixed(ages)) ** 2)
    # a smooth maximum: the inboard line stands for a sheet and is never thinner than that
    inner = jnp.sqrt(tip**2 + settings.inboard_core**2)
    return jnp.stack([tip] + [inner] * (settings.filaments - 1))
