"""What a hover in the free wake tells beside what all linear rotors do: growing modes, horizon, steps."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rotorjax.bench.markdown import table
from rotorjax.bench.plotting import INK, new_figure, series_colours, style
from rotorjax.linearisation.compact import HIGHEST
from rotorjax.linearisation.hover_flight import LinearHover
from rotorjax.linearisation.hover_small import HORIZON
from rotorjax.linearisation.told import by_name, pairs, part_of

SHOWN = (("CT", "theta_0"), ("beta_1s", "theta_1c"), ("CT", "w"), ("M", "q"), ("lambda_0", "theta_0"), ("CT", "height"))
"""Steps that are drawn, as far as they are there."""


def pictures(found: LinearHover) -> dict[str, Figure]:
    """By the name of their file."""
    return {"roots": roots(found), "steps": steps(found)}


def summary(found: LinearHover) -> dict[str, Any]:
    """Its own content of linearise.json."""
    small = found.small
    return {
        "states": found.model.order,
        "unstable_modes": found.unstable,
        "reduced_growth": small.growth,
        "horizon_rev": small.horizon / (2 * np.pi),
        "reduced_step_error": by_name(found.full, small.step_error),
    }


def report(found: LinearHover) -> str:
    """Its own part of the report."""
    model, small = found.model, found.small
    rows = [(m.name, m.exponent.real, m.exponent.imag, part_of(m)) for m in found.modes]
    errors = pairs(found.full, small.gap_db, 100 * small.step_error, small.gap_db, small.gap_deg)
    growing = ", ".join(f"{count} of {name}" for name, count in found.unstable.items())
    return (
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
        f"up to {HIGHEST:g}/rev.\n\n" + table(("response", "step, %", "dB", "deg"), errors)
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
        axes.set(xlabel="growth per radian", ylabel="frequency, 1/rev")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def lines(found: LinearHover) -> list[str]:
    """What the command prints of it."""
    small = found.small
    return [
        f"{found.model.order} states, {sum(found.unstable.values())} growing modes; reduced to {small.model.order} "
        f"with {small.unstable} growing, for {small.horizon / (2 * np.pi):g} revolution: error of a step "
        f"{100 * np.median(small.step_error):.2g} % in the median of all responses"
    ]
