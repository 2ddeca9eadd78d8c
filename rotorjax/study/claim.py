"""A claim with its verdict, and what the word "agreement" means here."""

from dataclasses import dataclass

from rotorjax.bench.cases import Case

GOOD_AGREEMENT = 0.15
"""Rms over the mean inflow that "good agreement" and "closely matches" stand for. The paper gives no number; its
figures plot the inflow over about 0 to 1.5 of that mean, and it calls curves alike that part visibly at root and tip: a
tenth of what they span. Out of ground effect, level and on slopes the same number is asked."""
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
