"""Pictures of a linear model: where its exponents lie, its frequency responses, its steps."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from rotorjax.bench.plotting import FREE_WAKE, INK, VPBFSM, new_figure, series_colours, style
from rotorjax.linearisation.marching import Response
from rotorjax.linearisation.waves import Spectrum
from rotorjax.ode.models import LinearModel

MOST = 4
"""Outputs that are drawn; tables hold all."""
NAMES = {"CT": r"$C_T$", "CQ": r"$C_Q$", "lambda0": r"$\lambda_0$"}


def residuals(history: Sequence[float], tol: float) -> Figure:
    """Residual of every iterate on the way to the periodic wake, all steps of the continuation in a row."""
    with style():
        figure = new_figure(6.4, 3.8)
        axes = figure.subplots()
        axes.semilogy(np.maximum(history, 1e-17), "o-", color=FREE_WAKE, ms=3, lw=1)
        axes.axhline(tol, color=INK, lw=0.8, ls=":")
        axes.annotate("tolerance", (0, tol), xytext=(0, 3), textcoords="offset points", va="bottom")
        axes.set(xlabel="iterate, over all steps of the continuation", ylabel="residual, relative rms")
    return figure


def stability(spectrum: Spectrum) -> Figure:
    """Exponents by wave number with the pairing rate, and the multipliers over a revolution with the unit circle."""
    with style():
        figure = new_figure(10.5, 4.6)
        plane, circle = figure.subplots(1, 2)
        low, middle, high = spectrum.pairing.rate
        plane.axvspan(low, high, color=VPBFSM, alpha=0.08, lw=0)
        plane.axvline(middle, color=VPBFSM, ls="--", label="pairing rate πΓ/4b² (band: along the wake)")
        plane.axvline(0, color=INK, lw=0.8)
        turn = np.linspace(0, 2 * np.pi, 200)
        circle.plot(np.cos(turn), np.sin(turn), color=INK, lw=0.8)
        for (wave, values), colour in zip(
            spectrum.exponents.items(), series_colours(len(spectrum.exponents)), strict=True
        ):
            shown = values[np.real(values) > -1]
            look = {"color": colour, "s": 9, "label": f"wave number {wave}"}
            plane.scatter(np.real(shown), np.imag(shown), **look)
            multipliers = np.exp(2 * np.pi * values)
            circle.scatter(np.real(multipliers), np.imag(multipliers), **look)
        frequencies = [mode.exponent.imag for mode in spectrum.modes]
        top = 1.5 * max((abs(f) for f in frequencies), default=4.0) + 1
        plane.set(xlabel="growth per rad", ylabel="frequency, 1/rev", xlim=(-1, None), ylim=(-top, top))
        circle.set(xlabel="real part", ylabel="imaginary part", aspect="equal")
        plane.set_title("Exponents, seen from the blade")
        circle.set_title("Floquet multipliers over a revolution, and the unit circle")
        plane.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2)
    return figure


def bode(full: LinearModel, reduced: LinearModel, highest: float, points: int = 100) -> Figure:
    """Magnitude and phase of every response, full against reduced, up to twice the frequency that was asked for."""
    frequencies = np.geomspace(0.01, 2 * highest, points)
    one, two = full.response(frequencies), reduced.response(frequencies)
    pairs = [(q, m) for m in range(len(full.inputs)) for q in range(min(len(full.outputs), MOST))]
    with style():
        figure = new_figure(max(3.3 * len(pairs), 5.0), 5.2)
        axes = figure.subplots(2, len(pairs), sharex=True, squeeze=False)
        for column, (q, m) in enumerate(pairs):
            for response, look in (
                (one, {"color": FREE_WAKE, "label": f"full, {full.order} states"}),
                (two, {"color": VPBFSM, "ls": "--", "label": f"reduced, {reduced.order} states"}),
            ):
                values = response[:, q, m]
                axes[0, column].semilogx(frequencies, 20 * np.log10(np.abs(values)), **look)
                axes[1, column].semilogx(frequencies, np.rad2deg(np.unwrap(np.angle(values))), **look)
            for axis in axes[:, column]:
                axis.axvline(highest, color=INK, lw=0.8, ls=":")
            axes[0, column].set_title(f"{_name(full.outputs[q])} per {full.inputs[m]} ({full.input_units[m]})")
            axes[1, column].set_xlabel("frequency, 1/rev")
        axes[0, 0].set_ylabel("magnitude, dB")
        axes[1, 0].set_ylabel("phase, deg")
        axes[1, 0].legend(loc="best")
    return figure


def steps(
    full: LinearModel, reduced: LinearModel, marched: Mapping[str, Response], sizes: Mapping[str, float]
) -> Figure:
    """Outputs after a step of each input: nonlinear march, full and reduced model."""
    shown: Sequence[str] = full.outputs[:MOST]
    psi = marched[full.inputs[0]].psi
    modelled = [model.step(psi) for model in (full, reduced)]
    looks = (
        {"color": FREE_WAKE, "label": f"full, {full.order} states"},
        {"color": VPBFSM, "ls": "--", "label": f"reduced, {reduced.order} states"},
    )
    with style():
        figure = new_figure(max(4.2 * len(full.inputs), 6.0), 2.6 * len(shown) + 0.6)
        axes = figure.subplots(len(shown), len(full.inputs), sharex=True, squeeze=False)
        for m, name in enumerate(full.inputs):
            turns, truth = psi / (2 * np.pi), values_of(marched[name], full.outputs)
            for q, output in enumerate(shown):
                axis = axes[q, m]
                axis.plot(turns, truth[:, q], "o", color=INK, mfc="none", label="nonlinear march")
                for step, look in zip(modelled, looks, strict=True):
                    axis.plot(turns, sizes[name] * step[:, q, m], **look)
                axis.set_ylabel(f"change of {_name(output)}")
            axes[0, m].set_title(f"step of {name}: {sizes[name]:.4g} {full.input_units[m]}")
            axes[-1, m].set_xlabel("revolutions after the step")
        axes[0, 0].legend(loc="best")
    return figure


def values_of(response: Response, names: Sequence[str]) -> np.ndarray:
    """Marched outputs (N, q) in the order of their names (`CT`, `inflow[3]`)."""
    columns = []
    for name in names:
        group, _, index = name.partition("[")
        values = np.asarray(getattr(response.outputs, group))
        columns.append(values[:, int(index.rstrip("]"))] if index else values)
    return np.stack(columns, axis=1)


def _name(output: str) -> str:
    return NAMES.get(output, output)
