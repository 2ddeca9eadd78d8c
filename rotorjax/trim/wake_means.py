"""What a trim in the free wake comes to, over a revolution."""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.rotor.flap_lag import damper_moment
from rotorjax.rotor.moving_blade import AirLoads
from rotorjax.trim.free_wake import InWake, WakeTrim, flown, harmonic, hub_moment, loads_of, weight_torque
from rotorjax.trim.in_wake import TrimmedInWake
from rotorjax.wake.equilibrium import Evaluation, evaluate


@dataclass(frozen=True)
class Means:
    """Means over the azimuth: thrust and powers over ρA(ΩR)² and ρA(ΩR)³, flapping β₀, β₁c, β₁s and lagging ζ₀, ζ₁c,
    ζ₁s (rad), moment (3,) on the hub over ρA(ΩR)²R, hub frame.
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


def means(found: TrimmedInWake) -> Means:
    """Performance of a trim."""
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
    )


@eqx.filter_jit
def evaluated(z: InWake, p: WakeTrim) -> tuple[Evaluation, AirLoads]:
    """Wake and air loads of unknowns."""
    model = flown(z, p)
    found = evaluate(model, z.wake)
    return found, loads_of(model, found)
