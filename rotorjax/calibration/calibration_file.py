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

from collections.abc import Mapping
from dataclasses import dataclass, field
from json import dumps
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax import __version__
from rotorjax.calibration import hayden, measured, taught
from rotorjax.calibration.fit import Fit
from rotorjax.calibration.parameters import ParameterSet
from rotorjax.checks import Range, shown
from rotorjax.errors import InputError
from rotorjax.io.atomic import write_text
from rotorjax.io.toml_file import OTHERS, Key, Schema, Tables, read_toml, value_of
from rotorjax.potential.model import FiniteState, FiniteStateModel, steady_state

MODEL_VERSION = 2  # raised when the finite-state equations change so that fitted values no longer mean the same
SETS: dict[str, ParameterSet] = {s.name: s for s in (hayden.PARAMETERS, taught.PARAMETERS, measured.PARAMETERS)}
_COUNT = Key("whole number", Range(1, 1000))
SCHEMA: Schema = {
    "calibration": {
        "set": Key("text", required=True),
        "model_version": Key("whole number", Range(1, 1e6), required=True),
        "rotorjax": Key("text", required=True),
        "converged": Key("true or false", required=True),
        "rms_error": Key("number", Range(0.0), required=True),
    },
    "parameters": {OTHERS: Key("number")},
    "fitted_with": {
        "radial_terms": _COUNT,
        "source_terms": _COUNT,
        OTHERS: Key("anything"),
    },  # what a reader wants to know
}


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
    return read_toml(path, SCHEMA, _build)


def _build(content: Tables, folder: Path) -> Calibration:
    del folder
    head = content["calibration"]
    if head["model_version"] != MODEL_VERSION:
        raise InputError(
            f"the file must be for model version {MODEL_VERSION}, but is for {head['model_version']}: calibrate again"
        )
    if head["set"] not in SETS:
        raise InputError(f"[calibration] set must be one of {', '.join(SETS)}, but is {shown(head['set'])}")
    given = _parameters(SETS[head["set"]], content.get("parameters", {}))
    return Calibration(head["set"], given, head["converged"], head["rms_error"], content.get("fitted_with", {}))


def _parameters(parameters: ParameterSet, given: dict[str, Any]) -> dict[str, float]:
    if set(given) != set(parameters.names):
        raise InputError(
            f"[parameters] must hold {', '.join(parameters.names)}, but holds {', '.join(given) or 'nothing'}"
        )
    keys = {p.name: Key("number", Range(float(p.lower), float(p.upper))) for p in parameters.parameters}
    return {name: value_of(f"[parameters] {name}", given[name], key) for name, key in keys.items()}


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


def fit_entry(fit: Fit, name: str, printed_rms: float) -> dict[str, Any]:
    """The keys that both calibrations share; name: of the parameter set."""
    return {
        "set": name,
        "model_version": MODEL_VERSION,
        "parameters": fit.parameters.table(fit.values),
        "printed": fit.parameters.table(fit.parameters.printed),
        "standard_deviations": fit.parameters.table(np.asarray(fit.deviations)),
        "covariance": fit.covariance,
        "rms_error": fit.rms,
        "rms_error_printed_factor": printed_rms,
        "converged": fit.converged,
        "why": fit.why,
        "at_bound": fit.at_bound,
        "method": fit.method,
        "steps": len(fit.history) - 1,
        "history": fit.history,
        "wall_time_s": fit.wall_time_s,
        "compile_time_s": fit.compile_time_s,
    }
