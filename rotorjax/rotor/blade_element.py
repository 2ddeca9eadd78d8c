"""Section loads of a blade and what they add up to, in rotor units.

Velocities are over ΩR, lengths over R, circulation over ΩR², forces per length over ρΩ²R³. u_T is the air's velocity
over the blade from leading to trailing edge, in the disk plane; u_P is its velocity down through the disk (inflow,
climb, flapping up).

    inflow angle φ = atan2(u_P, u_T),  α = θ − φ,  θ = collective + twist
    Γ = ½ |u| c cl (Kutta–Joukowski: L = ρ|u|Γ),  L = ½ u² c cl,  D = ½ u² c cd

Sweep enters in two ways. The quarter chord's place is `geometry.sweep_offset`; whoever traces the lifting line uses it.
The sections themselves take no notice by default: tables are entered with angle and Mach number along the flow.
`simple_sweep=True` applies the rule of infinite swept wings (Jones, NACA TR 863): cl = cos²Λ · cl(α_n, M cos Λ) with
tan α_n = tan α/cos Λ, and cd at the same entry, unreduced since friction follows the whole stream. Off by default
because on the UH-60 it concerns the last 7 % of the span, where a tip is anything but an infinite wing, and neither the
paper nor the tables' source applies it.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.operating import OperatingPoint
from rotorjax.rotor import geometry
from rotorjax.rotor.airfoil import lift_drag
from rotorjax.rotor.geometry import Rotor


class SectionLoads(eqx.Module):
    """What a blade section does; every field [*n], the shape of the velocities.

    cl, cd. circulation: Γ/(ΩR²). dlift, ddrag: force per length over ρΩ²R³, across and along the local flow. alpha,
    inflow_angle: rad. mach: local.
    """

    cl: Float[Array, "*n"]
    cd: Float[Array, "*n"]
    circulation: Float[Array, "*n"]
    dlift: Float[Array, "*n"]
    ddrag: Float[Array, "*n"]
    alpha: Float[Array, "*n"]
    inflow_angle: Float[Array, "*n"]
    mach: Float[Array, "*n"]


class RotorCoefficients(NamedTuple):
    """Thrust T/(ρA(ΩR)²) and power P/(ρA(ΩR)³), equal to the torque coefficient; power = induced + profile.

    The induced part holds whatever the lift has to be dragged against: induced inflow and climb together.
    """

    thrust: Float[Array, ""]
    power: Float[Array, ""]
    induced: Float[Array, ""]
    profile: Float[Array, ""]


def section_loads(
    rotor: Rotor,
    operating: OperatingPoint,
    r: Float[Array, "*#n"],
    u_tangential: Float[Array, "*n"],
    u_perpendicular: Float[Array, "*n"],
    collective: Float[Array, "*#n"] | None = None,
    *,
    simple_sweep: bool = False,
    span_mean: Float[Array, "R R"] | None = None,
    chord_downwash: Float[Array, "*n"] | float = 0.0,
) -> SectionLoads:
    """Loads of sections at r (over R) in the velocities u_T, u_P (over ΩR).

    collective: pitch without twist (rad), the operating point's by default; give θ₀ + θ₁c cos ψ + θ₁s sin ψ for cyclic
    pitch. span_mean: matrix that averages along the span (`span_averages`); then the last axis is the span and stall
    follows the averaged angle. chord_downwash: further downwash (over ΩR) that a section sees at three quarters of its
    chord, where it decides the lift, and not at the quarter chord, where the force acts: α = θ − atan2(u_P + it, u_T),
    while lift stays across the flow (u_T, u_P). Broadcasts; a section in still air (u_T = u_P = 0) carries no load and
    has finite derivatives.
    """
    u_t, u_p = jnp.broadcast_arrays(u_tangential, u_perpendicular)
    pitch = (operating.collective if collective is None else collective) + geometry.twist(rotor, r)
    still = (u_t == 0) & (u_p == 0)
    # atan2 and the square root have no derivative at the origin: move the input, not the output.
    safe_t = jnp.where(still, 1.0, u_t)
    phi = jnp.arctan2(u_p, safe_t)
    speed = jnp.where(still, 0.0, jnp.sqrt(safe_t**2 + u_p**2))
    alpha = pitch - jnp.arctan2(u_p + chord_downwash, safe_t)
    mach = speed * operating.tip_mach(rotor.radius)
    look_up = partial(_coefficients, rotor, r, mach=mach, simple_sweep=simple_sweep)
    cl, cd = look_up(alpha) if span_mean is None else _averaged(look_up, alpha, span_mean)
    half_chord = 0.5 * geometry.chord(rotor, r)
    dynamic = half_chord * (u_t**2 + u_p**2)
    return SectionLoads(
        cl=cl,
        cd=cd,
        circulation=half_chord * speed * cl,
        dlift=dynamic * cl,
        ddrag=dynamic * cd,
        alpha=alpha,
        inflow_angle=phi,
        mach=mach,
    )


def _averaged(
    look_up: Callable[[Array], tuple[Array, Array]], alpha: Float[Array, "*n R"], span_mean: Float[Array, "R R"]
) -> tuple[Array, Array]:
    """Lift and drag whose stall follows the angle averaged along the span."""
    entry = mean_angle(alpha, span_mean)
    # one look-up for the sections' own angles and, at zero angle, for the slope where the flow is attached
    angles = entry * np.array([0.0, 1.0], entry.dtype).reshape(2, *(1,) * entry.ndim)
    (cl, cd), (slope, _) = jax.jvp(look_up, (angles,), (jnp.ones_like(angles),))
    return cl[1] + slope[0] * _limited(alpha - entry), cd[1]


def attached_slope(rotor: Rotor, operating: OperatingPoint, speed: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """Lift slope (per rad) of sections at zero angle, at speeds over ΩR: that of `section_loads` where the angle varies
    from panel to panel and the mean along the span is kept.
    """
    mach = speed * operating.tip_mach(rotor.radius)
    nothing = jnp.zeros_like(mach)
    return jax.jvp(lambda alpha: lift_drag(rotor.airfoil, alpha, mach)[0], (nothing,), (jnp.ones_like(mach),))[1]


def span_averages(r: Float[Array, " R"], widths: Float[Array, " R"], length: Float[Array, " R"]) -> Float[Array, "R R"]:
    """Matrix that takes a Gaussian mean along the span about each section; all lengths over R.

    widths: panel widths. length: standard deviation at each section. A straight line in r is kept exactly inside the
    span, and at its ends too: weights are those of local linear regression. For `section_loads`: a polar is the answer
    of a whole stretch of wing, and separation does not come and go within a chord of span. Entered panel by panel, a
    falling lift curve makes lifting-line theory ill-posed: narrow panels stall and recover in turn, with several
    solutions and none (folds). Averaged, local differences keep the attached slope and stall follows the mean.
    """
    gap = r[None, :] - r[:, None]
    weight = widths * jnp.exp(-0.5 * (gap / length[:, None]) ** 2)
    total, first, second = jnp.sum(jnp.stack([weight, weight * gap, weight * gap**2]), axis=-1, keepdims=True)
    return weight * (second - first * gap) / (second * total - first**2)


def mean_angle(alpha: Float[Array, "*n R"], average: Float[Array, "R R"]) -> Float[Array, "*n R"]:
    """Means of angles of attack (rad) along the span, about each section's own, by the matrix of `span_averages`.

    Angles repeat after a turn, so a mean of the numbers would jump where one section of a blade in reversed flow passes
    from π to −π. Differences up to 1 rad count in full; a section whose flow comes from the other side counts for
    nothing, for it does not stall with this one.
    """
    apart = alpha[..., None, :] - alpha[..., :, None]
    apart = apart - 2 * jnp.pi * jnp.round(apart / (2 * jnp.pi))
    t = jnp.clip((jnp.pi - jnp.abs(apart)) / (jnp.pi - 1), 0.0, 1.0)
    return alpha + jnp.sum(average * apart * t**3 * (10 - 15 * t + 6 * t**2), axis=-1)


def _limited(difference: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """A section's angle less the mean about it as far as lift follows it as if attached: in full to 0.2 rad, then
    levelling off (C2) at 0.3.
    """
    above = jnp.maximum(jnp.abs(difference) - 0.2, 0.0)
    return jnp.clip(difference, -0.2, 0.2) + jnp.sign(difference) * 0.1 * jnp.tanh(above / 0.1)


def lifting_share(rotor: Rotor, widths: Float[Array, " R"]) -> Float[Array, " R"]:
    """Share of each panel that lies inboard of the rotor's tip loss, (R,); widths: over R, of panels up to the tip.

    Beyond `tip_loss` blade elements have no lift, only drag: what an inflow of infinitely many blades leaves out.
    """
    inner = 1 - jnp.cumsum(widths[::-1])[::-1]
    return jnp.clip((rotor.tip_loss - inner) / widths, 0.0, 1.0)


def disk_loading(rotor: Rotor, loads: SectionLoads) -> Float[Array, "*n"]:
    """dC_T/dr̄ of Eq. 17, (1/π) Σ_q L_q/(ρΩ²R³), where every blade carries `loads`: the distribution over (r, ψ).

    Its mean over the azimuth is Eq. 17's dC_T/dr̄, because the blades pass every azimuth in turn. Shape of the loads.
    """
    return rotor.blades / jnp.pi * loads.dlift


def mean_disk_loading(rotor: Rotor, loads: SectionLoads) -> Float[Array, " R"]:
    """Azimuth mean of `disk_loading` for loads of shape [..., R]: every axis but the last is averaged over."""
    loading = disk_loading(rotor, loads)
    return jnp.mean(loading.reshape(-1, loading.shape[-1]), axis=0)


def rotor_coefficients(
    rotor: Rotor, loads: SectionLoads, r: Float[Array, " R"], widths: Float[Array, " R"]
) -> RotorCoefficients:
    """C_T and C_P = C_Q from loads of shape [..., R] at r with quadrature weights `widths` (both over R).

    Thrust L cos φ − D sin φ; power r(L sin φ) induced and r(D cos φ) profile, times B/π, averaged over every axis but
    the last.
    """
    lift, drag, phi = loads.dlift, loads.ddrag, loads.inflow_angle

    def total(per_length):
        return rotor.blades / jnp.pi * jnp.mean(jnp.sum(per_length * widths, axis=-1))

    induced = total(r * lift * jnp.sin(phi))
    profile = total(r * drag * jnp.cos(phi))
    thrust = total(lift * jnp.cos(phi) - drag * jnp.sin(phi))
    return RotorCoefficients(thrust, induced + profile, induced, profile)


def _coefficients(rotor, r, alpha, mach, simple_sweep):
    if not simple_sweep:
        return lift_drag(rotor.airfoil, alpha, mach)
    cosine = jnp.cos(rotor.sweep(r))
    normal = jnp.arctan2(jnp.sin(alpha), jnp.cos(alpha) * cosine)
    cl, cd = lift_drag(rotor.airfoil, normal, mach * cosine)
    return cosine**2 * cl, cd
