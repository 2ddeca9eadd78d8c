"""The paper's claims about the rotor out of ground effect and over level ground (Figs. 6 to 10)."""

from collections.abc import Callable

import numpy as np

from rotorjax.bench.cases import Case
from rotorjax.study.claim import GOOD_AGREEMENT, MISSING, OGE, Verdict
from rotorjax.study.reading import Reading, falls, listed


def loading_rises(reading: Reading) -> Verdict:
    """C_T and the loading's mid-span and tip parts rise as h falls."""
    cases = [OGE, *reading.level()]
    if not reading.has(*cases) or len(cases) < 3:
        return MISSING
    thrust = [1e3 * reading.number(case, "CT") for case in cases]
    lowest, free = cases[-1], OGE
    gain = reading.field(lowest, "free_wake_dct_dr")[0] - reading.field(free, "free_wake_dct_dr")[0]
    span = (reading.r >= 0.25) & (reading.r <= 0.95)
    share = float(np.mean(gain[span] > 0))
    where = float(reading.r[np.argmax(gain)])
    text = (
        f"1000 C_T: {listed([c.label for c in cases], thrust)}; {lowest.label} against OGE: the loading is higher on "
    )
    text += f"{100 * share:.0f} % of the stations from 0.25 to 0.95 R, most at r = {where:.2f} R"
    return falls([-t for t in thrust]) and share == 1.0 and where > 0.4, text


def loading_matches(reading: Reading) -> Verdict:
    """Three pressure terms follow the loading but at root and tip."""
    if not reading.has(OGE):
        return MISSING
    ours, theirs = reading.field(OGE, "vpbfsm_dct_dr")[0], reading.field(OGE, "free_wake_dct_dr")[0]
    scale = float(np.max(theirs))
    error = np.abs(ours - theirs) / scale
    zones = [(0.0, 0.3), (0.3, 0.9), (0.9, 1.0)]
    root, middle, tip = (float(np.sqrt(np.mean(error[(reading.r >= a) & (reading.r <= b)] ** 2))) for a, b in zones)
    text = f"rms over the peak loading: root (r < 0.3) {root:.3f}, between {middle:.3f}, tip (r > 0.9) {tip:.3f}"
    return middle < 0.1 and middle < min(root, tip), text


def three_terms(reading: Reading) -> Verdict:
    """Three terms are the fewest that match the inflow."""
    if not reading.has(OGE) or f"{reading.ours}_rms_difference_by_terms" not in reading.merged:
        return MISSING
    rms = reading.merged[f"{reading.ours}_rms_difference_by_terms"].to_numpy()
    text = "rms difference by number of terms: " + listed(
        [str(n) for n in reading.merged["terms"].to_numpy()], list(rms)
    )
    return bool(rms[2] <= GOOD_AGREEMENT and rms[1] > GOOD_AGREEMENT), f"{text}; a match is at most {GOOD_AGREEMENT}"


def close_at(case: Case) -> Callable[[Reading], Verdict]:
    """The VPBFSM agrees with the free wake in one case."""

    def judge(reading: Reading) -> Verdict:
        if not reading.has(case):
            return MISSING
        ours, exact = (reading.number(case, f"{m}_inflow_rms_difference") for m in (reading.ours, "exact_image"))
        means = [reading.mean(case, m) for m in ("free_wake", reading.ours, "exact_image")]
        text = f"rms difference {ours:.3f} ({exact:.3f} with the exact image of a cylinder); mean inflow "
        text += listed(["free wake", "VPBFSM", "exact image"], means)
        return ours <= GOOD_AGREEMENT, text

    return judge


def inflow_falls(reading: Reading) -> Verdict:
    """Mean inflow falls with height in both models."""
    cases = [OGE, *reading.level()]
    if not reading.has(*cases) or len(cases) < 3:
        return MISSING
    names = [case.label for case in cases]
    free, ours = ([reading.mean(case, m) for case in cases] for m in ("free_wake", reading.ours))
    return falls(free) and falls(ours), f"free wake {listed(names, free)}; VPBFSM {listed(names, ours)}"


def all_heights(reading: Reading) -> Verdict:
    """The VPBFSM follows the free wake over every height."""
    cases = reading.level()
    if len(cases) < 2:
        return MISSING
    rms = [reading.number(case, f"{reading.ours}_inflow_rms_difference") for case in cases]
    return max(rms) <= GOOD_AGREEMENT, "rms difference " + listed([c.label for c in cases], rms)


def tip_is_smoother(reading: Reading) -> Verdict:
    """The free wake varies more sharply near the tip than the VPBFSM."""
    cases = [OGE, *reading.level()]
    if not reading.has(*cases):
        return MISSING
    outer = reading.r >= 0.8
    steepness = [
        float(np.mean([np.max(np.abs(np.diff(reading.inflow(c, m)[0][outer], 2))) for c in cases]))
        for m in ("free_wake", reading.ours)
    ]
    text = "largest second difference between stations beyond 0.8 R, mean of the cases: "
    return steepness[0] > steepness[1], text + listed(["free wake", "VPBFSM"], steepness)


def ground_condition(reading: Reading) -> Verdict:
    """Both models keep the flow out of the ground."""
    cases = [c for c in {*reading.level(), *reading.slopes()} if c.height]
    if not cases:
        return MISSING
    free = max(reading.number(case, "free_wake_ground_normal_velocity_rms") for case in cases)
    ours = max(reading.number(case, f"{reading.ours}_ground_normal_velocity_rms") for case in cases)
    text = f"largest rms: free wake {free:.1e} of √(C_T/2); VPBFSM {100 * ours:.1f} % of the incoming flow"
    return free <= 1e-10 and ours <= 0.03, text


LEVEL_CLAIMS: tuple[tuple[str, str, Callable[[Reading], Verdict]], ...] = (
    (
        "Fig. 6",
        "At fixed collective the loading increases as the rotor approaches the ground, across the span, particularly "
        "near mid-span and tip.",
        loading_rises,
    ),
    (
        "Fig. 7",
        "With three pressure terms the VPBFSM's loading matches the free wake's overall, with deviations near root and "
        "tip.",
        loading_matches,
    ),
    ("Fig. 8", "Three terms are the minimum to match the inflow distribution out of ground effect.", three_terms),
    ("Fig. 9", "At h = 1 the VPBFSM agrees well with the free wake.", close_at(Case(1.0))),
    ("Fig. 10", "As the rotor approaches the ground the inflow decreases, in both models.", inflow_falls),
    (
        "Fig. 10",
        "The free wake varies sharply near the tip; the VPBFSM is smoother.",
        tip_is_smoother,
    ),
    ("Fig. 10", "The VPBFSM captures the inflow across all rotor heights.", all_heights),
    ("Method", "Both models satisfy the condition of no flow through the ground.", ground_condition),
)
