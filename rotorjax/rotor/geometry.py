"""What a rotor blade looks like: radius, and tables of chord, twist and sweep along the span.

A rotor is kept in SI (metres, radians); the functions return the rotor units that both models use, lengths over R.
Between stations the tables are read by straight lines. That is how the sources publish and use them (GenHel does the
same), it passes through every published number, and it is exactly differentiable in the table's values. A step, such as
the edge of a trim tab, is a pair of close stations.
"""

from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.checks import Range, array, check_number, check_range, check_stations, check_whole, known, refuse, shown
from rotorjax.rotor.airfoil import AirfoilTable

ROTATIONS = ("counter-clockwise", "clockwise")
"""Senses of rotation seen from above."""
MOST_BLADES = 20
TIP_LOSS = 0.97
"""Where the lift of a rotor ends that does not say, over R: B of most rotors (Leishman 2006). With lift up to the
end the finite states ask for 0.61 to 0.87 of the ideal induced power in hover, with this for 0.95 to 1.05."""
RADIUS, CHORD = Range(0.02, 200.0, "m"), Range(1e-4, 50.0, "m")
_RADIANS = "degrees go through np.deg2rad"
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)


class Table(eqx.Module):
    """A quantity along the blade. stations: r/R, increasing, [S]. values: [S]."""

    stations: Float[Array, " S"]
    values: Float[Array, " S"]

    def __call__(self, r: Float[Array, "*n"]) -> Float[Array, "*n"]:
        """Read the table at r (over R) by straight lines, constant beyond its ends.

        Every interval gives its slope times the way that r has come along it: `jnp.interp` looks for the interval in a
        loop, which takes ten times as long to compile. On a station the derivative is the mean of both sides.
        """
        return _read(self.stations, self.values, jnp.asarray(r))


@partial(jax.jit, inline=True)
def _read(stations: Float[Array, " S"], values: Float[Array, " S"], r: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """One program where nobody compiles around it; within jit its operations stand as if written there."""
    widths = jnp.diff(stations)
    come = jnp.clip(r[..., None] - stations[:-1], 0, widths)
    return values[0] + jnp.sum(come * (jnp.diff(values) / widths), axis=-1)


class Hinge(eqx.Module):
    """Flap and lag data of an articulated blade, SI; all leaves are scalar arrays but the damper table.

    offset (m). blade_mass (kg). first_moment: ∫ r dm about the hinge (kg m). flap_inertia: about the hinge (kg m²).
    delta3, precone (rad). flap_spring, lag_spring (N m/rad). damper_rate (m/s) and damper_force (N), [D]: the lag
    damper for positive rates (it is odd), or None; damper_arm (m): of its force about the lag hinge.
    """

    offset: Float[Array, ""]
    blade_mass: Float[Array, ""]
    first_moment: Float[Array, ""]
    flap_inertia: Float[Array, ""]
    delta3: Float[Array, ""]
    precone: Float[Array, ""]
    flap_spring: Float[Array, ""]
    lag_spring: Float[Array, ""]
    damper_arm: Float[Array, ""]
    damper_rate: Float[Array, " D"] | None
    damper_force: Float[Array, " D"] | None


class Rotor(eqx.Module):
    """A rotor of equal blades.

    name, blades: static. radius (m). root_cutout: where the aerofoil begins, over R. tip_loss: where the lift ends,
    over R, for inflow models that do not lose it by themselves (the free wake does). chord: (r/R, m). twist: (r/R,
    rad), added to the collective. sweep: (r/R, rad), of the quarter-chord line, positive aft. airfoil: one table for
    the whole blade. hinge: flap and lag data, or None for a blade that neither flaps nor lags. rotation: one of
    ROTATIONS, static; azimuth counts in its direction, and whatever points to starboard is mirrored for a clockwise
    rotor (frames.py).
    """

    name: str = eqx.field(static=True)
    blades: int = eqx.field(static=True)
    radius: Float[Array, ""]
    root_cutout: Float[Array, ""]
    tip_loss: Float[Array, ""]
    chord: Table
    twist: Table
    sweep: Table
    airfoil: AirfoilTable
    hinge: Hinge | None = None
    rotation: str = eqx.field(static=True, default=ROTATIONS[0])

    @property
    def side(self) -> float:
        """1 for a rotor that turns counter-clockwise, −1 for a clockwise one: the sign of its starboard quantities."""
        return 1.0 if self.rotation == ROTATIONS[0] else -1.0


def chord(rotor: Rotor, r: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """Chord over R at r (over R)."""
    return rotor.chord(r) / rotor.radius


def twist(rotor: Rotor, r: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """Built-in twist (rad) at r (over R); the pitch is the collective plus this."""
    return rotor.twist(r)


def sweep_offset(rotor: Rotor, r: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """How far aft of the straight blade axis the quarter chord lies at r, over R: the integral of tan(sweep).

    Each interval of the sweep table up to r is integrated by eight Gauss points, exact to rounding where the sweep is
    constant.
    """
    r = jnp.asarray(r, rotor.sweep.values.dtype)[..., None]
    inner, outer = rotor.sweep.stations[:-1], rotor.sweep.stations[1:]
    half = 0.5 * (jnp.clip(r, inner, outer) - inner)
    nodes = inner[..., None] + half[..., None] * (1 + jnp.asarray(_GAUSS_NODES, r.dtype))
    return jnp.sum(half * (jnp.tan(rotor.sweep(nodes)) @ jnp.asarray(_GAUSS_WEIGHTS, r.dtype)), axis=-1)


def solidity(rotor: Rotor) -> Float[Array, ""]:
    """Blade area over disk area, B/π ∫₀¹ (c/R) dr, the blade continued to the axis as usual.

    The published 0.0826 of the UH-60 (Table 1) needs the chord along the flow in the swept tip, c/cos 20°, on top of
    the chord and the tab: tests/rotor/test_geometry.py. With the published chord as it stands it is 0.0822.
    """
    s, c, radius = rotor.chord.stations, rotor.chord.values, rotor.radius
    if known(s, c, radius):  # numbers need nothing compiled
        s, c, radius = (np.asarray(v) for v in (s, c, radius))
    inside = 0.5 * (c[1:] + c[:-1]) @ (s[1:] - s[:-1])
    return array(rotor.blades / np.pi * (inside + c[0] * s[0] + c[-1] * (1 - s[-1])) / radius)


def rotor(
    name: str,
    blades: int,
    radius: float,
    root_cutout: float,
    chord: Any,
    airfoil: AirfoilTable,
    *,
    twist: Any = 0.0,
    sweep: Any = 0.0,
    hinge: Hinge | None = None,
    tip_loss: float = TIP_LOSS,
    rotation: str = ROTATIONS[0],
) -> Rotor:
    """Make a rotor in SI units.

    `chord` (m), `twist` (rad) and `sweep` (rad) are a number or a pair (stations r/R, values); a number of `twist` only
    adds to the collective. `tip_loss`: 1 for lift up to the end. Everything but name, blades and rotation may be
    traced. Raises InputError where blades is no whole number from 1 to 20, the radius is not in [0.02, 200] m or a
    chord in [1e-4, 50] m, root_cutout is not in [0, 0.95], tip_loss not in (root_cutout, 1], the hinge lies beyond
    0.5 R, a sweep reaches ±80°, or a table has gaps, does not increase, does not cover root_cutout to 1 or leaves 0 to
    1.
    """
    check_whole("blades", blades, 1, MOST_BLADES)
    if rotation not in ROTATIONS:
        raise refuse("rotation", f"be one of {', '.join(ROTATIONS)}", shown(rotation))
    check_range("radius", radius, RADIUS)
    check_number("root_cutout", root_cutout, 0.0, 0.95)
    inner = float(root_cutout) if known(root_cutout) else 0.0
    check_range("tip_loss", tip_loss, Range(inner, 1.0, "R, beyond root_cutout", above=True))
    if hinge is not None and known(hinge.offset, radius):
        check_range("hinge.offset", hinge.offset, Range(0.0, 0.5 * float(radius), "m, up to half the radius"))
    return Rotor(
        name=name,
        blades=blades,
        radius=array(radius),
        root_cutout=array(root_cutout),
        tip_loss=array(tip_loss),
        airfoil=airfoil,
        hinge=hinge,
        rotation=rotation,
        chord=_table("chord", chord, root_cutout, CHORD),
        twist=_table("twist", twist, root_cutout, Range(-np.pi / 2, np.pi / 2, "rad", hint=_RADIANS)),
        sweep=_table("sweep", sweep, root_cutout, Range(-1.39, 1.39, "rad", hint=_RADIANS)),
    )


def hinge(
    offset: float,
    blade_mass: float,
    first_moment: float,
    flap_inertia: float,
    *,
    delta3: float = 0.0,
    precone: float = 0.0,
    flap_spring: float = 0.0,
    lag_spring: float = 0.0,
    damper_arm: float = 0.0,
    damper: Any = None,
) -> Hinge:
    """Make flap and lag data in SI units; `damper` is None or a pair (rates in m/s, forces in N), both from zero up.

    Raises InputError where a mass or an inertia is not positive, an offset, a spring or the arm is negative, the flap
    inertia is less than first_moment²/blade_mass, or the damper has no arm, rates that do not increase from zero, or a
    force at rest. All but the damper may be traced.
    """
    least = {"offset": 0.0, "flap_spring": 0.0, "lag_spring": 0.0, "damper_arm": 0.0}
    given = dict(zip(least, (offset, flap_spring, lag_spring, damper_arm), strict=True))
    for name, value in given.items():
        check_range(f"hinge.{name}", value, Range(0.0, 1e10))
    positive = {"blade_mass": blade_mass, "first_moment": first_moment, "flap_inertia": flap_inertia}
    for name, value in positive.items():
        check_range(f"hinge.{name}", value, Range(0.0, 1e10, above=True))
    if known(blade_mass, first_moment):
        least = first_moment**2 / blade_mass
        if known(flap_inertia) and flap_inertia < least:
            rule = f"be at least first_moment²/blade_mass, {least:.4g} kg m2"
            raise refuse("hinge.flap_inertia", rule, f"{float(flap_inertia):g}")
    for name, value in {"delta3": delta3, "precone": precone}.items():
        check_range(f"hinge.{name}", value, Range(-1.5, 1.5, "rad", hint=_RADIANS))
    rate, force = (None, None) if damper is None else _damper(damper, damper_arm)
    scalars = (
        *(offset, blade_mass, first_moment, flap_inertia, delta3, precone),
        *(flap_spring, lag_spring, damper_arm),
    )
    return Hinge(
        *map(array, scalars),
        damper_rate=None if rate is None else array(rate),
        damper_force=None if force is None else array(force),
    )


def _damper(damper: Any, arm: Any) -> tuple[Any, Any]:
    """Rates and forces for positive rates; the damper is odd."""
    if not isinstance(damper, tuple | list) or len(damper) != 2:
        raise refuse("hinge.damper", "be a pair of rates and forces", shown(damper))
    rate, force = check_stations("hinge.damper", *damper, first=0.0, last=0.0)
    if known(rate, force):
        if rate[0] != 0 or force[0] != 0:
            raise refuse("hinge.damper", "begin with no force at no rate (it is odd)", f"{force[0]:g} at {rate[0]:g}")
        if np.any(force < 0) or np.abs(force).max() > 1e9:
            raise refuse("hinge.damper", "hold forces in [0, 1e9] N", f"{force[np.argmax(np.abs(force))]:g} N")
    if known(arm) and arm == 0:
        raise refuse("hinge.damper_arm", "be above 0 with a damper", "0: the damper would have no effect")
    return rate, force


def _table(name: str, value: Any, first: Any, allowed: Range) -> Table:
    """A table along the blade from `first` to the tip; a number is the same all along."""
    if isinstance(value, tuple | list) and len(value) == 2:
        stations, values = check_stations(name, *value, first=first, last=1.0)
        if known(stations) and (stations[0] < 0 or stations[-1] > 1):
            raise refuse(f"{name}.r", "stay within 0 to 1 (r/R)", f"{stations[0]:g} to {stations[-1]:g}")
        wrong = [i for i, v in enumerate(values) if v not in allowed] if known(stations, values) else []
        if wrong:
            found = f"{values[wrong[0]]:g} at r = {stations[wrong[0]]:g}"
            raise refuse(f"{name}.value", f"be {allowed}", found + (f": {allowed.hint}" if allowed.hint else ""))
    else:
        number = check_range(name, value, allowed)
        stations = np.array([first, 1.0]) if known(first) else jnp.stack([first, jnp.ones_like(first)])
        values = np.full(2, float(number)) if known(number) else jnp.stack([number, number])
    return Table(array(stations), array(values))
