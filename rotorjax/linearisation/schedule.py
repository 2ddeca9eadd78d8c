"""Linear models over speed or height: one file with every flight's matrices, and modes followed by their names."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from rotorjax.bench import plotting
from rotorjax.bench.markdown import table
from rotorjax.io import netcdf
from rotorjax.io.atomic import make_folder, write_json, write_text
from rotorjax.io.page import write_page
from rotorjax.linearisation import trim_output
from rotorjax.linearisation.condensed import Condensed, aligned
from rotorjax.linearisation.flight import LinearFlight, linearise_trim
from rotorjax.linearisation.found import Wanted
from rotorjax.linearisation.handover import Time, handed_over
from rotorjax.linearisation.hover_flight import LinearHover
from rotorjax.linearisation.kept import FlightShelf, above, folder_of
from rotorjax.linearisation.told import roots
from rotorjax.linearisation.trim_output import Found
from rotorjax.ode.export import to_dataset
from rotorjax.ode.harmonic import harmonic_model
from rotorjax.ode.models import AZIMUTH, LinearModel
from rotorjax.trim.run import Request, Result
from rotorjax.wake.search import Progress


def flights(
    requests: Sequence[Request], wanted: Wanted, progress: Progress | None = None, shelf: FlightShelf | None = None
) -> Iterator[Found | Result]:
    """Linearise one flight after another, each trimmed from the one before.

    shelf: where flights are kept as they are done; what is there is not solved again (hovers in the free wake, whose
    models take gigabytes, are). Raises InputError as `linearise_trim` does, and where the shelf holds other flights.
    """
    kept = [None if shelf is None else shelf.take_up(request) for request in requests]
    near: Found | None = None
    for number, (request, last) in enumerate(zip(requests, kept, strict=True), 1):
        if last is None:
            last = linearise_trim(request, wanted, _of_one(progress, number, len(requests)), near)
            if shelf is not None and isinstance(last, LinearFlight):
                shelf.keep(last)
        near = near if isinstance(last, Result) else last
        yield last


def _of_one(progress: Progress | None, number: int, flights: int) -> Progress | None:
    """Progress that says which flight it is, where there are several."""
    if progress is None or flights == 1:
        return progress
    return lambda stage, residual: progress(f"flight {number} of {flights}, {stage}", residual)


def place(found: LinearFlight) -> float:
    """Where a flight stands in a sweep over speed."""
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
    """Write flights as scheduled.nc, README.md, roots (.png and .pdf, one for each height of several speeds), report.md
    and report.html, and linearise.json with the numbers of each; the last flight's own results to a folder of its own.

    Called after every flight, so that all there is is written. Hovers in the free wake, whose states are others, are in
    their own folders alone.
    """
    trim_output.write(found[-1], make_folder(folder / folder_of(found[-1].result.request)), time)
    flown = [one for one in found if isinstance(one, LinearFlight)]
    if not flown:
        return
    data = stitched(flown, time)
    netcdf.write(folder / "scheduled.nc", data)
    drawn = pictures(flown)
    for name, figure in drawn.items():
        plotting.save(figure, folder / name)
    sizes = {"flights": len(flown), "states": data.sizes["state"], "time": data.attrs["time"]}
    write_text(folder / "README.md", README.format(title=flown[0].result.request.rotor.name, **sizes))
    write_json(folder / "linearise.json", {"flights": [trim_output.summary(one) for one in flown]})
    text = report(found, data, tuple(drawn))
    write_text(folder / "report.md", text)
    write_page(folder / "report.html", text)


def report(found: Sequence[Found], data: xr.Dataset, drawn: Sequence[str]) -> str:
    """All flights in one report, in Markdown: how damped each is, and every mode over speed and height."""
    flown = [one for one in found if isinstance(one, LinearFlight)]
    head = ("flight", "advance ratio", "height over R", "least damped", "growth", "grow in reduced", "step, median %")
    hovers = ", ".join(_link(one) for one in found if isinstance(one, LinearHover))
    return (
        f"# Linear models of {len(flown)} flights: {flown[0].result.request.rotor.name}\n\n"
        + table(head, map(_row, flown))
        + (f"\n\nHovers in the free wake, with other states: {hovers}." if hovers else "")
        + "\n\nGrowth and frequency are per radian of azimuth (1 is once per revolution), seen from the hub. Grow in "
        "reduced: modes of the reduced model with Re λ ≥ 0. The last column is how far the linear model is from the "
        "nonlinear equations over a revolution after a step. README.md beside this page says how scheduled.nc is "
        "loaded.\n\n## Modes by name\n\n"
        + table(("mode", *(folder_of(one.result.request) for one in flown)), _modes(data))
        + "".join(f"\n\n![Roots]({name}.png)" for name in drawn)
        + "\n"
    )


def _row(found: LinearFlight) -> tuple:
    """What the report tells of a flight first."""
    least = max(found.modes, key=lambda mode: mode.exponent.real)
    where = (_link(found), place(found), _height(found))
    return (*where, least.name, least.exponent.real, found.small.unstable, 100 * float(np.median(found.step_error)))


def _modes(data: xr.Dataset) -> Iterator[tuple[str, ...]]:
    """Every mode with its exponents, flight by flight."""
    for mode in data["mode"].values:
        own = data.sel(mode=mode)
        pairs = zip(own["growth"].values, own["frequency"].values, strict=True)
        yield str(mode), *(f"{g:+.3f} {f:+.3f}i" if np.isfinite(g) else "–" for g, f in pairs)


def _link(found: Found) -> str:
    name = folder_of(found.result.request)
    return f"[{name}]({name}/report.html)"


def pictures(flown: Sequence[LinearFlight]) -> dict[str, Figure]:
    """Roots over speed, at one height each; over height where there is one speed. By the name of their file."""
    speeds = sorted({place(one) for one in flown})
    heights = sorted({_height(one) for one in flown})
    if len(speeds) == 1 < len(heights):
        over = {_height(one): one.modes for one in flown}
        return {"roots": roots(over, "height over R", f"advance ratio {speeds[0]:g}")}
    found = {}
    for height in heights:
        title = "out of ground effect" if np.isinf(height) else f"h = {height:g} R"
        over = {place(one): one.modes for one in flown if _height(one) == height}
        name = "roots" if len(heights) == 1 else f"roots_{above(None if np.isinf(height) else height)}"
        found[name] = roots(over, "advance ratio", title)
    return found


def _height(found: LinearFlight) -> float:
    """Over R, infinite out of ground effect."""
    return np.inf if found.result.request.height is None else float(found.result.request.height)


README = """# {title}: linear models of {flights} flights

`scheduled.nc` holds A, B, C, D and the trim values x0, u0, y0 of each flight along `flight`: {states} states of one
meaning in all of them, with `advance_ratio` and `height` (NaN out of ground effect) beside them, and `growth` and
`frequency` of every mode by name, per radian of azimuth (the wake's are numbered, the least damped first, and are
others in every flight). **Time is {time}**: poles are per unit of it. Each flight has
a folder of its own, with `.mat` files, the reduced model and a report.

    import xarray, control
    data = xarray.open_dataset("scheduled.nc")
    one = data.isel(flight=0)
    plant = control.ss(one.A.values, one.B.values, one.C.values, one.D.values)

MATLAB: `A = ncread("scheduled.nc", "A")`, whose axes come in the other order: `permute(A, [2 1 3])`.

Of flights in the free wake `inflow.txt` and `inflow.nc` have the inflow of three states that was fitted to each, for
real-time flight dynamics: the equation and units stand at the head, a flight a row.
"""
