"""Power at constant thrust over speed or height: one trim after the other, each from the last."""

import sys
from collections.abc import Sequence
from dataclasses import replace

from tqdm import tqdm

from rotorjax.errors import InputError
from rotorjax.trim.run import Request, Result, check, run


def requests(base: Request, speeds: Sequence[float], heights: Sequence[float | None]) -> list[Request]:
    """Requests of a curve. Raises InputError where both vary, or one of them is not allowed."""
    if len(speeds) > 1 and len(heights) > 1:
        raise InputError(
            f"Either the speed or the height may have several values, but there are {len(speeds)} speeds and "
            f"{len(heights)} heights"
        )
    found = [replace(base, advance=mu, height=h) for mu in speeds for h in heights]
    for request in found:
        check(request)  # what cannot be had is refused before the first trim
    return found


def curve(wanted: Sequence[Request], progress: bool = True) -> list[Result]:
    """Trims in order; each starts from the last one that converged."""
    found: list[Result] = []
    last = None
    with tqdm(wanted, desc="trim", unit="point", disable=not progress, file=sys.stderr) as bar:

        def show(stage: str, residual: float) -> None:
            bar.set_postfix_str(f"{stage}, residual {residual:.1e}")

        for request in bar:
            result = run(request, last, show)
            last = result.trimmed if result.converged else last
            found.append(result)
    return found
