"""What `rotorjax validate` leaves behind: pictures, validation.json, validation.md and the same as a page."""

from pathlib import Path
from typing import Any

from rotorjax import __version__
from rotorjax.bench import plotting
from rotorjax.io.atomic import write_json, write_text
from rotorjax.io.page import write_page
from rotorjax.validation.report import report
from rotorjax.validation.run import Validation


def write(found: Validation, folder: str | Path) -> None:
    """Write every result into a folder that exists. Raises InputError where it cannot be written."""
    folder = Path(folder)
    for case, compared in zip(found.cases, found.comparisons, strict=True):
        plotting.save(compared.draw(), folder / case.name)
    write_json(folder / "validation.json", summary(found))
    text = report(found)
    write_text(folder / "validation.md", text)
    write_page(folder / "validation.html", text)


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
