"""A trim, or a curve of them, as one HTML page."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rotorjax.bench.markdown import table
from rotorjax.bench.plotting import drawn
from rotorjax.io.page import write_page
from rotorjax.trim.curve_picture import draw
from rotorjax.trim.run import Result, numbers

NOTHING = 1e-9
_COLUMNS = {
    "advance_ratio": "advance ratio",
    "speed_m_s": "speed, m/s",
    "height": "height, R",
    "collective_deg": "θ₀, deg",
    "theta_1c_deg": "θ₁c, deg",
    "theta_1s_deg": "θ₁s, deg",
    "tilt_deg": "shaft forward, deg",
    "beta_0_deg": "β₀, deg",
    "thrust_newton": "thrust, N",
    "CT": "C_T",
    "power_kW": "power, kW",
    "CP": "C_P",
    "CP_induced": "induced",
    "CP_profile": "profile",
    "CP_parasite": "parasite",
    "figure_of_merit": "figure of merit",
    "verdict": "verdict",
}
_CONTROLS = {"collective_deg": "Collective", "theta_1s_deg": "Longitudinal cyclic θ₁s", "tilt_deg": "Shaft forward"}


def write_report(path: str | Path, found: Sequence[Result], out_of_ground: Result | None = None) -> None:
    """Write the page; with a picture where there are several points. Raises InputError where it cannot be written."""
    rows = [numbers(result) for result in found]
    rows = [row | {"power_kW": row["power_watt"] / 1e3} for row in rows]
    several = sum(row["converged"] for row in rows) > 1
    pictures = {"curve.png": drawn(draw(found, out_of_ground))} if several else {}
    write_page(path, markdown(rows, found[0], list(pictures)), pictures)


def markdown(rows: Sequence[dict[str, Any]], first: Result, pictures: Sequence[str]) -> str:
    """The page in Markdown: the answer, the picture, all points, what was asked for."""
    request, good = first.request, [row for row in rows if row["converged"]]
    what = f"{request.rotor.name}, {request.inflow}, C_T = {request.thrust:.5f}"
    shown = [key for key in _COLUMNS if any(row[key] is not None for row in rows)]
    cells = [[_cell(row[key]) for key in shown] for row in rows]
    asked = {
        "rotor": request.rotor.name,
        "inflow": request.inflow,
        "thrust coefficient": request.thrust,
        "climb, over ΩR": request.climb,
        "slope, deg": request.slope_deg,
        "cyclic pitch takes away": {"flapping": "cyclic flapping", "moments": "hub moments"}[request.aim],
        "drag area, m²": "–" if request.drag_area is None else request.drag_area,
    }
    parts = [
        f"# Trim: {what}",
        _answer(rows, good),
        *(f"![Power and controls]({name})" for name in pictures),
        "## Points\n\n" + table([_COLUMNS[key] for key in shown], cells),
        *(f"{_place(row)}: {row['verdict_text']}." for row in rows if row["verdict"] != "converged"),
        "## Asked for\n\n" + table(("what", "value"), asked.items()),
        "Angles in degrees, as at the blade's root and in the hub's multi-blade coordinates; C_T = T/(ρA(ΩR)²), C_P = "
        "P/(ρA(ΩR)³).",
    ]
    return "\n\n".join(parts) + "\n"


def _cell(value: object) -> object:
    """What a table shows: five digits, and rounding as the zero that it is."""
    if isinstance(value, float):
        return "0" if abs(value) < NOTHING else f"{value:.5g}"
    return "–" if value is None else value


def _answer(rows: Sequence[dict[str, Any]], good: Sequence[dict[str, Any]]) -> str:
    if not good:
        return f"None of {len(rows)} points converged: {rows[0]['verdict_text']}."
    least = min(good, key=lambda row: row["CP"])
    told = f"{least['power_kW']:.0f} kW (C_P = {least['CP']:.4e}) at {_place(least)}"
    if len(rows) == 1:
        return f"{told}, with a collective of {least['collective_deg']:.2f}°: {least['verdict_text']}."
    found = [f"{len(good)} of {len(rows)} points converged.", f"Least power: {told}."]
    for key, name in (
        ("collective_deg", "Collective"),
        ("theta_1s_deg", "Longitudinal cyclic θ₁s"),
        ("tilt_deg", "Shaft"),
    ):
        low, high = (round(of(row[key] for row in good), 2) + 0.0 for of in (min, max))  # no minus zero
        if high > low:
            found.append(f"{name} from {low:.2f}° to {high:.2f}°.")
    return "\n".join(f"- {line}" for line in found)


def _place(row: dict[str, Any]) -> str:
    ground = "out of ground effect" if row["height"] is None else f"h = {row['height']:g} R"
    return f"advance ratio {row['advance_ratio']:.4g} ({row['speed_m_s']:.4g} m/s), {ground}"
