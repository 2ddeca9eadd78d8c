"""What a study computes: rotor, operating point and the settings of both models, with a fingerprint of them all."""

import hashlib
import inspect
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax import __version__
from rotorjax.checks import Range, check_number
from rotorjax.errors import InputError
from rotorjax.io.toml_file import Key
from rotorjax.operating import OperatingPoint
from rotorjax.potential.model import choices, finite_state_model
from rotorjax.rotor import catalogue
from rotorjax.rotor.geometry import Rotor
from rotorjax.wake.settings import WakeSettings, hover_settings, quick_settings, wake_settings

WAKE_KEYS = {
    name: Key("whole number" if parameter.annotation is int else "number", Range(-1e6, 1e6))
    for name, parameter in inspect.signature(wake_settings).parameters.items()
    if name not in ("inboard", "roll_up", "bound_filter", "pair_sums")
}
"""The free wake's settings as a case file's `[wake]` may hold them."""


@dataclass(frozen=True)
class StudySettings:
    """Everything that decides a case's result but its height and slope.

    rotor, operating, wake: as the models take them. radial_terms: pressure terms of each harmonic (3: τ₁, τ₃, τ₅).
    harmonics: highest harmonic of the VPBFSM's loading and ground sources on a slope; level ground needs none.
    source_terms: ground source terms of each harmonic (seven leave 2 % of the flow on the ground, five 4 %).
    flapping: whether the blades are free to flap.
    """

    rotor: Rotor
    operating: OperatingPoint
    wake: WakeSettings
    radial_terms: int = 3
    harmonics: int = 1
    source_terms: int = 7
    flapping: bool = False

    @property
    def collective_deg(self) -> float:
        """Collective pitch in degrees."""
        return float(np.rad2deg(self.operating.collective))

    @property
    def climb_ratio(self) -> float:
        """Climb velocity over ΩR."""
        return float(self.operating.climb_ratio(self.rotor.radius))

    def table(self) -> dict[str, Any]:
        """Settings by name, as plain values: for files, the report and the fingerprint."""
        wake = {f"wake.{name}": _plain(getattr(self.wake, name)) for name in _fields(self.wake)}
        air = {f"operating.{name}": _plain(getattr(self.operating, name)) for name in _fields(self.operating)}
        return {
            "rotorjax": __version__,
            "rotor": self.rotor.name,
            "rotor.digest": _digest(self.rotor),
            "collective_deg": round(self.collective_deg, 9),
            "blades": "flapping" if self.flapping else "rigid",
            **air,
            "vpbfsm.radial_terms": self.radial_terms,
            "vpbfsm.harmonics": self.harmonics,
            "vpbfsm.source_terms": self.source_terms,
            **{f"vpbfsm.{name}": _plain(value) for name, value in choices(finite_state_model()).items()},
            **wake,
        }

    def fingerprint(self) -> str:
        """Twelve characters that change with any setting, the rotor's tables included."""
        return _sha(repr(sorted(self.table().items())).encode())


def study_settings(
    rotor: str | Path = "uh60",
    collective_deg: float | None = None,
    climb_ratio: float = 0.0,
    harmonics: int = 1,
    quick: bool = False,
    flapping: bool = False,
    **wake: Any,
) -> StudySettings:
    """Make settings from plain values; `wake` overrides settings of the free wake.

    rotor: name in the catalogue or a TOML file. collective_deg: None takes the rotor file's (18 for the UH-60, the
    paper's). climb_ratio: climb velocity over ΩR. quick: the coarser free wake. flapping: blades free to flap,
    where the rotor has hinge data; rigid otherwise. Raises InputError where a value is not allowed.
    """
    return settings_of(*catalogue.load(rotor), collective_deg, climb_ratio, harmonics, quick, flapping, **wake)


def settings_of(
    body: Rotor,
    operating: OperatingPoint,
    collective_deg: float | None = None,
    climb_ratio: float = 0.0,
    harmonics: int = 1,
    quick: bool = False,
    flapping: bool = False,
    **wake: Any,
) -> StudySettings:
    """Make settings as `study_settings` does, of a rotor that is loaded and its operating point."""
    check_number("climb", climb_ratio, -0.5, 0.5)
    if harmonics != int(harmonics) or not 1 <= harmonics <= 4:
        raise InputError(f"Argument `harmonics` must be a whole number from 1 to 4, but is {harmonics}")
    if collective_deg is not None:
        check_number("collective", collective_deg, -45.0, 45.0)
        operating = eqx.tree_at(lambda o: o.collective, operating, jnp.deg2rad(jnp.asarray(collective_deg, float)))
    if climb_ratio:
        operating = eqx.tree_at(lambda o: o.climb, operating, climb_ratio * operating.tip_speed(body.radius))
    numbers = (quick_settings if quick else hover_settings)(**wake).for_blades(body.blades)
    return StudySettings(body, operating, numbers, harmonics=harmonics, flapping=flapping and body.hinge is not None)


def differences(ours: dict[str, Any], theirs: dict[str, Any]) -> list[str]:
    """How two tables of settings differ, in words."""
    names = sorted(set(ours) | set(theirs))
    return [f"{n} {theirs.get(n)} instead of {ours.get(n)}" for n in names if ours.get(n) != theirs.get(n)]


def _fields(module: eqx.Module) -> list[str]:
    return list(module.__dataclass_fields__)


def _plain(value: Any) -> Any:
    if isinstance(value, jax.Array | np.ndarray):
        value = np.asarray(value, float)
        return float(f"{value:.12g}") if value.ndim == 0 else [float(f"{v:.12g}") for v in value.ravel()]
    return list(value) if isinstance(value, tuple) else value


def _digest(tree: Any) -> str:
    leaves, structure = jax.tree_util.tree_flatten(tree)
    return _sha(repr(structure).encode() + b"".join(np.asarray(leaf, np.float64).tobytes() for leaf in leaves))


def _sha(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:12]
