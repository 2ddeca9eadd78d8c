"""Differentiable rotor inflow near the ground: a finite-state model and a free vortex wake in JAX.

    import rotorjax as rj

    uh60, hover = rj.rotor("uh60", collective_deg=18.0)
    wake = rj.solve(rj.free_wake(uh60, hover, rj.plane(1.0)))
    print(wake.CT, rj.performance(wake).thrust)

What the door offers is imported when it is first asked for; `jax.config` is left alone (x64 is the caller's to enable).
"""

from importlib import import_module
from typing import Any

__version__ = "0.2.0"

_DOOR = {  # name: room, and what it is called there if not the same
    "finite_state": "rotorjax.api.models",
    "Solved": "rotorjax.api.solved",
    "solve": "rotorjax.api.solved",
    "velocity": "rotorjax.api.solved",
    "performance": "rotorjax.api.solved",
    "linearise": "rotorjax.api.applications",
    "modes": "rotorjax.linearisation.modes",
    "simulate": "rotorjax.api.applications",
    "march": "rotorjax.api.applications",
    "calibrate": "rotorjax.api.applications",
    "evaluate": "rotorjax.api.applications",
    "over_deck": "rotorjax.api.applications",
    "save_mat": "rotorjax.ode.export",
    "to_control": "rotorjax.ode.export",
    "inflow_table": "rotorjax.sweep.inflow_table",
    "InputError": "rotorjax.errors",
    "plane": "rotorjax.ground",
    "OperatingPoint": "rotorjax.operating",
    "operating_point": "rotorjax.operating",
    "steady": "rotorjax.potential.model:steady_state",
    "names": "rotorjax.rotor.catalogue",
    "make_rotor": "rotorjax.rotor.geometry:rotor",
    "free_wake": "rotorjax.wake.model",
    "several_wakes": "rotorjax.wake.several",
    "box": "rotorjax.panels.shapes",
    "slab": "rotorjax.panels.shapes",
    "wall": "rotorjax.panels.shapes",
    "terrain": "rotorjax.panels.shapes",
    "read_stl": "rotorjax.panels.stl",
    "WakeSettings": "rotorjax.wake.settings",
    "flight_settings": "rotorjax.wake.settings",
    "hover_settings": "rotorjax.wake.settings",
    "quick_settings": "rotorjax.wake.settings",
}
# `rotor`, `trim` and `sweep` are rooms too: called, they are the door's functions of that name (their __init__.py)
_CALLED_ROOMS = ("rotor", "trim", "sweep")
__all__ = [*_DOOR, *_CALLED_ROOMS]  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Fetch what the door offers from its room."""
    if name in _DOOR:
        room, _, there = _DOOR[name].partition(":")
        return getattr(import_module(room), there or name)
    if name in _CALLED_ROOMS:
        return import_module(f"rotorjax.{name}")
    raise AttributeError(f"module 'rotorjax' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(["__version__", *__all__])
