"""The paper's claims about its results, and what both models must show: does each hold here, and by which number?"""

from collections.abc import Callable

import numpy as np

from rotorjax.study.claim import MISSING, OGE, Claim, Verdict
from rotorjax.study.level_claims import LEVEL_CLAIMS, ground_condition
from rotorjax.study.reading import Reading, falls, listed
from rotorjax.study.slope_claims import SLOPE_CLAIMS


def paper_claims(reading: Reading) -> list[Claim]:
    """Every claim of the paper's results section with its verdict, for the default model and for the paper's own."""
    return [
        Claim(where, text, *judge(reading), *judge(reading.as_printed))
        for where, text, judge in (*LEVEL_CLAIMS, *SLOPE_CLAIMS)
    ]


def checks(reading: Reading) -> list[Claim]:
    """Physical checks of the free wake and the VPBFSM, independent of the paper."""
    return [Claim(where, text, *judge(reading), *judge(reading.as_printed)) for where, text, judge in CHECKS]


def hovers(reading: Reading) -> Verdict:
    """Thrust, figure of merit and mean inflow out of ground effect against momentum theory."""
    if not reading.has(OGE):
        return MISSING
    thrust, induced = reading.number(OGE, "CT"), reading.number(OGE, "CP_induced")
    merit = thrust**1.5 / (np.sqrt(2) * induced)
    ratio = reading.reference / np.sqrt(thrust / 2)
    text = f"C_T {thrust:.5f}, ideal figure of merit {merit:.3f}, mean inflow over √(C_T/2) {ratio:.3f}"
    return bool(0.0045 < thrust < 0.0065 and 0.8 <= merit <= 1.0 and abs(ratio - 1) <= 0.12), text


def ground_effect(reading: Reading) -> Verdict:
    """C_T rises and inflow per √C_T falls with height; the highest is nearly out of ground effect."""
    cases = reading.level()
    if len(cases) < 2 or not reading.has(OGE):
        return MISSING
    names = [case.label for case in cases]
    thrust = [reading.number(case, "CT") for case in cases]
    specific = [reading.mean(case, "free_wake") / np.sqrt(t / thrust[0]) for case, t in zip(cases, thrust, strict=True)]
    ratio = [t / reading.number(OGE, "CT") for t in thrust]
    far = cases[0].height != 3.0 or abs(ratio[0] - 1) <= 0.03
    text = f"C_T over OGE {listed(names, ratio)}; mean inflow per √C_T {listed(names, specific)}"
    return bool(falls([-t for t in thrust]) and falls(specific) and far), text


def tilts_grow(reading: Reading) -> Verdict:
    """Lower inflow on the mountain side, by more as the slope grows to 30°, in both models."""
    cases = [case for case in reading.slopes() if 0 < case.slope_deg <= 30]
    if not cases:
        return MISSING
    names, holds, parts = [f"{case.slope_deg:g}°" for case in cases], True, []
    for model, title in (("free_wake", "free wake"), (reading.ours, "VPBFSM")):
        tilt = [reading.tilt(case, model) for case in cases]
        holds &= tilt[0] > 0 and falls([-t for t in tilt])
        parts.append(f"{title} {listed(names, tilt)}")
    return holds, "valley less mountain side: " + "; ".join(parts)


def converged(reading: Reading) -> Verdict:
    """Every wake is periodic."""
    data = reading.merged
    worst, change = float(data["free_wake_residual"].max()), float(data["free_wake_load_change"].max())
    bad = [
        str(name) for name, good in zip(data["case"].to_numpy(), data["converged"].to_numpy(), strict=True) if not good
    ]
    text = (
        f"largest residual {worst:.1e} R, largest change of C_T {change:.1e}; not converged: {', '.join(bad) or 'none'}"
    )
    return not bad and worst < 1e-3 and change <= 1e-3, text


CHECKS: tuple[tuple[str, str, Callable[[Reading], Verdict]], ...] = (
    (
        "OGE",
        "C_T between 0.0045 and 0.0065, ideal figure of merit C_T^1.5/(√2 C_Pi) between 0.80 and 1.00, mean inflow "
        "within 12 % of √(C_T/2).",
        hovers,
    ),
    (
        "Level",
        "C_T rises and mean inflow per √C_T falls monotonically as h falls; at h = 3 C_T is within 3 % of OGE.",
        ground_effect,
    ),
    (
        "Slope",
        "Inflow is lower on the mountain side and higher on the valley side, the difference growing up to 30°, in both "
        "models.",
        tilts_grow,
    ),
    (
        "Ground",
        "Normal velocity on the plane: free wake at most 1e-10 of √(C_T/2), VPBFSM at most 3 % rms of the "
        "incoming flow.",
        ground_condition,
    ),
    ("Wake", "All wakes converged: residual below 1e-3 R, loads steady to 0.1 %.", converged),
)
