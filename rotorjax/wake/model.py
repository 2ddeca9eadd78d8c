"""The free-wake model and its state, and the blade's lifting line.

Everything is in rotor units: lengths over R, velocities over ΩR, circulation over ΩR², time as azimuth ψ (rad).

A wake is kept as K slices. Slice k belongs to a blade at azimuth ψ_k = ψ + 2πk/K and is written in that blade's own
frame: x outboard along the blade, y in the direction of rotation, z up. One layout serves three uses:
    K = 1           an axisymmetric wake: every blade's wake is the same, turned (hover, level ground);
    K = B           the instantaneous wake of all B blades: the state that is marched in time;
    K = any multiple of B   a periodic wake, sampled over one revolution: slices k, k + K/B, k + 2K/B … are the wakes
                    of the B blades at one instant.
"""

from dataclasses import replace
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from rotorjax.checks import array, known
from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.operating import OperatingPoint, check_still
from rotorjax.panels.surface import Panels, Solid, check_clear, check_panels, floor, solid
from rotorjax.rotor import geometry
from rotorjax.rotor.derived import check_rotor
from rotorjax.rotor.geometry import Rotor
from rotorjax.wake.settings import WakeSettings, hover_settings

AMONG: dict[str, Any] = {"tip_core": 0.05}
"""Settings of a wake among surfaces beyond those of hover: where turns are not round, thin old vortices wind round each
other and the search stalls, as in flight."""


class WakeState(eqx.Module):
    """The wake's part x_W of the state (Eq. 15).

    near: r_NW (K, R+1, A_N, 3), nodes of the near-wake lattice, the blade's own edge excluded.
    far: r_TV (K, F, A_F, 3), nodes of the far filaments, their release points excluded; filament 0 is the tip vortex.
    gamma_near: Γ_NW (K, R, A_N), ring strengths at the lattice's ages. gamma_far: Γ_TV (K, F, A_F).
    gamma_bound: Γ_b (K, R), filtered bound circulation.
    """

    near: Float[Array, "K R1 AN 3"]
    far: Float[Array, "K F AF 3"]
    gamma_near: Float[Array, "K R AN"]
    gamma_far: Float[Array, "K F AF"]
    gamma_bound: Float[Array, "K R"]


class Flight(eqx.Module):
    """How hub and blades move, beyond a rigid rotor that hovers or climbs.

    wind (3,): velocity of the air far away, seen from the hub, over ΩR, in the hub frame (x aft, z up); the operating
    point's climb comes on top. hinge: e/R of the flap and lag hinges. flap, flap_rate (K,): of the blade of each slice
    (rad, per rad). cyclic (K,): its pitch beyond collective and twist (rad). turn (3,): angular velocity of the hub
    over Ω, hub frame; None for none. speed (): the rotor's speed over Ω, which stays the unit of velocities; None for
    1. lag, lag_rate (K,): back (rad, per rad); both None for blades whose lag hinge is held. gust (2,): the air goes up
    by gust₀ sin πx + gust₁ sin πy over ΩR, in the hub frame; None for none.
    """

    wind: Float[Array, "3"]
    hinge: Float[Array, ""]
    flap: Float[Array, " K"]
    flap_rate: Float[Array, " K"]
    cyclic: Float[Array, " K"]
    turn: Float[Array, "3"] | None = None
    speed: Float[Array, ""] | None = None
    lag: Float[Array, " K"] | None = None
    lag_rate: Float[Array, " K"] | None = None
    gust: Float[Array, "2"] | None = None

    def of_slice(self, k: int | Int[Array, ""]) -> "Flight":
        """The motion of one slice's blade alone."""
        names = ("flap", "flap_rate", "cyclic", "lag", "lag_rate")
        return replace(self, **{n: v[k] for n in names if (v := getattr(self, n)) is not None})

    @property
    def axes(self) -> tuple[Float[Array, "*K 3"], Float[Array, "*K 3"], Float[Array, "*K 3"]]:
        """Unit vectors of each blade in its turning frame: outboard n, ahead and up, as in rotor/moving_blade.py."""
        flap, lag = self.flap, jnp.zeros_like(self.flap) if self.lag is None else self.lag
        (cf, sf), (cl, sl) = ((jnp.cos(v), jnp.sin(v)) for v in (flap, lag))
        outboard, ahead, up = (cf * cl, -cf * sl, sf), (sl, cl, jnp.zeros_like(flap)), (-sf * cl, sf * sl, cf)
        return jnp.stack(outboard, axis=-1), jnp.stack(ahead, axis=-1), jnp.stack(up, axis=-1)


class FreeWake(eqx.Module):
    """Parameters of the free wake: rotor, operating point, ground and settings, all leaves differentiable.

    washout: velocity (over ΩR) of an auxiliary flow that carries the wake away, 0 in every physical case; the solver
    starts with it and takes it back (solution.py). flight: None for rigid blades in hover or climb. surfaces: what else
    no air goes through, fixed in the hub frame as the ground is; the wake is then one of K slices. over: the floor of a
    rotor whose surfaces are another's too (several.py), None where it follows from ground and surfaces.
    """

    rotor: Rotor
    operating: OperatingPoint
    ground: Plane | None
    settings: WakeSettings
    washout: Float[Array, ""]
    flight: Flight | None = None
    surfaces: Solid | None = None
    over: Plane | None = None

    def of_slice(self, k: int | Int[Array, ""]) -> "FreeWake":
        """The model of one slice: its blade's motion alone."""
        return self if self.flight is None else replace(self, flight=self.flight.of_slice(k))

    @property
    def edges(self) -> Float[Array, " R+1"]:
        """Panel edges on the blade, over R: cosine-spaced, so that panels narrow towards root and tip."""
        theta = np.linspace(0, np.pi, self.settings.panels + 1)
        return _stretch(self.rotor.root_cutout, theta)

    @property
    def stations(self) -> Float[Array, " R"]:
        """Control points, over R: at the middle of each panel in the cosine's angle (exact for elliptic loading)."""
        theta = np.linspace(0, np.pi, self.settings.panels + 1)
        return _stretch(self.rotor.root_cutout, 0.5 * (theta[1:] + theta[:-1]))

    @property
    def widths(self) -> Float[Array, " R"]:
        """Panel widths, over R."""
        return jnp.diff(self.edges)

    @property
    def leading(self) -> Float[Array, "R+1 3"]:
        """Nodes of the lifting line, a straight line along the blade axis; of a moving blade, ask for its slice.

        The swept tip is kept in the geometry (`geometry.sweep_offset`) but the lifting line stays straight: a kink in
        it would see its own logarithmic singularity.
        """
        return on_blade(self, self.edges)

    @property
    def control(self) -> Float[Array, "R 3"]:
        """Control points on the blade; of a moving blade, ask for its slice."""
        return on_blade(self, self.stations)

    @property
    def chords(self) -> Float[Array, " R"]:
        """Chord at the control points, over R."""
        return geometry.chord(self.rotor, self.stations)

    @property
    def climb(self) -> Float[Array, ""]:
        """Climb velocity over ΩR."""
        return self.operating.climb_ratio(self.rotor.radius)

    @property
    def speed(self) -> float | Float[Array, ""]:
        """Rotor speed over that of the operating point."""
        return 1.0 if self.flight is None or self.flight.speed is None else self.flight.speed

    @property
    def floor(self) -> Plane | None:
        """The plane that stands for all that lies under the rotor, where only a plane will do: the turns beyond the
        free ones, and a search's start. Without surfaces the ground itself.
        """
        if self.over is not None:
            return self.over
        return self.ground if self.surfaces is None else floor(self.surfaces.panels, self.ground)

    @property
    def levelled(self) -> "FreeWake":
        """The axisymmetric model nearest to this one: over its floor, level, or over none."""
        plane = self.floor
        if plane is not None:
            plane = Plane(plane.height, jnp.zeros_like(plane.slope))
        return replace(self, ground=plane, surfaces=None, over=None)

    @property
    def axisymmetric(self) -> bool:
        """Whether every blade's wake is the same: over level ground or none, not asked how it tilts."""
        level = self.ground is None or (known(self.ground.slope) and float(self.ground.slope) == 0)
        return level and self.surfaces is None

    @property
    def viscosity(self) -> Float[Array, ""]:
        """Kinematic viscosity over ΩR²."""
        return self.operating.viscosity / (self.operating.omega * self.rotor.radius**2)


def free_wake(
    rotor: Rotor,
    operating: OperatingPoint,
    ground: Plane | None = None,
    settings: WakeSettings | None = None,
    surfaces: Panels | None = None,
) -> FreeWake:
    """Make the model of a rotor's free wake, in or out of ground effect, beside and above solid surfaces.

    settings: `hover_settings()` where none are given, among surfaces with cores of 0.05 R. surfaces: of `box`, `slab`,
    `wall`, `terrain` or `read_stl`, added up; what of them rests on the ground is left out. Everything but shapes may
    be traced.

    Raises InputError where the rotor climbs over ground or surfaces, its solidity or tip Mach number is beyond sense,
    azimuths is no multiple of the number of blades, or surfaces cut the disk or cannot be closed (`panels.surface`).
    """
    if settings is None:
        settings = hover_settings() if surfaces is None else among_settings()
    settings = settings.for_blades(rotor.blades)
    check_rotor(rotor, operating)
    if ground is not None:
        check_still(operating)
    if settings.azimuths % rotor.blades:
        raise InputError(
            f"Argument `settings` must have azimuths that are a multiple of the {rotor.blades} blades, "
            f"but has {settings.azimuths}"
        )
    if surfaces is None:
        return FreeWake(rotor, operating, ground, settings, array(0.0))
    check_surfaces(surfaces, operating)
    check_clear(surfaces)
    closed = solid(surfaces, ground)
    return FreeWake(rotor, operating, ground, settings, array(0.0), surfaces=closed)


def among_settings() -> WakeSettings:
    """Settings of a wake among surfaces, where none are asked for."""
    return hover_settings(**AMONG)


def check_surfaces(surfaces: Panels, operating: OperatingPoint) -> None:
    """Raise InputError where surfaces are no panels or the rotor climbs past them."""
    check_panels(surfaces)
    check_still(operating)


def along_blade(r: Float[Array, " N"]) -> Float[Array, "N 3"]:
    """Points on the blade's axis at r, in the blade's frame."""
    return r[..., None] * np.array([1.0, 0.0, 0.0], r.dtype)


def on_blade(model: FreeWake, r: Float[Array, " N"]) -> Float[Array, "N 3"]:
    """Points at r on the blade of a slice's model, flapped and lagged about its hinges, in the blade's frame."""
    if model.flight is None:
        return along_blade(r)
    hinge = model.flight.hinge
    return along_blade(jnp.full_like(r, hinge)) + (r - hinge)[:, None] * model.flight.axes[0]


def slices(state: WakeState) -> int:
    """K, the number of slices of a state."""
    return state.near.shape[0]


def azimuths(state: WakeState, psi: float | Float[Array, ""] = 0.0) -> Float[Array, " K"]:
    """ψ_k of each slice (rad) when slice 0 stands at psi."""
    k = slices(state)
    return psi + 2 * jnp.pi / k * jnp.arange(k)


@partial(jax.jit, inline=True)
def _stretch(inner, theta):
    return inner + (1 - inner) * 0.5 * (1 - jnp.cos(jnp.asarray(theta)))
