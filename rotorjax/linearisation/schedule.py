"""Linear models over speed or height: one file with every flight's matrices, and modes followed by their names."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from rotorjax.bench import plotting
from rotorjax.io import netcdf
from rotorjax.io.atomic import write_json
from rotorjax.linearisation.flight import LinearFlight, Wanted, linearise_flight
from rotorjax.linearisation.flight_output import roots, summary
from rotorjax.linearisation.handover import Time, handed_over
from rotorjax.ode.export import to_dataset
from rotorjax.ode.models import AZIMUTH
from rotorjax.trim.run import Progress, Request, Result


def flights(
    requests: Sequence[Request], wanted: Wanted, progress: Progress | None = None
) -> list[LinearFlight | Result]:
    """Linearise every flight, each trimmed from the one before. Raises InputError as `linearise_flight` does."""
    found: list[LinearFlight | Result] = []
    near: Result | None = None
    for request in requests:
        found.append(linearise_flight(request, wanted, progress, near))
        last = found[-1]
        near = last.result if isinstance(last, LinearFlight) else near
    return found


def place(found: LinearFlight) -> float:
    """Where a flight stands in a sweep over speed, or over height."""
    return found.result.request.advance


def stitched(found: Sequence[LinearFlight], time: Time = "seconds") -> xr.Dataset:
    """Time-invariant models of all states along `flight`, with advance ratio, height and exponents of the modes.

    All states, and not reduced ones: their meaning is the same in every flight, so that matrices may be interpolated.
    growth, frequency: per radian of azimuth, NaN where a flight has no mode of that name.
    """
    parts = []
    for one in found:
        request = one.result.request
        data = to_dataset(handed_over(one.full, request.rotor, request.operating, time))
        parts.append(data)
    whole = xr.concat(parts, dim="flight", combine_attrs="drop")
    names = list(dict.fromkeys(mode.name for one in found for mode in one.modes))
    exponents = np.full((len(found), len(names)), np.nan + 0j)
    for k, one in enumerate(found):
        for mode in one.modes:
            exponents[k, names.index(mode.name)] = mode.exponent
    heights = [np.nan if one.result.request.height is None else one.result.request.height for one in found]
    notes = {k: v for k, v in found[0].periodic.notes.items() if k in ("rotor", "inflow", "omega_rad_s", "radius_m")}
    exponent = {
        "growth": (("flight", "mode"), np.real(exponents)),
        "frequency": (("flight", "mode"), np.imag(exponents)),
    }
    speeds = [place(one) for one in found]
    whole = whole.assign(exponent).assign_coords(
        mode=names, advance_ratio=("flight", speeds), height=("flight", heights)
    )
    return whole.assign_attrs(time="seconds" if time == "seconds" else AZIMUTH, **notes)


def write(found: Sequence[LinearFlight], folder: Path, time: Time = "seconds") -> None:
    """Write scheduled.nc, roots.png and .pdf, and linearise.json with the numbers of every flight."""
    netcdf.write(folder / "scheduled.nc", stitched(found, time))
    over_height = len({place(one) for one in found}) == 1
    label = "height" if over_height else "advance ratio"
    at = [float(one.result.request.height or np.inf) if over_height else place(one) for one in found]
    plotting.save(roots({value: one.modes for value, one in zip(at, found, strict=True)}, label), folder / "roots")
    write_json(folder / "linearise.json", {"flights": [summary(one) for one in found]})
