"""What is read off a rotor, by name: loads on the hub, blades seen from the hub, inflow over the disk, clearance.

Body axes: x forward, y to starboard, z down; of a rotor that turns clockwise port takes starboard's place.
"""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.coupled import Coupled, CoupledRotor, CoupledState, Outputs, RotorState, inflow_velocity, stations
from rotorjax.frames import disk_points, rotate_about_shaft, to_ellipsoidal
from rotorjax.ground import Plane, TurnedPlane
from rotorjax.inflow.finite_state import FiniteStateInflow
from rotorjax.linearisation.drive import Gusty
from rotorjax.rotor import multiblade
from rotorjax.rotor.hub import RotorInputs

LIFT = "lift"
UNITS = {
    **dict.fromkeys("XYZ", "ρA(ΩR)²"),
    **dict.fromkeys("LMN", "ρA(ΩR)²R"),
    "beta": "rad",
    "lag": "rad",
    "lambda": "ΩR",
    "clearance": "R",
    LIFT: "ρΩ²R³",
}
"""Unit of an output, by its name's part before the first underscore."""
SIDES = {"aft": 0.0, "starboard": np.pi / 2, "forward": np.pi, "port": 1.5 * np.pi}


def unit_of(name: str) -> str:
    """Unit of an output or of a rotor state."""
    return UNITS.get(name.partition("_")[0], "-")


def expanded(outputs: Sequence[str], count: int) -> tuple[str, ...]:
    """Names of single outputs: section loads have one for every of `count` stations."""
    several = {name: [f"{name}[{i}]" for i in range(count)] for name in outputs if name.startswith(LIFT)}
    return tuple(one for name in outputs for one in several.get(name, [name]))


def readings(psi: Array, x: CoupledState, out: Outputs, u: RotorInputs, p: Coupled) -> dict[str, Array]:
    """Every output of a rotor at one instant, with its name.

    CT: thrust of the air along the shaft over ρA(ΩR)²; CQ: torque of the shaft over ρA(ΩR)²R. X, Y, Z, L, M, N: force
    and moment on the hub in body axes. beta_0, beta_1c, beta_1s …, lag_0 …: blades in multi-blade coordinates.
    lambda_0, lambda_1c, lambda_1s: mean and gradients of the induced inflow over the disk, positive down.
    clearance_aft …: of the tips' path over the ground, where there is some. lift_0, lift_1c … (R,): section loads in
    multi-blade coordinates.
    """
    names = multiblade.names(p.rotor.blades)
    force, moment = to_ellipsoidal(out.force), to_ellipsoidal(out.moment)
    found = {"CT": out.CT, "CQ": out.CQ, **dict(zip("XYZLMN", [*force, *moment], strict=True))}
    for kind, motion in (("beta", x.rotor.flap), ("lag", x.rotor.lag)):
        found |= {f"{kind}_{name}": motion[k] for k, name in enumerate(names)}
    found |= dict(zip(("lambda_0", "lambda_1c", "lambda_1s"), _inflow(psi, x, u, p), strict=True))
    ground = _ground(u, p)
    if ground is not None:
        found |= {f"clearance_{side}": _clearance(angle, x.rotor, ground, p) for side, angle in SIDES.items()}
    lift = multiblade.inverse(psi, p.rotor.blades) @ out.lift
    return found | {f"{LIFT}_{name}": lift[k] for k, name in enumerate(names)}


def _inflow(psi: Array, x: CoupledState, u: RotorInputs, p: Coupled) -> Float[Array, "3"]:
    """Least-squares fit of λ_0 + λ_1c r cos ψ + λ_1s r sin ψ, over the disk or, in a free wake, along the blades."""
    if isinstance(p, CoupledRotor):
        nodes, weights = np.polynomial.legendre.leggauss(10)
        r, width, around = (
            jnp.asarray((nodes + 1) / 2),
            jnp.asarray(weights / 2),
            jnp.asarray(np.arange(12) * np.pi / 6),
        )
        points = disk_points(r, around[:, None])
    else:
        r, around = stations(p), multiblade.azimuths(psi, p.rotor.blades)
        width = jnp.diff(p.edges)
        points = _blades(x, r, around, p)
    down = -inflow_velocity(x, points.reshape(-1, 3), u, p)[:, 2].reshape(points.shape[:2])
    area = r * width / jnp.sum(r * width)
    shape = jnp.stack([jnp.ones_like(points[..., 0]), r * jnp.cos(around)[:, None], r * jnp.sin(around)[:, None]], -1)
    against = jnp.einsum("br,r,brc->c", down, area, shape) / around.size
    return against / jnp.einsum("r,brc->c", area, shape**2) * around.size


def _blades(x: CoupledState, r: Array, around: Array, p: Coupled) -> Float[Array, "B R 3"]:
    """Points along flapping blades, hub frame."""
    flap, _ = multiblade.to_blades(x.rotor.flap, x.rotor.flap_rate, x.psi, jnp.ones(()))
    arm = (r - p.blade.offset)[None]
    out = p.blade.offset + arm * jnp.cos(flap)[:, None]
    straight = jnp.stack([out, jnp.zeros_like(out), arm * jnp.sin(flap)[:, None]], axis=-1)
    return rotate_about_shaft(straight, around[:, None])


def _ground(u: RotorInputs, p: Coupled) -> Plane | None:
    """The ground as the hub sees it."""
    if u.height is None:
        return None
    inflow = p.inflow.inflow if isinstance(p, CoupledRotor) and isinstance(p.inflow, Gusty) else None
    plane = p.ground if not isinstance(p, CoupledRotor) else None
    if isinstance(inflow, FiniteStateInflow):
        plane = inflow.model.ground
    slope = jnp.zeros_like(u.height) if plane is None else plane.slope
    return Plane(u.height, slope) if u.turn is None else TurnedPlane(u.height, slope, u.turn)


def _clearance(angle: float, rotor: RotorState, ground: Plane, p: Coupled) -> Float[Array, ""]:
    """Distance of a tip that passes an azimuth, from the ground along its normal; the differential mode left out."""
    flap = rotor.flap[0]
    for k in range(1, (p.rotor.blades - 1) // 2 + 1):
        flap = flap + rotor.flap[2 * k - 1] * np.cos(k * angle) + rotor.flap[2 * k] * np.sin(k * angle)
    arm = 1 - p.blade.offset
    tip = jnp.stack([p.blade.offset + arm * jnp.cos(flap), jnp.zeros_like(flap), arm * jnp.sin(flap)])
    return ground.distance(rotate_about_shaft(tip, jnp.asarray(angle, flap.dtype)))
