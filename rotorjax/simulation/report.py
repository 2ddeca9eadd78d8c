"""A flight as one HTML page: how it went, its histories, the wake."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotorjax.bench.markdown import table
from rotorjax.io.page import write_page

PICTURES = {
    "histories.png": "Controls, flapping, thrust and torque, and the hub's motion.",
    "wake.png": "The free wake at the end. [wake.html](wake.html) turns it and plays the flight.",
    "animation.gif": "The flight.",
}


def write_report(folder: Path, told: Mapping[str, Any], asked: Mapping[str, Any]) -> None:
    """Write report.html with the pictures that are in the folder. told: report.json's content; asked: of the case."""
    write_page(
        folder / "report.html", markdown(told, asked, {n: c for n, c in PICTURES.items() if (folder / n).exists()})
    )


def markdown(told: Mapping[str, Any], asked: Mapping[str, Any], pictures: Mapping[str, str]) -> str:
    """The page in Markdown."""
    head = ("history", "first", "last", "least", "most")
    rows = [(name, *(row[key] for key in ("first", "last", "min", "max"))) for name, row in told["histories"].items()]
    parts = [
        f"# Flight: {told['rotor']}, {told['inflow']}",
        _answer(told),
        *(f"![{name}]({name})\n\n{caption}" for name, caption in pictures.items()),
        "## Histories\n\n" + table(head, rows),
        "## Asked for\n\n" + table(("what", "value"), [(k, "–" if v is None else v) for k, v in asked.items()]),
        "Angles in degrees, heights over R, C_T = T/(ρA(ΩR)²); history.nc holds all of it over time.",
    ]
    return "\n\n".join(parts) + "\n"


def _answer(told: Mapping[str, Any]) -> str:
    thrust = told["histories"]["CT"]
    found = [
        f"{told['simulated_s']:.2f} s, {told['revolutions']:.1f} revolutions"
        + (", to the end." if told["finished"] else f"; **it ended early**: {told['why']}."),
        f"C_T goes from {thrust['first']:.5f} to {thrust['last']:.5f}, between {thrust['min']:.5f} and "
        f"{thrust['max']:.5f}.",
        f"The march took {told['march_s']:.2f} s in {told['steps']} steps, "
        f"{told['real_time_factor']:.2f} times real time.",
    ]
    if "late_frames" in told:
        found.append(f"{told['late_frames']} of {told['frames']} frames were late.")
    if told["vortex_ring_s"]:
        found.append(f"{told['vortex_ring_s']:.2f} s are in the vortex ring state, where no inflow model holds.")
    if "wake_change_last" in told:
        found.append(f"Over the last revolution the wake's nodes moved by {told['wake_change_last']:.2e} R (rms).")
    return "\n".join(f"- {line}" for line in found)
