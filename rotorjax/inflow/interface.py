"""What an inflow model is to a coupled rotor: a state, the velocity at the blades, and a rate from the blades' loads.

Rotor units: lengths over R, velocities over Ω_ref R, time as Ω_ref t (rad). Hub frame: x aft, y to starboard, z up.
"""

from abc import abstractmethod
from typing import NamedTuple

import equinox as eqx
from jaxtyping import Array, Float, PyTree

from rotorjax.rotor.hub import RotorInputs


class DiskLoads(NamedTuple):
    """What the blades do to the air at one instant, seen from the hub.

    lift (B, R): force along the shaft per length, over ρΩ²R³, on the blades. points (B, R, 3): where. widths (R,): of
    the blade sections. psi (B,): azimuths. r (R,): stations, all over R. thrust (): C_T of the air.
    """

    lift: Float[Array, "B R"]
    points: Float[Array, "B R 3"]
    widths: Float[Array, " R"]
    psi: Float[Array, " B"]
    r: Float[Array, " R"]
    thrust: Float[Array, ""]


class InflowModel(eqx.Module):
    """An inflow model. A free wake fits in as well: its state is the wake, its velocity that of Biot and Savart."""

    @abstractmethod
    def start(self, thrust: Float[Array, ""], inputs: RotorInputs) -> PyTree:
        """State near the steady one of a rotor of this C_T: where solvers begin."""

    @abstractmethod
    def velocity(self, state: PyTree, points: Float[Array, "*n 3"], inputs: RotorInputs) -> Float[Array, "*n 3"]:
        """Induced velocity at points near the disk, hub frame."""

    @abstractmethod
    def rate(self, state: PyTree, loads: DiskLoads, inputs: RotorInputs) -> PyTree:
        """Rate of the state per radian of Ω_ref t."""
