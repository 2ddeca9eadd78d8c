"""What a trim with an inflow model, or a flight in the free wake, tells beside what all linear rotors do."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rotorjax.bench.markdown import table
from rotorjax.linearisation import steps
from rotorjax.linearisation.compact import HIGHEST
from rotorjax.linearisation.condensed import TURNS
from rotorjax.linearisation.flight import LinearFlight
from rotorjax.linearisation.told import by_name, mode_content, pairs, part_of, roots
from rotorjax.linearisation.wake_flight import WakeFindings


def pictures(found: LinearFlight) -> dict[str, Figure]:
    """By the name of their file."""
    return {"roots": roots({found.result.request.advance: found.modes})}


def summary(found: LinearFlight) -> dict[str, Any]:
    """Its own content of linearise.json."""
    model, full = found.periodic, found.full
    return _wake_content(found) | {
        "states": model.order,
        "azimuths": model.t.size,
        "harmonics": list(found.held),
        "full_order": full.order,
        "full_gap_db": by_name(full, found.full_gap_db),
        "full_gap_deg": by_name(full, found.full_gap_deg),
        "step_sizes": {name: steps.size_of(name) for name in model.inputs},
        "step_error": by_name(full, found.step_error),
    }


def _wake_content(found: LinearFlight) -> dict[str, Any]:
    """What there is of the model of all states in a free wake."""
    wake = found.wake
    if wake is None:
        return {}
    return {
        "all_states": wake.states,
        "all_states_azimuths": wake.azimuths,
        "all_states_modes": [mode_content(mode) for mode in wake.modes],
        "all_states_residual": wake.residual,
        "condensed_error": by_name(found.full, wake.condensed_error),
        "march_CT": None if np.isnan(wake.thrust) else wake.thrust,
    }


def report(found: LinearFlight) -> str:
    """Its own part of the report."""
    model, small = found.periodic, found.small
    wake = "" if found.wake is None else _wake_report(found.wake)
    held = "its mean over a revolution" if len(found.held) == 1 else f"its harmonics {found.held}"
    if model.t.size == 1:
        held = "it does not change with the azimuth, seen from the hub"
    rows = [(m.name, m.exponent.real, m.exponent.imag, m.damping, part_of(m)) for m in found.modes]
    gaps = (found.full_gap_db, found.full_gap_deg, small.gap_db, small.gap_deg)
    errors = pairs(found.full, small.gap_db, *gaps, 100 * found.step_error)
    sizes = ", ".join(f"{n} {steps.size_of(n):.3g} {u}" for n, u in zip(model.inputs, model.input_units, strict=True))
    azimuths = "one azimuth" if model.t.size == 1 else f"{model.t.size} azimuths"
    return (
        f"{model.order} states over {azimuths}; time-invariant with {found.full.order} states ({held}); "
        f"reduced to {small.model.order}, the blades' states as they are. Growth and frequency below are per radian of "
        "azimuth (1 is once per revolution), as seen from the hub.\n\n"
        + wake
        + "## Modes\n\n"
        + table(("mode", "growth", "frequency", "damping ratio", "who takes part"), rows)
        + "\n\n![Roots](roots.png)\n\n## Errors\n\n"
        f"Largest differences up to {HIGHEST:g}/rev from the periodic model's response at the input's own frequency, "
        "where it is above a hundredth of its peak; and of the periodic model from the nonlinear equations over a "
        f"revolution after a step ({sizes}), over the response's largest value or {steps.FLOOR:g} of the output's.\n\n"
        + table(("response", "full, dB", "full, deg", "reduced, dB", "reduced, deg", "step, %"), errors)
    )


def _wake_report(wake: WakeFindings) -> str:
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


def lines(found: LinearFlight) -> list[str]:
    """What the command prints of it."""
    small = found.small
    db, deg = np.nanmedian(small.gap_db), np.nanmedian(small.gap_deg)
    text = [
        f"{found.periodic.order} states; reduced to {small.model.order}, {small.unstable} unstable modes; largest "
        f"error of a response up to {HIGHEST:g}/rev, median over all: {db:.2g} dB, {deg:.3g}°",
        f"linear against nonlinear over a revolution: median {100 * np.median(found.step_error):.2g} %, worst "
        f"{100 * np.max(found.step_error):.2g} %",
    ]
    if small.unstable and found.wake is not None:
        text.append(
            "the wake's mean grows where the blades are held still: the reduced model is for about one revolution, and "
            "its frequency responses are those of a loop that holds the growth down; for longer take periodic"
        )
    if found.wake is not None:
        error = found.wake.condensed_error
        text.append(
            f"{found.wake.states} states in the free wake, condensed to {found.periodic.order}: a step's error over a "
            f"revolution {100 * np.median(error):.2g} % in the median, worst {100 * error.max():.2g} %"
        )
    return text
