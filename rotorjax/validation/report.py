"""validation.md: what was compared, with every verdict; the repository keeps the full run's as VALIDATION.md."""

import math
from collections.abc import Sequence

from rotorjax.bench.markdown import table
from rotorjax.validation.case import ValidationCase
from rotorjax.validation.row import Row
from rotorjax.validation.run import Validation

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
