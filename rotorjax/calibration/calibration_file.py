"""A calibration as a small TOML file, and what it does to a model.

[calibration]
set = "hayden"             # or "freewake", "wake": which parameters there are and what they mean
model_version = 2
rotorjax = "0.1.0"
converged = true
rms_error = 0.00355
[parameters]
radius = 0.7
clearance = 0.6
[fitted_with]
loading = "elliptic"
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from json import dumps
from math import isfinite
from pathlib import Path
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax import __version__
from rotorjax.calibration import hayden, measured, taught
from rotorjax.calibration.parameters import ParameterSet
from rotorjax.errors import InputError
from rotorjax.io.atomic import write_text
from rotorjax.potential.model import FiniteState, FiniteStateModel, steady_state

MODEL_VERSION = 2  # raised when the finite-state equations change so that fitted values no longer mean the same
SETS: dict[str, ParameterSet] = {s.name: s for s in (hayden.PARAMETERS, taught.PARAMETERS, measured.PARAMETERS)}
_HEAD = ("set", "model_version", "rotorjax", "converged", "rms_error")


@dataclass(frozen=True)
class Calibration:
    """Values of a whole parameter set, fitted or not.

    set: its name. parameters: value of every parameter by name. converged, rms_error: of the fit. fitted_with: plain
    values that a reader wants to know; of "freewake" the numbers of terms, which a model must share.
    """

    set: str
    parameters: Mapping[str, float]
    converged: bool
    rms_error: float
    fitted_with: Mapping[str, Any] = field(default_factory=dict)

    @property
    def values(self) -> Float[Array, " P"]:
        """The values in the order of the set."""
        return SETS[self.set].vector(self.parameters)

    @property
    def wake_settings(self) -> dict[str, float]:
        """Settings of the free wake that it changes, by name; none where it is of the finite-state model."""
        return dict(self.parameters) if self.set == "wake" else {}

    def apply(
        self, model: FiniteStateModel, tau: Float[Array, " M"], climb: Float[Array, ""] | float = 0.0
    ) -> tuple[FiniteStateModel, FiniteState]:
        """Return the calibrated model and its steady states for a loading; climb over ΩR.

        Raises InputError where the calibration is for a model of other numbers of terms, or for the free wake.
        """
        if self.set == "wake":
            raise InputError(
                "Argument `calibration` must be of the finite-state model, but is of the free wake's settings: "
                "`rotorjax inflow` and `rotorjax study` solve the free wake with it"
            )
        if self.set == "hayden":
            model = hayden.with_wake(model, self.values)
            return model, steady_state(model, tau, jnp.asarray(climb, float))
        for name, ours in {"radial_terms": _radial_terms(model), "source_terms": _source_terms(model)}.items():
            if (theirs := self.fitted_with.get(name, ours)) != ours:
                raise InputError(
                    f"Argument `calibration` must be fitted with the model's {name} = {ours}, but has {theirs}"
                )
        model = taught.taught_model(model, self.values)
        return model, taught.taught_state(model, tau, self.values, climb)


def save(path: str | Path, calibration: Calibration) -> None:
    """Write a whole file. Raises InputError where the folder cannot be written."""
    head = {
        "set": calibration.set,
        "model_version": MODEL_VERSION,
        "rotorjax": __version__,
        "converged": calibration.converged,
        "rms_error": calibration.rms_error,
    }
    tables = {"calibration": head, "parameters": calibration.parameters, "fitted_with": calibration.fitted_with}
    lines = [f"[{name}]\n" + "".join(f"{k} = {_toml(v)}\n" for k, v in table.items()) for name, table in tables.items()]
    write_text(path, "\n".join(lines))


def load(path: str | Path) -> Calibration:
    """Read a file.

    Raises InputError where it is not there, not a calibration, of another model version or parameter set, misses or
    adds a parameter, or a value is outside its range.
    """
    try:
        content = tomllib.loads(Path(path).read_text(encoding="utf-8"))
        head, given = dict(content["calibration"]), dict(content["parameters"])
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path}: the file must be a calibration in TOML, but cannot be read: {error}") from None
    except (KeyError, TypeError, ValueError):
        raise InputError(f"{path}: the file must hold [calibration] and [parameters], but does not") from None
    if missing := [n for n in _HEAD if n not in head]:
        raise InputError(f"{path}: [calibration] must hold {', '.join(_HEAD)}, but lacks {missing[0]}")
    if head["model_version"] != MODEL_VERSION:
        raise InputError(
            f"{path}: the file must be for model version {MODEL_VERSION}, but is for {head['model_version']}: "
            "calibrate again"
        )
    if head["set"] not in SETS:
        raise InputError(f"{path}: the parameter set must be one of {', '.join(SETS)}, but is {head['set']!r}")
    _check_parameters(path, SETS[head["set"]], given)
    fitted_with = content.get("fitted_with", {})
    return Calibration(head["set"], given, bool(head["converged"]), float(head["rms_error"]), fitted_with)


def _check_parameters(path: str | Path, parameters: ParameterSet, given: dict[str, Any]) -> None:
    if set(given) != set(parameters.names):
        raise InputError(
            f"{path}: [parameters] must hold {', '.join(parameters.names)}, but holds {', '.join(given) or 'nothing'}"
        )
    for p in parameters.parameters:
        value = given[p.name]
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
            raise InputError(f"{path}: `{p.name}` must be a finite number, but is {value!r}")
        if not p.lower <= value <= p.upper:
            raise InputError(f"{path}: `{p.name}` must lie in [{p.lower:g}, {p.upper:g}], but is {value:g}")


def _toml(value: Any) -> str:
    """A plain value in TOML; strings and lists are written as in JSON, which TOML shares."""
    if isinstance(value, str | list | tuple):
        return dumps(list(value) if isinstance(value, tuple) else value, ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, int) else repr(float(value))


def _radial_terms(model: FiniteStateModel) -> int:
    return int(((model.modes.m == 0) & model.modes.odd).sum())


def _source_terms(model: FiniteStateModel) -> int:
    return int((model.sources.m == 0).sum())
