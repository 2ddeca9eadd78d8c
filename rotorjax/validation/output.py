"""What `rotorjax validate` leaves behind: pictures, validation.json, validation.md and the same as a page."""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rotorjax import __version__
from rotorjax.bench import plotting
from rotorjax.bench.markdown import table
from rotorjax.io.atomic import write_json, write_text
from rotorjax.io.page import write_page
from rotorjax.validation.case import ValidationCase
from rotorjax.validation.row import Row
from rotorjax.validation.run import Validation


def write(found: Validation, folder: str | Path) -> None:
    """Write every result into a folder that exists. Raises InputError where it cannot be written."""
    folder = Path(folder)
    for case, compared in zip(found.cases, found.comparisons, strict=True):
        plotting.save(compared.draw(), folder / case.name)
    write_json(folder / "validation.json", summary(found))
    text = report(found)
    write_text(folder / "validation.md", text)
    write_page(folder / "validation.html", PICTURE.sub(r"![\1](\1)", text))


def summary(found: Validation) -> dict[str, Any]:
    """Content of validation.json."""
    wakes = [
        {
            "rotor": p.rotor,
            "collective_deg": p.collective_deg,
            "height": p.height,
            "changes": dict(p.changes),
            "converged": s.converged,
            "why": s.why,
            "residual": s.residual,
            "CT": s.CT,
            "CP": s.CP,
            "CP_induced": s.CP_induced,
            "mean_inflow": s.mean_inflow,
            "wall_time_s": s.wall_time_s,
            "compile_time_s": s.compile_time_s,
        }
        for p, s in found.wakes.items()
    ]
    return {
        "rotorjax": __version__,
        "quick": found.subject.quick,
        "settings": wake_settings_of(found),
        "met": len(found.rows) - len(found.out),
        "out": len(found.out),
        "rows": [row.table() for row in found.rows],
        "wakes": wakes,
        "wall_time_s": found.wall_time_s,
    }


def wake_settings_of(found: Validation) -> dict[str, Any]:
    """Settings of the wake that all cases share, by name; none where no case needed a wake."""
    at = next((p for p in found.wakes if not p.changes), None)
    if at is None:
        return {}
    return {k: v for k, v in at.settings(found.subject.quick).table().items() if k.startswith("wake.")}


PICTURE = re.compile(r"^Picture: `(.+)`\.$", re.MULTILINE)  # named in the text, shown on the page
HEAD = ("quantity", "ours", "reference", "difference", "allowed", "verdict")


def report(found: Validation) -> str:
    """The report in Markdown. Pictures are named as files beside it."""
    parts = ["# Validation of the free wake", _introduction(found), _overview(found)]
    ours = found.subject.rotor is None and not found.subject.quick  # what is known was learnt from these wakes
    for case, compared in zip(found.cases, found.comparisons, strict=True):
        parts.append(_case(case, compared.rows, case.known if ours else ""))
    return "\n\n".join(parts) + "\n"


def _introduction(found: Validation) -> str:
    how = "rotorjax validate" + (" --quick" if found.subject.quick else "")
    if found.subject.rotor is not None:
        how += f" --rotor {found.subject.rotor} --collective {next(iter(found.wakes)).collective_deg:g}"
    kind = "coarse" if found.subject.quick else "default"
    failed = [p.label for p, s in found.wakes.items() if not s.converged]
    told = "All wakes converged." if not failed else "**Not converged:** " + "; ".join(failed) + "."
    return (
        f"Written by `{how} --out DIR`. Every rotor has the same {kind} settings; none is tuned for a case. "
        "Lengths are over R, velocities over ΩR, C_T = T/(ρA(ΩR)²). A row is met where the number lies in the allowed "
        "range, and out where it does not or a wake that it is read from did not converge.\n\n"
        f"{len(found.rows) - len(found.out)} of {len(found.rows)} rows are met. {len(found.wakes)} wakes in "
        f"{found.wall_time_s:.0f} s, two at a time. {told}"
    )


def _overview(found: Validation) -> str:
    rows = []
    for case, compared in zip(found.cases, found.comparisons, strict=True):
        of_case = compared.rows
        rows.append((f"[{case.title}](#{_anchor(case)})", sum(r.met for r in of_case), sum(not r.met for r in of_case)))
    return table(("case", "met", "out"), rows)


def _case(case: ValidationCase, rows: Sequence[Row], known: str) -> str:
    parts = [f'<a id="{_anchor(case)}"></a>\n\n## {case.title}', table(HEAD, [_line(row) for row in rows])]
    parts.append(_references(rows))
    if known and any(not row.met for row in rows):
        parts.append(f"Known about the rows that are out: {known}")
    parts.append(f"Picture: `{case.name}.png`.")
    return "\n\n".join(parts)


def _line(row: Row) -> tuple[str, ...]:
    reference = "–" if row.limits.reference is None else _number(row.limits.reference)
    verdict = row.verdict if row.met else "**out**"
    if row.note:
        verdict += f" ({row.note})"
    return row.quantity, _number(row.ours), reference, _difference(row), row.limits.allowed, verdict


def _difference(row: Row) -> str:
    """A share where the range is one, else a number."""
    if row.difference is None or not math.isfinite(row.difference):
        return "–"
    if row.limits.allowed.endswith("%") and row.limits.reference:
        return f"{100 * row.difference / abs(row.limits.reference):+.1f} %"
    return f"{row.difference:+.3f}"


def _references(rows: Sequence[Row]) -> str:
    """Each reference once, with its uncertainty and why so much is allowed."""
    seen = dict.fromkeys(row.against for row in rows)
    lines = [f"- {a.source}. Its uncertainty: {a.uncertainty}. Allowed: {a.reason}." for a in seen]
    return "\n".join(lines)


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "–"


def _anchor(case: ValidationCase) -> str:
    return f"case-{case.name}"
