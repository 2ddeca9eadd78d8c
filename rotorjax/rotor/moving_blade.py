"""The air's loads on blades that flap and lag on a moving hub: sections in their own unsteady relative velocity.

Stations lie at r on the straight blade; on the moved one a section stands at e x̂ + (r − e) n (flap_lag.py). Its axes
are n outboard, t = −∂n/∂ζ / cos β in the sense of rotation and k = ∂n/∂β up. The relative velocity along n is left
out, as blade-element theory does.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.operating import OperatingPoint
from rotorjax.rotor.blade_element import SectionLoads, lifting_share, section_loads
from rotorjax.rotor.flap_lag import Blade, Motion, hinge_velocity
from rotorjax.rotor.geometry import Rotor
from rotorjax.rotor.hub import TurningFrame


class Sections(NamedTuple):
    """Blade sections. r, widths (R,): middles and widths of panels, over R. lifting (R,): share inboard of tip loss."""

    r: Float[Array, " R"]
    widths: Float[Array, " R"]
    lifting: Float[Array, " R"]


class AirLoads(NamedTuple):
    """The air's work on one blade, in the axes of its turning frame.

    per_length (R, 3): force over ρΩ²R³, tip loss included. force (3,): over ρΩ²R⁴. moment (3,): ∫ s f ds about the
    hinge, over ρΩ²R⁵, without the lever's direction: n × moment is the moment. induced, profile (): power that goes
    into the induced velocity and into drag, over ρΩ³R⁵. loads: of the sections, without tip loss.
    """

    per_length: Float[Array, "R 3"]
    force: Float[Array, "3"]
    moment: Float[Array, "3"]
    induced: Float[Array, ""]
    profile: Float[Array, ""]
    loads: SectionLoads


@partial(jax.jit, static_argnames="panels", inline=True)
def blade_sections(rotor: Rotor, panels: int = 24) -> Sections:
    """Cut the aerofoil part of a blade into equal panels."""
    share = jnp.asarray(np.linspace(0.0, 1.0, panels + 1))
    edges = rotor.root_cutout + (1 - rotor.root_cutout) * share
    widths = jnp.diff(edges)
    return Sections(0.5 * (edges[1:] + edges[:-1]), widths, lifting_share(rotor, widths))


def places(blade: Blade, motion: Motion, r: Float[Array, " R"]) -> Float[Array, "R 3"]:
    """Where the sections are, over R, in the axes of the turning frame."""
    return (r - blade.offset)[:, None] * motion.n + jnp.array([1.0, 0.0, 0.0]) * blade.offset


def air_loads(
    rotor: Rotor,
    operating: OperatingPoint,
    blade: Blade,
    sections: Sections,
    frame: TurningFrame,
    motion: Motion,
    pitch: Float[Array, ""],
    induced: Float[Array, "R 3"],
) -> AirLoads:
    """Loads of one blade. pitch: without twist, pitch-flap coupling included (rad). induced: velocity of the air at the
    sections, over Ω_ref R, in the axes of the turning frame.
    """
    arm = (sections.r - blade.offset)[:, None]
    blade_velocity = hinge_velocity(blade, frame) + arm * (jnp.cross(frame.spin, motion.n) + motion.n_dot)
    up = motion.slope[:, 0]
    ahead = jnp.cross(up, motion.n)  # unit: n, ahead, up are orthonormal
    through = blade_velocity - induced
    loads = section_loads(rotor, operating, sections.r, through @ ahead, through @ up, pitch)
    lift, drag = loads.dlift * sections.lifting, loads.ddrag
    sine, cosine = jnp.sin(loads.inflow_angle), jnp.cos(loads.inflow_angle)
    per_length = (lift * cosine - drag * sine)[:, None] * up - (lift * sine + drag * cosine)[:, None] * ahead
    weighted = sections.widths[:, None] * per_length
    # drag works against the stream (u_T, u_P), the air's own motion takes the rest
    speed = cosine * (through @ ahead) + sine * (through @ up)
    return AirLoads(
        per_length,
        jnp.sum(weighted, axis=0),
        jnp.sum(weighted * arm, axis=0),
        -jnp.sum(weighted * induced),
        jnp.sum(sections.widths * drag * speed),
        loads,
    )
