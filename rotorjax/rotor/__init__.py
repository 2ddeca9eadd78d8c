"""What a rotor is: geometry, airfoil tables, the catalogue and blade-element loads.

Called, as in `rotorjax.rotor("uh60")`, it loads one (rotorjax/api/models.py).
"""

import sys
from types import ModuleType
from typing import Any


class _Rotor(ModuleType):
    """The room and the door's function of one name."""

    def __call__(self, *arguments: Any, **more: Any) -> Any:
        from importlib import import_module  # the door stands above this room

        return import_module("rotorjax.api.models").rotor(*arguments, **more)


sys.modules[__name__].__class__ = _Rotor
