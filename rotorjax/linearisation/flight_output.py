"""What `rotorjax linearise` leaves behind of a trimmed rotor: models, README, picture, linearise.json, report.md."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rotorjax.bench import plotting
from rotorjax.bench.markdown import table
from rotorjax.bench.plotting import INK, new_figure, series_colours, style
from rotorjax.io.atomic import write_json, write_text
from rotorjax.linearisation import steps
from rotorjax.linearisation.compact import HIGHEST
from rotorjax.linearisation.condensed import TURNS
from rotorjax.linearisation.flight import LinearFlight
from rotorjax.linearisation.handover import Time, handed_over, save
from rotorjax.linearisation.modes import Mode
from rotorjax.linearisation.wake_flight import InWake
from rotorjax.trim.run import numbers


def write(found: LinearFlight, folder: Path, time: Time = "seconds") -> dict[str, Any]:
    """Write every result into a folder that exists, and return the content of linearise.json."""
    request, title = found.result.request, title_of(found)
    models = {"reduced": found.small.model, "full": found.full, "periodic": found.periodic}
    save({k: handed_over(v, request.rotor, request.operating, time) for k, v in models.items()}, folder, title)
    plotting.save(roots({found.result.request.advance: found.modes}), folder / "roots")
    content = summary(found) | {"time": time}
    write_json(folder / "linearise.json", content)
    write_text(folder / "report.md", report(found, title))
    return content


def title_of(found: LinearFlight) -> str:
    """The flight in words."""
    request = found.result.request
    place = "out of ground effect" if request.height is None else f"h = {request.height:g} R"
    place += f", slope {request.slope_deg:g}°" if request.slope_deg else ""
    thrust = found.result.means.CT
    return f"{request.rotor.name}, {request.inflow}, C_T = {thrust:.5f}, advance ratio {request.advance:g}, {place}"


def summary(found: LinearFlight) -> dict[str, Any]:
    """Content of linearise.json: azimuth is time, rotor units; errors by output, then input, null where absent."""
    model = found.periodic

    def by_name(values: np.ndarray) -> dict[str, dict[str, float | None]]:
        clean = [[None if np.isnan(v) else float(v) for v in row] for row in values]
        rows = [dict(zip(model.inputs, row, strict=True)) for row in clean]
        return dict(zip(model.outputs, rows, strict=True))

    def signals(names: Sequence[str], units: Sequence[str], values: np.ndarray) -> dict[str, dict[str, Any]]:
        return {n: {"unit": u, "trim": float(v)} for n, u, v in zip(names, units, values, strict=True)}

    return _wake_content(found, by_name) | {
        "trim": numbers(found.result),
        "omega_rad_s": model.notes["omega_rad_s"],
        "inputs": signals(model.inputs, model.input_units, model.u),
        "outputs": signals(model.outputs, model.output_units, model.y.mean(axis=0)),
        "states": model.order,
        "azimuths": model.t.size,
        "harmonics": list(found.held),
        "full_order": found.full.order,
        "reduced_order": found.small.model.order,
        "reduced_states": list(found.small.model.states),
        "reduced_unstable_modes": found.small.unstable,
        "highest_per_rev": HIGHEST,
        "full_gap_db": by_name(found.full_gap_db),
        "full_gap_deg": by_name(found.full_gap_deg),
        "reduced_gap_db": by_name(found.small.gap_db),
        "reduced_gap_deg": by_name(found.small.gap_deg),
        "step_sizes": {name: steps.size_of(name) for name in model.inputs},
        "step_error": by_name(found.step_error),
        "modes": [mode_content(mode) for mode in found.modes],
        "stages_s": found.seconds,
    }


def _wake_content(found: LinearFlight, by_name: Callable[[np.ndarray], dict]) -> dict[str, Any]:
    """What there is of the model of all states in a free wake."""
    wake = found.wake
    if wake is None:
        return {}
    return {
        "all_states": wake.states,
        "all_states_azimuths": wake.azimuths,
        "all_states_modes": [mode_content(mode) for mode in wake.modes],
        "all_states_residual": wake.residual,
        "condensed_error": by_name(wake.condensed_error),
        "march_CT": None if np.isnan(wake.thrust) else wake.thrust,
    }


def mode_content(mode: Mode) -> dict[str, Any]:
    """A mode as linearise.json has it."""
    return {
        "name": mode.name,
        "growth": mode.exponent.real,
        "frequency": mode.exponent.imag,
        "damping_ratio": mode.damping,
        "shares": mode.shares,
        "states": mode.states,
    }


def report(found: LinearFlight, title: str) -> str:
    """The report in Markdown."""
    model, small = found.periodic, found.small
    wake = "" if found.wake is None else _wake_report(found.wake)
    held = "its mean over a revolution" if len(found.held) == 1 else f"its harmonics {found.held}"
    if model.t.size == 1:
        held = "it does not change with the azimuth, seen from the hub"
    rows = [
        (
            m.name,
            m.exponent.real,
            m.exponent.imag,
            m.damping,
            ", ".join(f"{k} {v:.2f}" for k, v in list(m.states.items())[:4]),
        )
        for m in found.modes
    ]
    gaps = (found.full_gap_db, found.full_gap_deg, small.gap_db, small.gap_deg)
    pairs = [
        (f"{out} per {name}", *(gap[q, m] for gap in gaps), 100 * found.step_error[q, m])
        for m, name in enumerate(model.inputs)
        for q, out in enumerate(model.outputs)
        if not np.isnan(small.gap_db[q, m])
    ]
    sizes = ", ".join(f"{n} {steps.size_of(n):.3g} {u}" for n, u in zip(model.inputs, model.input_units, strict=True))
    times = ", ".join(f"{stage} {seconds:.1f} s" for stage, seconds in found.seconds.items())
    return (
        f"# Linear model: {title}\n\n"
        f"{model.order} states over {model.t.size} azimuths; time-invariant with {found.full.order} states ({held}); "
        f"reduced to {small.model.order}, the blades' states as they are. Growth and frequency below are per radian of "
        "azimuth (1 is once per revolution), as seen from the hub.\n\n"
        + wake
        + "## Modes\n\n"
        + table(("mode", "growth", "frequency", "damping ratio", "who takes part"), rows)
        + "\n\n![Roots](roots.png)\n\n## Errors\n\n"
        f"Largest differences up to {HIGHEST:g}/rev from the periodic model's response at the input's own frequency, "
        "where it is above a hundredth of its peak; and of the periodic model from the nonlinear equations over a "
        f"revolution after a step ({sizes}), over the response's largest value or {steps.FLOOR:g} of the output's.\n\n"
        + table(("response", "full, dB", "full, deg", "reduced, dB", "reduced, deg", "step, %"), pairs)
        + f"\n\n## Time\n\n{times}\n"
    )


def _wake_report(wake: InWake) -> str:
    """What a reader should know of the model of all states."""
    rows = [
        (m.name, m.exponent.real, m.exponent.imag, ", ".join(f"{k} {v:.2f}" for k, v in m.shares.items()))
        for m in wake.modes
    ]
    thrust = "" if np.isnan(wake.thrust) else f" (C_T = {wake.thrust:.5f})"
    middle, most = 100 * np.median(wake.condensed_error), 100 * wake.condensed_error.max()
    return (
        f"## In the free wake\n\nThe equations that are marched have {wake.states} states here. They were linearised "
        f"at {wake.azimuths} azimuths about the periodic march next to the trim{thrust}, and condensed to the periodic "
        f"model by what inputs reach and outputs show in {TURNS:g} revolutions: its steps differ over a revolution by "
        f"{middle:.2g} % in the median of all responses and {most:.2g} % at most. Differences from the nonlinear march "
        f"below are those of all {wake.states} states, and so are these leading exponents, named by whose share in "
        "them is largest:\n\n" + table(("mode", "growth", "frequency", "share"), rows) + "\n\n"
    )


def roots(by_value: dict[float, tuple[Mode, ...]], label: str = "advance ratio") -> Figure:
    """Exponents in the plane; of several flights each mode is a line from the first (open) to the last."""
    paths: dict[str, list[complex]] = {}
    for modes in by_value.values():
        for mode in modes:
            paths.setdefault(mode.name, []).append(mode.exponent)
    with style():
        figure = new_figure(8.5, 5.0)
        axes = figure.subplots()
        axes.axvline(0, color=INK, lw=0.8)
        for (name, values), colour in zip(paths.items(), series_colours(len(paths)), strict=True):
            axes.plot(np.real(values), np.imag(values), "-", color=colour, lw=1, marker="o", label=name)
            axes.plot(np.real(values[0]), np.imag(values[0]), "o", color=colour, mfc="white")
        span = ", ".join(f"{value:g}" for value in by_value)
        axes.set(xlabel="growth per radian", ylabel="frequency, 1/rev", title=f"{label} {span}")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def lines(found: LinearFlight) -> str:
    """What the command prints."""
    small = found.small
    db, deg = np.nanmedian(small.gap_db), np.nanmedian(small.gap_deg)
    text = [
        title_of(found),
        f"{found.periodic.order} states; reduced to {small.model.order}, {small.unstable} unstable modes; largest "
        f"error of a response up to {HIGHEST:g}/rev, median over all: {db:.2g} dB, {deg:.2g}°",
        f"linear against nonlinear over a revolution: median {100 * np.median(found.step_error):.2g} %, worst "
        f"{100 * np.max(found.step_error):.2g} %",
    ]
    if found.wake is not None:
        error = found.wake.condensed_error
        text.append(
            f"{found.wake.states} states in the free wake, condensed to {found.periodic.order}: a step's error over a "
            f"revolution {100 * np.median(error):.2g} % in the median, worst {100 * error.max():.2g} %"
        )
    text += [f"  {m.name:<24} {m.exponent.real:+.4f} {m.exponent.imag:+.4f}i per radian" for m in found.modes]
    return "\n".join(text)
