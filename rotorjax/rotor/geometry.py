"""What a rotor blade looks like: radius, and tables of chord, twist and sweep along the span.

A rotor is kept in SI (metres, radians); the functions return the rotor units that both models use, lengths over R.
Between stations the tables are read by straight lines. That is how the sources publish and use them (GenHel does the
same), it passes through every published number, and it is exactly differentiable in the table's values. A step, such as
the edge of a trim tab, is a pair of close stations.
"""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.checks import check_number, check_stations, refuse
from rotorjax.rotor.airfoil import AirfoilTable

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
        widths = jnp.diff(self.stations)
        come = jnp.clip(jnp.asarray(r)[..., None] - self.stations[:-1], 0, widths)
        return self.values[0] + jnp.sum(come * (jnp.diff(self.values) / widths), axis=-1)


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
    the whole blade. hinge: flap and lag data, or None for a blade that neither flaps nor lags.
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
    s, c = rotor.chord.stations, rotor.chord.values
    inside = jnp.sum(0.5 * (c[1:] + c[:-1]) * jnp.diff(s))
    return rotor.blades / (jnp.pi * rotor.radius) * (inside + c[0] * s[0] + c[-1] * (1 - s[-1]))


def rotor(
    name: str,
    blades: int,
    radius: float,
    root_cutout: float,
    chord: Any,
    airfoil: AirfoilTable,
    twist: Any = 0.0,
    sweep: Any = 0.0,
    hinge: Hinge | None = None,
    tip_loss: float = 1.0,
) -> Rotor:
    """Make a rotor in SI units.

    `chord` (m), `twist` (rad) and `sweep` (rad) are a number or a pair (stations r/R, values). Raises InputError where
    blades is not a whole number of at least 1, the radius or a chord is not positive, root_cutout is not in [0, 0.95],
    tip_loss not in (root_cutout, 1], the hinge lies beyond 0.5 R, a sweep reaches ±80°, or a table has gaps, does not
    increase, does not cover root_cutout to 1 or leaves 0 to 1.
    """
    if isinstance(blades, bool) or not isinstance(blades, int) or blades < 1:
        raise refuse("blades", "be a whole number of at least 1", repr(blades))
    check_number("radius", radius, 0.0, open_=True)
    check_number("root_cutout", root_cutout, 0.0, 0.95)
    check_number("tip_loss", tip_loss, float(root_cutout), 1.0, open_=True)
    if hinge is not None:
        check_number("hinge.offset", float(hinge.offset), 0.0, 0.5 * float(radius))
    tables = {
        key: _table(key, value, float(root_cutout), 1.0)
        for key, value in {"chord": chord, "twist": twist, "sweep": sweep}.items()
    }
    _check_all("chord", tables["chord"], lambda v: v > 0, "be positive")
    _check_all("twist", tables["twist"], lambda v: np.abs(v) <= np.pi / 2, "lie within ±π/2 rad")
    _check_all("sweep", tables["sweep"], lambda v: np.abs(v) < np.deg2rad(80), "lie within ±80 deg")
    return Rotor(
        name=name,
        blades=blades,
        radius=jnp.asarray(radius, float),
        root_cutout=jnp.asarray(root_cutout, float),
        tip_loss=jnp.asarray(tip_loss, float),
        airfoil=airfoil,
        hinge=hinge,
        **tables,
    )


def hinge(
    offset: float,
    blade_mass: float,
    first_moment: float,
    flap_inertia: float,
    delta3: float = 0.0,
    precone: float = 0.0,
    flap_spring: float = 0.0,
    lag_spring: float = 0.0,
    damper_arm: float = 0.0,
    damper: Any = None,
) -> Hinge:
    """Make flap and lag data in SI units; `damper` is None or a pair (rates in m/s, forces in N), both from zero up.

    Raises InputError where a mass or an inertia is not positive, an offset, a spring or the arm is negative, the flap
    inertia is less than first_moment²/blade_mass, or the damper's rates do not increase from zero.
    """
    check_number("hinge.offset", offset, 0.0)
    positive = {"blade_mass": blade_mass, "first_moment": first_moment, "flap_inertia": flap_inertia}
    for name, value in positive.items():
        check_number(f"hinge.{name}", value, 0.0, open_=True)
    positive = {"flap_spring": flap_spring, "lag_spring": lag_spring, "damper_arm": damper_arm}
    for name, value in positive.items():
        check_number(f"hinge.{name}", value, 0.0)
    check_number("hinge.flap_inertia", flap_inertia, first_moment**2 / blade_mass)
    for name, value in {"delta3": delta3, "precone": precone}.items():
        check_number(f"hinge.{name}", value, -1.5, 1.5)
    rate, force = (None, None) if damper is None else check_stations("hinge.damper", *damper, first=0.0, last=0.0)
    scalars = (
        *(offset, blade_mass, first_moment, flap_inertia, delta3, precone),
        *(flap_spring, lag_spring, damper_arm),
    )
    return Hinge(
        *(jnp.asarray(value, float) for value in scalars),
        damper_rate=None if rate is None else jnp.asarray(rate),
        damper_force=None if force is None else jnp.asarray(force),
    )


def _table(name: str, value: Any, first: float, last: float) -> Table:
    if isinstance(value, tuple | list) and len(value) == 2:
        stations, values = check_stations(name, *value, first=first, last=last)
        if stations[0] < 0 or stations[-1] > 1:
            raise refuse(f"{name}.r", "stay within 0 to 1 (r/R)", f"{stations[0]:g} to {stations[-1]:g}")
    else:
        number = float(check_number(name, value))  # type: ignore[arg-type]
        stations, values = np.array([first, last]), np.array([number, number])
    return Table(jnp.asarray(stations, float), jnp.asarray(values, float))


def _check_all(name: str, table: Table, holds: Any, rule: str) -> None:
    values = np.asarray(table.values)
    wrong = np.flatnonzero(~holds(values))
    if wrong.size:
        i = int(wrong[0])
        raise refuse(f"{name}.value", rule, f"{values[i]:g} at r = {float(table.stations[i]):g}")
