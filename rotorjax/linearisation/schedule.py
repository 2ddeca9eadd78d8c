"""Linear models over speed or height: one file with every flight's matrices, and modes followed by their names."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from rotorjax.bench import plotting
from rotorjax.io import netcdf
from rotorjax.io.atomic import make_folder, write_json
from rotorjax.linearisation import trim_output
from rotorjax.linearisation.condensed import Condensed, aligned
from rotorjax.linearisation.flight import LinearFlight, linearise_trim
from rotorjax.linearisation.found import Wanted
from rotorjax.linearisation.handover import Time, handed_over
from rotorjax.linearisation.hover_flight import LinearHover
from rotorjax.linearisation.told import roots
from rotorjax.linearisation.trim_output import Found
from rotorjax.ode.export import to_dataset
from rotorjax.ode.harmonic import harmonic_model
from rotorjax.ode.models import AZIMUTH, LinearModel
from rotorjax.trim.run import Progress, Request, Result


def flights(requests: Sequence[Request], wanted: Wanted, progress: Progress | None = None) -> list[Found | Result]:
    """Linearise every flight, each trimmed from the one before. Raises InputError as `linearise_trim` does."""
    found: list[Found | Result] = []
    near: Found | None = None
    for request in requests:
        last = linearise_trim(request, wanted, progress, near)
        near = near if isinstance(last, Result) else last
        found.append(last)
    return found


def place(found: LinearFlight) -> float:
    """Where a flight stands in a sweep over speed, or over height."""
    return found.result.request.advance


def alike(found: Sequence[LinearFlight]) -> list[LinearModel]:
    """Time-invariant models with states of one meaning."""
    bases = [None if one.wake is None else Condensed(one.periodic, one.wake.basis) for one in found]
    wakes = [one for one in bases if one is not None]
    if len(wakes) < len(found):
        return [one.full for one in found]
    return [harmonic_model(model, one.held) for model, one in zip(aligned(wakes), found, strict=True)]


def stitched(found: Sequence[LinearFlight], time: Time = "seconds") -> xr.Dataset:
    """Time-invariant models of all states along `flight`, with advance ratio, height and exponents of the modes.

    All states, and not reduced ones: their meaning is the same in every flight, so that matrices may be interpolated.
    Flights in the free wake have those of `condensed.aligned`, whose matrices half way between μ = 0.1 and 0.2 are no
    better than either's. growth, frequency: per radian of azimuth, NaN where a flight has no mode of that name.
    """
    parts = []
    for one, full in zip(found, alike(found), strict=True):
        request = one.result.request
        parts.append(to_dataset(handed_over(full, request.rotor, request.operating, time)))
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


def write(found: Sequence[Found], folder: Path, time: Time = "seconds") -> None:
    """Write flights as scheduled.nc, roots.png and .pdf, and linearise.json with the numbers of each.

    Hovers in the free wake, whose states are others, go to folders of their own.
    """
    for one in found:
        if isinstance(one, LinearHover):
            trim_output.write(one, make_folder(folder / _folder_of(one.result.request.height)), time)
    flown = [one for one in found if isinstance(one, LinearFlight)]
    if not flown:
        return
    netcdf.write(folder / "scheduled.nc", stitched(flown, time))
    over_height = len({place(one) for one in flown}) == 1
    label = "height" if over_height else "advance ratio"
    at = [float(one.result.request.height or np.inf) if over_height else place(one) for one in flown]
    plotting.save(roots({value: one.modes for value, one in zip(at, flown, strict=True)}, label), folder / "roots")
    write_json(folder / "linearise.json", {"flights": [trim_output.summary(one) for one in flown]})


def _folder_of(height: float | None) -> str:
    return "free_air" if height is None else f"height_{height:g}"
