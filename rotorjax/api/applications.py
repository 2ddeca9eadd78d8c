"""Trims, linear models, flights and calibrations, each by one call."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from rotorjax.api.several import SolvedTogether
from rotorjax.api.solved import Solved
from rotorjax.checks import refuse
from rotorjax.errors import InputError
from rotorjax.operating import OperatingPoint
from rotorjax.rotor.geometry import Rotor
from rotorjax.wake.model import FreeWake
from rotorjax.wake.search import Progress
from rotorjax.wake.solution import Solution

if TYPE_CHECKING:
    import xarray as xr

    from rotorjax.coupled import CoupledState, Outputs
    from rotorjax.linearisation.handover import Time
    from rotorjax.ode.models import LinearModel, PeriodicModel
    from rotorjax.rotor.hub import RotorInputs
    from rotorjax.simulation.linear_march import LinearMarch
    from rotorjax.simulation.march import March
    from rotorjax.simulation.run import Simulated
    from rotorjax.sweep.case import SweepCase
    from rotorjax.trim.run import Request, Result
    from rotorjax.wake.performance import Coefficients
    from rotorjax.wake.several_dynamics import SeveralInputs, SeveralState


def trim(
    rotor: Rotor, operating: OperatingPoint, thrust_coefficient: float, progress: Progress | None = None, **flight: Any
) -> "Result":
    """Find the controls and the periodic blade motion of a steady flight.

    flight: what `trim.run.Request` takes: inflow ("uniform", "pitt-peters", "vpbfsm" or "freewake"), advance (over ΩR),
    height (over R), slope_deg, climb (over ΩR), tilt_deg, drag_area (m²), aim, wake (settings). Raises InputError where
    something is not allowed or the thrust is out of reach.

    >>> import rotorjax as rj
    >>> level = rj.trim(*rj.rotor("uh60"), 0.00575, inflow="uniform", advance=0.15)
    >>> level.converged
    True
    """
    from rotorjax.trim.run import Request, run

    return run(Request(rotor, operating, thrust_coefficient, **flight), progress=progress)


def linearise(
    about: "Solved | SolvedTogether | Result",
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    harmonics: Sequence[int] | None = (0,),
    order: int | None = None,
    time: "Time" = "azimuth",
) -> "LinearModel | PeriodicModel":
    """Linearise the equations that are marched, about a trim with an inflow model, a trim in the free wake (in flight
    condensed to a hundred states beside the blades', in hover all that the inputs reach), a rigid rotor's wake, or
    several rotors solved together (for two revolutions, in as few states as tell: `linearisation.several`).

    inputs, outputs: names (`linearisation.drive`, `.readings` have them), None for all. harmonics: those that the
    time-invariant model keeps, (0,) for the mean; None for the model that is periodic in azimuth. order: states of a
    reduced model of a trim, which keeps those of the blades; in the hovering free wake, which grows, it is for one
    revolution; of several rotors. time: "azimuth" (rad, rotor units) or "seconds" (SI). Raises InputError where it has
    not converged, a name is unknown, the order too low or there are harmonics of what has none, and for the
    finite-state model alone.

    >>> import rotorjax as rj
    >>> hover = rj.trim(*rj.rotor("uh60"), 0.00575, inflow="uniform", azimuths=8)
    >>> rj.linearise(hover, ["theta_0"], ["CT"]).b.shape[1]
    1
    """
    from rotorjax.linearisation.compact import reduced
    from rotorjax.linearisation.handover import handed_over
    from rotorjax.ode.harmonic import harmonic_model
    from rotorjax.trim.run import Result
    from rotorjax.trim.solve import Trimmed

    inputs, outputs = (None if names is None else tuple(names) for names in (inputs, outputs))
    if isinstance(about, Result) and about.request.surfaces is not None:
        raise InputError(
            "Argument `about` must be a trim without surfaces, but has some: step it by rj.march, or linearise the "
            "wake of rigid blades among them (rj.solve of rj.free_wake)"
        )
    if isinstance(about, SolvedTogether):
        first = about.found.model.one(0)
        model = _of_several(about, inputs, outputs, harmonics, order)
        return handed_over(model, first.rotor, first.operating, time)
    if isinstance(about, Result) and not isinstance(about.trimmed, Trimmed) and not about.request.advance:
        model = _hovering(about, inputs, outputs, harmonics, order)
        return handed_over(model, about.request.rotor, about.request.operating, time)
    periodic, flown = _periodic(about, inputs, outputs)
    if harmonics is None:
        if order is not None:
            raise InputError(f"Argument `order` must be left out of a periodic model (harmonics None), but is {order}")
        return handed_over(periodic, flown.rotor, flown.operating, time)
    model = harmonic_model(periodic, tuple(harmonics))
    model = model if order is None else reduced(model, order)
    return handed_over(model, flown.rotor, flown.operating, time)


def _periodic(
    about: "Solved | Result", inputs: tuple[str, ...] | None, outputs: tuple[str, ...] | None
) -> "tuple[PeriodicModel, FreeWake | Request]":
    """The model that is periodic in azimuth, and what flies. Raises InputError for anything that has none."""
    from rotorjax.linearisation.rotor import base_of, linear_rotor
    from rotorjax.linearisation.system import linear_wake
    from rotorjax.linearisation.wake_flight import periodic_in_wake
    from rotorjax.trim.run import Result
    from rotorjax.trim.solve import Trimmed

    if isinstance(about, Solved) and isinstance(about.found, Solution):
        return linear_wake(about.found, inputs, outputs), about.found.model
    if not isinstance(about, Result):
        raise InputError(
            "Argument `about` must be a trim (rj.trim) or a free wake of rigid blades in hover, of one rotor or "
            "several, but is neither"
        )
    if isinstance(about.trimmed, Trimmed):
        return linear_rotor(base_of(about.trimmed), inputs, outputs), about.request
    return periodic_in_wake(about, inputs, outputs), about.request


def _hovering(
    about: "Result",
    inputs: Sequence[str] | None,
    outputs: Sequence[str] | None,
    harmonics: Sequence[int] | None,
    order: int | None,
) -> "LinearModel":
    """Of a hover in the free wake. Raises InputError for harmonics that it has not."""
    from rotorjax.linearisation.hover_flight import hover_in_wake

    _check_mean(harmonics, "a hover in the free wake, which does not change with the azimuth")
    return hover_in_wake(about, inputs, outputs, order)


def _of_several(
    about: SolvedTogether,
    inputs: Sequence[str] | None,
    outputs: Sequence[str] | None,
    harmonics: Sequence[int] | None,
    order: int | None,
) -> "LinearModel":
    """Of several rotors. Raises InputError for harmonics that it has not."""
    from rotorjax.linearisation.several import linear_several

    _check_mean(harmonics, "several rotors, of which the mean over a blade's passage is found")
    return linear_several(about.found, inputs, outputs, order)


def _check_mean(harmonics: Sequence[int] | None, of: str) -> None:
    """Raise InputError where more than the mean is asked of what has no more."""
    if harmonics is None or tuple(harmonics) != (0,):
        raise InputError(f"Argument `harmonics` must be (0,) for {of}, but is {harmonics}")


def simulate(case: str | Path, progress: Callable[[str], None] | None = None) -> "Simulated":
    """Fly a case file (`simulation.case` shows one) from its trim. Raises InputError where it cannot be flown."""
    from rotorjax.simulation.case import read_case
    from rotorjax.simulation.run import fly

    return fly(read_case(case), progress)


def sweep(case: "str | Path | SweepCase", folder: str | Path, jobs: int = 1) -> "xr.Dataset":
    """Solve a case over its axes (`sweep.case` shows a file; `sweep.case.sweep_case` makes one in Python).

    Finished points are kept in the folder, where the same call continues. jobs: processes; more than one needs a main
    module that can be imported (`if __name__ == "__main__"`). Returns the table with a dimension for each axis and
    `verdict` beside the numbers, which are NaN where there is no solution. Raises InputError for a case that is not
    right or of which no point is allowed.

    >>> import tempfile, rotorjax as rj
    >>> from rotorjax.sweep.case import sweep_case
    >>> speeds = sweep_case("trim", {"advance_ratio": [0.0, 0.1]}, inflow="uniform", weight=72e3)
    >>> table = rj.sweep(speeds, tempfile.mkdtemp())
    >>> bool(table.CP.sel(advance_ratio=0.1) < table.CP.sel(advance_ratio=0.0))
    True
    """
    from rotorjax.checks import check_whole
    from rotorjax.sweep.case import SweepCase, read_case
    from rotorjax.sweep.pools import Processes
    from rotorjax.sweep.run import sweep
    from rotorjax.sweep.table import dataset

    check_whole("jobs", jobs, 1, 1024)
    wanted = case if isinstance(case, SweepCase) else read_case(case)
    return dataset(sweep(wanted, folder, pool=None if jobs == 1 else lambda line: Processes(jobs, line.say)))


@overload
def march(
    about: "Result", steps_per_turn: int | None = None, **options: Any
) -> "March[CoupledState, Outputs, RotorInputs]": ...
@overload
def march(
    about: SolvedTogether, steps_per_turn: int | None = None, **options: Any
) -> "March[SeveralState, Coefficients, SeveralInputs]": ...
@overload
def march(about: "LinearModel | PeriodicModel", steps_per_turn: int | None = None) -> "LinearMarch": ...
def march(
    about: "Result | SolvedTogether | LinearModel | PeriodicModel", steps_per_turn: int | None = None, **options: Any
) -> "March | LinearMarch":
    """Compile a march of a trim with any inflow, of several rotors that were solved together, or of a linear model, to
    be stepped inside a simulator's loop at a fixed cost.

    steps_per_turn: of a revolution, None for what the inflow needs. options: of `simulation.march.march`: precision,
    old_age, batch, bound_filter, surfaces; of several rotors precision; a linear model has none. Raises InputError
    where the steps are too few, with the number that is enough, and for a linear model that is not of `rj.linearise`.

    >>> import rotorjax as rj
    >>> level = rj.trim(*rj.rotor("uh60"), 0.00575, inflow="uniform", advance=0.15)
    >>> marched = rj.march(level)
    >>> bool(marched.step(marched.start).y.CT > 0.005)
    True
    """
    from rotorjax.ode.models import LinearModel, PeriodicModel

    if isinstance(about, LinearModel | PeriodicModel):
        from rotorjax.simulation.linear_march import linear_march

        if options:
            raise InputError(f"Argument `{next(iter(options))}` is of a march of the rotor: a linear model has none")
        return linear_march(about, steps_per_turn)
    from rotorjax.simulation.march import march
    from rotorjax.simulation.several_march import several_march
    from rotorjax.trim.run import Result

    if isinstance(about, SolvedTogether):
        unknown = [name for name in options if name != "precision"]
        if unknown:
            raise InputError(f"Argument `{unknown[0]}` is of a march of one rotor: several have `precision` alone")
        return several_march(about.found, steps_per_turn, **options)
    if not isinstance(about, Result):
        rule = "be a trim of one rotor (rj.trim), several rotors solved (rj.several_wakes) or a linear model"
        raise refuse("about", rule, f"a {type(about).__name__}")
    return march(about, steps_per_turn, **options)


def calibrate(target: str, *data: Any, **settings: Any) -> Any:
    """Fit by gradients: "hayden", the finite-state model's ground to Hayden's; "freewake", to a study's free wakes
    (data: its cases.nc); "wake", the free wake's settings to Caradonna and Tung's rotor.

    settings: of `calibration.hayden_run.run`, `freewake_run.run` or `measured_run.run`. Returns what these do, with the
    values in `.fit`. Raises InputError for an unknown target and as they do.
    """
    from rotorjax.calibration import freewake_run, hayden_run, measured_run, teacher
    from rotorjax.checks import refuse_choice

    runs = {"hayden": hayden_run.run, "freewake": freewake_run.run, "wake": measured_run.run}
    if target not in runs:
        raise refuse_choice("target", target, runs)
    if target == "freewake" and data and isinstance(data[0], str | Path):
        data = (teacher.find_cases(data[0]), *data[1:])
    return runs[target](*data, **settings)


def evaluate(
    folder: str | Path,
    heights: Sequence[float] = (1.0, 1.5, 2.0),
    slopes_deg: Sequence[float] = (15.0,),
    quick: bool = True,
    draw: bool = False,
) -> "xr.Dataset":
    """Both models of the UH-60 over heights (over R) and slopes (at h = 1), out of ground effect too, as one data set.

    Finished cases are kept in folder/cases, as `rotorjax study --out` keeps them, and not solved again. quick: coarse
    wakes of rigid blades. draw: write every figure whose cases are there to the folder. Raises InputError where a
    height or slope is not allowed or the folder holds another study.
    """
    from rotorjax.bench.cases import study_cases
    from rotorjax.bench.dataset import combine
    from rotorjax.bench.settings import study_settings
    from rotorjax.study.figures import draw_all
    from rotorjax.study.run import solve_cases

    settings = study_settings("uh60", quick=quick)
    data = combine(solve_cases(study_cases(heights, slopes_deg), settings, folder, show=False).cases, settings)
    if draw:
        draw_all(data, folder)
    return data


def over_deck(case: str | Path) -> "tuple[xr.Dataset, dict[str, float]]":
    """Fly a case file over a moving deck (`deck.case` shows one): histories with units, and what the march took.

    Raises InputError where it cannot be flown.
    """
    from rotorjax.deck.case import read_case
    from rotorjax.deck.run import run_case

    return run_case(read_case(case))
