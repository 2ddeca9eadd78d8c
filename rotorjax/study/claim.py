"""A claim with its verdict, and what the word "agreement" means here."""

from dataclasses import dataclass

from rotorjax.bench.cases import Case

GOOD_AGREEMENT = 0.10
"""Rms over the mean inflow that "good agreement" and "closely matches" stand for: the paper gives no number, and a
tenth of the mean is what a flight-dynamics engineer would call close. The same out of ground effect, level and on
slopes."""
OGE = Case()
Verdict = tuple[bool | None, str]
MISSING: Verdict = None, "the cases for it were not computed, or not all converged"


@dataclass(frozen=True)
class Claim:
    """where: place in the paper. text: what it says. holds: with the default finite-state model, None where the cases
    for it are missing. evidence: its numbers. printed_holds, printed_evidence: with the paper's own model.
    """

    where: str
    text: str
    holds: bool | None
    evidence: str
    printed_holds: bool | None
    printed_evidence: str

    @property
    def of_the_free_wake(self) -> bool:
        """Whether no finite-state model enters."""
        return self.evidence == self.printed_evidence
