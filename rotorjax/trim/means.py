"""What a trim comes to over a revolution, with any inflow."""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.rotor.flap_lag import damper_moment
from rotorjax.rotor.moving_blade import AirLoads
from rotorjax.trim.free_wake import InWake, WakeTrim, flown, harmonic, hub_moment, loads_of, weight_torque
from rotorjax.trim.in_wake import TrimmedInWake
from rotorjax.trim.problem import cyclic, outputs_at
from rotorjax.trim.solve import Trimmed
from rotorjax.wake.equilibrium import Evaluation, evaluate


@dataclass(frozen=True)
class Means:
    """Means over the azimuth: thrust and powers over ρA(ΩR)² and ρA(ΩR)³, flapping β₀, β₁c, β₁s and lagging ζ₀, ζ₁c,
    ζ₁s (rad), moment (3,) on the hub over ρA(ΩR)²R, hub frame; controls θ₀, θ₁c, θ₁s and the shaft's tilt (rad).
    """

    CT: float
    CQ: float
    CP_induced: float
    CP_profile: float
    CP_parasite: float
    CP_damper: float
    flap: np.ndarray
    lag: np.ndarray
    moment: np.ndarray
    controls: np.ndarray


def means(found: Trimmed | TrimmedInWake) -> Means:
    """Performance of a trim."""
    return _in_wake(found) if isinstance(found, TrimmedInWake) else _in_model(found)


def _in_model(found: Trimmed) -> Means:
    out, z = jax.tree.map(np.asarray, outputs_at(found.z, found.flight, found.p)), found.z.controls
    powers = ("CT", "CQ", "CP_induced", "CP_profile", "CP_parasite", "CP_damper")
    return Means(
        **{name: float(np.mean(getattr(out, name))) for name in powers},
        flap=np.array([float(np.mean(out.flap)), *map(float, cyclic(out.flap))]),
        lag=np.array([float(np.mean(out.lag)), *map(float, cyclic(out.lag))]),
        moment=np.mean(out.moment, axis=0),
        controls=np.array([float(v) for v in (z.theta_0, z.theta_1c, z.theta_1s, z.tilt)]),
    )


def _in_wake(found: TrimmedInWake) -> Means:
    _, loads = evaluated(found.z, found.p)
    z, p, blades = found.z, found.p, found.p.model.rotor.blades
    model = found.model
    flight = model.flight
    assert flight is not None
    assert flight.lag_rate is not None
    place = jax.vmap(lambda k: model.of_slice(k).control)(jnp.arange(z.flap.shape[0]))
    torque = jnp.cross(place, loads.per_length)[..., 2] @ model.widths + weight_torque(z.flap, z.lag, p)
    psi = 2 * jnp.pi / z.flap.shape[0] * jnp.arange(z.flap.shape[0])

    def mean(power) -> float:
        return float(blades / jnp.pi * jnp.mean(power))

    force = loads.force
    along = force[:, 0] * jnp.cos(psi) - force[:, 1] * jnp.sin(psi)
    across = force[:, 0] * jnp.sin(psi) + force[:, 1] * jnp.cos(psi)
    hub = jnp.stack([along, across, force[:, 2]], axis=-1)
    return Means(
        CT=mean(force[:, 2]),
        CQ=mean(-torque),
        CP_induced=mean(loads.induced),
        CP_profile=mean(loads.profile),
        CP_parasite=mean(hub @ p.inputs.velocity),
        CP_damper=mean(damper_moment(p.blade, flight.lag_rate) * flight.lag_rate / p.blade.air),
        flap=np.asarray(harmonic(z.flap)),
        lag=np.asarray(harmonic(z.lag)),
        moment=np.asarray(hub_moment(z.flap, z.lag, loads, p)),
        controls=np.array([*z.controls, 0.0 if p.inputs.pitch is None else -p.inputs.pitch]),
    )


@eqx.filter_jit
def evaluated(z: InWake, p: WakeTrim) -> tuple[Evaluation, AirLoads]:
    """Wake and air loads of unknowns."""
    model = flown(z, p)
    found = evaluate(model, z.wake)
    return found, loads_of(model, found)
