"""A claim with its verdict, and what the word "agreement" means here."""

from dataclasses import dataclass

from rotorjax.bench.cases import Case

GOOD_AGREEMENT = (
    0.10  # "good agreement", "closely matches": an rms of 10 % of the mean inflow; the paper gives no number
)
OGE = Case()
Verdict = tuple[bool | None, str]
MISSING: Verdict = None, "the cases for it were not computed, or not all converged"


@dataclass(frozen=True)
class Claim:
    """where: place in the paper. text: what it says. holds: None where the cases for it are missing. evidence."""

    where: str
    text: str
    holds: bool | None
    evidence: str
