"""Handing linear models over: python-control, MATLAB, NetCDF. Files appear whole or not at all."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import xarray as xr

from rotorjax.errors import InputError
from rotorjax.io import netcdf
from rotorjax.io.atomic import write_bytes
from rotorjax.ode.models import LinearModel, Notes, PeriodicModel


def to_control(model: LinearModel) -> Any:
    """python-control StateSpace with the model's names.

    Raises InputError where python-control is not installed.
    """
    try:
        import control
    except ImportError as error:
        raise InputError(
            "Argument `model` needs python-control for this, but it is missing: pip install 'rotorjax[control]'"
        ) from error
    # Dots are its separator between systems and signals.
    names = {key: [name.replace(".", "_") for name in getattr(model, key)] for key in ("states", "inputs", "outputs")}
    return control.StateSpace(model.a, model.b, model.c, model.d, **names)


def _fields(model: LinearModel | PeriodicModel) -> dict[str, np.ndarray]:
    return {key.upper(): getattr(model, key) for key in ("a", "b", "c", "d")}


def save_mat(model: LinearModel | PeriodicModel, path: str | Path) -> Path:
    """Write A, B, C, D (times along the third axis where periodic, as in MATLAB), what deviations are counted from (x0,
    u0, y0), names, units, what time is and notes to a .mat file.

    Raises InputError where the folder does not exist or cannot be written.
    """
    content: dict[str, Any] = _fields(model)
    if isinstance(model, PeriodicModel):
        content = {key: np.moveaxis(value, 0, -1) for key, value in content.items()}
        content |= {"t": model.t, "period": model.period, "x": model.x.T, "u": model.u, "y": model.y.T}
    else:
        content |= {"x0": model.x, "u0": model.u, "y0": model.y}
    content |= {"time": model.time} | ({"notes": dict(model.notes)} if model.notes else {})
    for key in ("states", "inputs", "outputs", "state_units", "input_units", "output_units"):
        content[key] = np.array(getattr(model, key), dtype=object)
    file = io.BytesIO()
    scipy.io.savemat(file, content)
    write_bytes(path, file.getvalue())
    return Path(path)


def to_dataset(model: LinearModel | PeriodicModel) -> xr.Dataset:
    """Labelled xarray dataset: A (state, from_state), B (state, input), C (output, from_state), D (output, input)."""
    axes = {
        "A": ("state", "from_state"),
        "B": ("state", "input"),
        "C": ("output", "from_state"),
        "D": ("output", "input"),
    }
    lead = ("time",) if isinstance(model, PeriodicModel) else ()
    data = {key: (lead + axes[key], value) for key, value in _fields(model).items()}
    coords: dict[str, Any] = {
        "state": list(model.states),
        "from_state": list(model.states),
        "input": list(model.inputs),
        "output": list(model.outputs),
        "input_unit": ("input", list(model.input_units)),
        "output_unit": ("output", list(model.output_units)),
        "state_unit": ("state", list(model.state_units)),
    }
    attrs = {"time": model.time, **model.notes}
    if isinstance(model, PeriodicModel):
        coords["time"] = model.t
        data |= {"x": (("time", "state"), model.x), "y": (("time", "output"), model.y), "u": (("input",), model.u)}
        attrs["period"] = model.period
    else:
        data |= {"x0": (("state",), model.x), "u0": (("input",), model.u), "y0": (("output",), model.y)}
    return xr.Dataset(data, coords, attrs)


def periodic_of(data: xr.Dataset, notes: Notes) -> PeriodicModel:
    """The periodic model that `to_dataset` was given, with its notes."""

    def names(key: str) -> tuple[str, ...]:
        return tuple(map(str, data[key].to_numpy()))

    a, b, c, d, x, u, y = (data[key].to_numpy() for key in ("A", "B", "C", "D", "x", "u", "y"))
    return PeriodicModel(
        t=data["time"].to_numpy(),
        period=float(data.attrs["period"]),
        a=a,
        b=b,
        c=c,
        d=d,
        states=names("state"),
        inputs=names("input"),
        outputs=names("output"),
        state_units=names("state_unit"),
        input_units=names("input_unit"),
        output_units=names("output_unit"),
        x=x,
        u=u,
        y=y,
        time=str(data.attrs["time"]),
        notes=notes,
    )


def save_netcdf(model: LinearModel | PeriodicModel, path: str | Path) -> Path:
    """Write `to_dataset(model)` to a NetCDF file.

    Raises InputError where the folder does not exist or cannot be written.
    """
    netcdf.write(path, to_dataset(model))
    return Path(path)
