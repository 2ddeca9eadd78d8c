"""What `rotorjax linearise` leaves behind of a hover in the free wake: models, README, pictures, json, report.md."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rotorjax.bench import plotting
from rotorjax.bench.markdown import table
from rotorjax.bench.plotting import INK, new_figure, series_colours, style
from rotorjax.io.atomic import write_json, write_text
from rotorjax.linearisation.compact import HIGHEST
from rotorjax.linearisation.flight_output import mode_content
from rotorjax.linearisation.handover import Time, handed_over, save
from rotorjax.linearisation.hover_flight import LinearHover
from rotorjax.linearisation.hover_small import HORIZON
from rotorjax.trim.run import numbers

SHOWN = (("CT", "theta_0"), ("beta_1s", "theta_1c"), ("CT", "w"), ("M", "q"), ("lambda_0", "theta_0"), ("CT", "height"))
"""Steps that are drawn, as far as they are there."""


def write(found: LinearHover, folder: Path, time: Time = "seconds") -> dict[str, Any]:
    """Write every result into a folder that exists, and return the content of linearise.json."""
    request, title = found.result.request, title_of(found)
    models = {"reduced": found.small.model, "full": found.model.linear()}
    save({k: handed_over(v, request.rotor, request.operating, time) for k, v in models.items()}, folder, title)
    plotting.save(roots(found), folder / "roots")
    plotting.save(steps(found), folder / "steps")
    content = summary(found) | {"time": time}
    write_json(folder / "linearise.json", content)
    write_text(folder / "report.md", report(found, title))
    return content


def title_of(found: LinearHover) -> str:
    """The flight in words."""
    request = found.result.request
    place = "out of ground effect" if request.height is None else f"h = {request.height:g} R"
    return f"{request.rotor.name} in its free wake, C_T = {found.result.means.CT:.5f}, hover, {place}"


def summary(found: LinearHover) -> dict[str, Any]:
    """Content of linearise.json: azimuth is time, rotor units; errors by output, then input, null where absent."""
    model, small = found.model, found.small

    def by_name(values: np.ndarray) -> dict[str, dict[str, float | None]]:
        clean = [[None if np.isnan(v) else float(v) for v in row] for row in values]
        return {q: dict(zip(model.inputs, row, strict=True)) for q, row in zip(model.outputs, clean, strict=True)}

    def signals(names: Sequence[str], values: np.ndarray) -> dict[str, float]:
        return {name: float(value) for name, value in zip(names, values, strict=True)}

    return {
        "trim": numbers(found.result),
        "inputs": signals(model.inputs, model.u),
        "outputs": signals(model.outputs, model.y),
        "states": model.order,
        "unstable_modes": found.unstable,
        "reduced_order": small.model.order,
        "reduced_states": list(small.model.states),
        "reduced_unstable_modes": small.unstable,
        "reduced_growth": small.growth,
        "horizon_rev": small.horizon / (2 * np.pi),
        "reduced_step_error": by_name(small.step_error),
        "reduced_gap_db": by_name(small.gap_db),
        "reduced_gap_deg": by_name(small.gap_deg),
        "highest_per_rev": HIGHEST,
        "modes": [mode_content(mode) for mode in found.modes],
        "stages_s": found.seconds,
    }


def report(found: LinearHover, title: str) -> str:
    """The report in Markdown."""
    model, small = found.model, found.small
    rows = [
        (m.name, m.exponent.real, m.exponent.imag, ", ".join(f"{k} {v:.2f}" for k, v in list(m.states.items())[:4]))
        for m in found.modes
    ]
    pairs = [
        (f"{out} per {name}", 100 * small.step_error[q, m], small.gap_db[q, m], small.gap_deg[q, m])
        for m, name in enumerate(model.inputs)
        for q, out in enumerate(model.outputs)
        if not np.isnan(small.gap_db[q, m])
    ]
    growing = ", ".join(f"{count} of {name}" for name, count in found.unstable.items())
    times = ", ".join(f"{stage} {seconds:.1f} s" for stage, seconds in found.seconds.items())
    return (
        f"# Linear model: {title}\n\n"
        f"{model.order} states of blades and wake, time-invariant seen from the hub; {small.model.order} in the "
        f"reduced model, the blades' as they are.\n\n## Growing modes\n\n"
        f"The wake's vortices pair: modes with Re λ ≥ 0 by coordinate: {growing}. Nothing is projected out, for "
        "growing and damped modes come into being together, and the first half revolution needs both; the reduced "
        f"model is balanced on {small.growth:.3g} + iω per radian for a horizon of {small.horizon / (2 * np.pi):g} "
        f"revolution, keeps {small.unstable} growing modes, and is not to be used beyond that horizon. Frequency "
        "responses on iω of such a model are no steady answers to a sine: they are what a loop that holds the growth "
        "down would meet.\n\n"
        "![Steps](steps.png)\n\n## Modes\n\n"
        + table(("mode", "growth", "frequency", "who takes part"), rows)
        + "\n\n![Roots](roots.png)\n\n## Errors of the reduced model\n\n"
        "Of a step over the horizon, over the full response's largest value; and on iω, "
        f"up to {HIGHEST:g}/rev.\n\n" + table(("response", "step, %", "dB", "deg"), pairs) + f"\n\n## Time\n\n{times}\n"
    )


def steps(found: LinearHover) -> Figure:
    """Steps of the full and the reduced model over the horizon and half as long again."""
    model, small = found.model, found.small.model
    times = np.linspace(0, 1.5 * HORIZON, 73)
    full, reduced = model.step(times), small.step(times)
    chosen = [pair for pair in SHOWN if pair[0] in model.outputs and pair[1] in model.inputs]
    chosen = chosen or [(model.outputs[0], model.inputs[0])]
    with style():
        figure = new_figure(9.5, 2.6 * -(-len(chosen) // 2))
        ours, theirs = series_colours(2)
        for axes, (output, name) in zip(
            figure.subplots(-(-len(chosen) // 2), 2, squeeze=False).flat, chosen, strict=False
        ):
            q, m = model.outputs.index(output), model.inputs.index(name)
            axes.plot(times / (2 * np.pi), full[:, q, m], color=ours, label=f"all {model.order} states")
            axes.plot(times / (2 * np.pi), reduced[:, q, m], "--", color=theirs, label=f"{small.order} states")
            axes.axvline(HORIZON / (2 * np.pi), color=INK, lw=0.8, ls=":")
            axes.set(xlabel="revolutions", ylabel=f"{output} per {name}")
        for axes in figure.axes[len(chosen) :]:
            axes.remove()
        figure.axes[0].legend()
    return figure


def roots(found: LinearHover) -> Figure:
    """Exponents of the told modes in the plane, one colour for the wake's of each kind and for each of the blades'."""
    kinds: dict[str, list[complex]] = {}
    for mode in found.modes:
        kinds.setdefault(mode.name.partition(" (")[0], []).append(mode.exponent)
    with style():
        figure = new_figure(8.5, 5.0)
        axes = figure.subplots()
        axes.axvline(0, color=INK, lw=0.8)
        for (name, values), colour in zip(kinds.items(), series_colours(len(kinds)), strict=True):
            axes.plot(np.real(values), np.imag(values), "o", color=colour, label=name)
        axes.set(xlabel="growth per radian", ylabel="frequency, 1/rev", title=title_of(found))
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def lines(found: LinearHover) -> str:
    """What the command prints."""
    small = found.small
    text = [
        title_of(found),
        f"{found.model.order} states, {sum(found.unstable.values())} growing modes; reduced to {small.model.order} "
        f"with {small.unstable} growing, for {small.horizon / (2 * np.pi):g} revolution: error of a step "
        f"{100 * np.median(small.step_error):.2g} % in the median of all responses",
    ]
    text += [f"  {m.name:<34} {m.exponent.real:+.4f} {m.exponent.imag:+.4f}i per radian" for m in found.modes]
    return "\n".join(text)
