"""Sweeps: one command's case over a grid or a random design, each point from its best solved neighbour.

Called, as in `rotorjax.sweep("case.toml", "out")`, it runs one (rotorjax/api/applications.py).
"""

import sys
from types import ModuleType
from typing import Any


class _Sweep(ModuleType):
    """The room and the door's function of one name."""

    def __call__(self, *arguments: Any, **more: Any) -> Any:
        from importlib import import_module  # the door stands above this room

        return import_module("rotorjax.api.applications").sweep(*arguments, **more)


sys.modules[__name__].__class__ = _Sweep
