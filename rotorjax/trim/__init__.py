"""Trim: the controls and the periodic motion of a rotor in steady flight, found together.

Called, as in `rotorjax.trim(rotor, operating, 0.00575)`, it finds one (rotorjax/api/applications.py).
"""

import sys
from types import ModuleType
from typing import Any


class _Trim(ModuleType):
    """The room and the door's function of one name."""

    def __call__(self, *arguments: Any, **more: Any) -> Any:
        from importlib import import_module  # the door stands above this room

        return import_module("rotorjax.api.applications").trim(*arguments, **more)


sys.modules[__name__].__class__ = _Trim
