"""The paper's own wake as a named set of settings, for comparison."""

from typing import Any

from rotorjax.wake.settings import WakeSettings, wake_settings


def paper_settings(**overrides) -> WakeSettings:
    """A single tip vortex, from the last outboard node of the near wake, and a lattice with a core of 0.05 R.

    As the text below Eq. 13 and the section on the near wake have it: strength by the (smooth) maximum of the bound
    circulation, no inboard filament, the same core in the lattice whether nodes or blades look at it, and the downwash
    read at the lifting line. It converges, in and out of ground effect, and is not what a rotor does: without the
    inboard vorticity of the other sense the root is washed out and the load goes to the tip (docs/free_wake.md).

    Raises InputError where a setting is out of range.
    """
    core = 0.05
    cores = {"tip_core": core, "near_core": core, "control_core": core}
    paper: dict[str, Any] = {"roll_up": "paper", "inboard": (), "control_chords": 0.0, **cores}
    return wake_settings(**{**paper, **overrides})
