"""The paper's claims about inclined ground (Figs. 11 to 16). Azimuths: 0° mountain, 90° advancing, 180° valley."""

from collections.abc import Callable

from rotorjax.bench.cases import SLOPE_HEIGHT, STEEP_DEG, Case
from rotorjax.study.claim import GOOD_AGREEMENT, MISSING, Verdict
from rotorjax.study.reading import Reading, falls, listed

MOUNTAIN, ADVANCING, VALLEY, RETREATING = 0.0, 90.0, 180.0, 270.0
INBOARD, OUTBOARD, TIP, SPAN = (0.2, 0.55), (0.6, 0.9), (0.9, 1.0), (0.3, 0.9)


def _away(degrees: float, centre: float) -> float:
    return abs((degrees - centre + 180) % 360 - 180)


def two_peaks(reading: Reading) -> Verdict:
    """Fig. 11: outboard peak retreating, inboard peak on the valley side, lowest loading advancing."""
    case = Case(SLOPE_HEIGHT, 15.0)
    if not reading.has(case):
        return MISSING
    _, r_out, out = reading.peak(case, (0.6, 1.0))
    inner, r_in, inboard = reading.peak(case, (0.2, 0.5))
    sides = [reading.sector(case, SPAN, side) for side in (MOUNTAIN, ADVANCING, VALLEY, RETREATING)]
    text = f"outboard peak at ψ = {out:.0f}° (r = {r_out:.2f} R), inboard peak {inner:.4f} at ψ = {inboard:.0f}° "
    text += f"(r = {r_in:.2f} R); mean loading over 0.3 to 0.9 R within 60° of "
    text += listed(["mountain", "advancing", "valley", "retreating"], sides, 5)
    return _away(out, RETREATING) <= 45 and _away(inboard, VALLEY) <= 60 and min(sides) == sides[1], text


def closer_on_valley(*cases: Case) -> Callable[[Reading], Verdict]:
    """The VPBFSM matches the free wake on the valley side and less well on the mountain side."""

    def judge(reading: Reading) -> Verdict:
        if not reading.has(*cases):
            return MISSING
        verdicts, parts = [], []
        for case in cases:
            valley, mountain = (reading.side_rms(case, reading.ours, mountain=m) for m in (False, True))
            verdicts.append(valley <= GOOD_AGREEMENT and valley < mountain)
            parts.append(f"{case.label}: valley {valley:.3f}, mountain {mountain:.3f}")
        return all(verdicts), "rms difference by half of the disk: " + "; ".join(parts)

    return judge


def gentle_slopes(reading: Reading) -> Verdict:
    """Fig. 13: for small tilts the loading is largest on the mountain side and smallest on the valley side."""
    cases = [Case(SLOPE_HEIGHT, s) for s in (5.0, 8.0, 10.0)]
    if not reading.has(*cases):
        return MISSING
    holds, parts = True, []
    for case in cases:
        sides = [reading.sector(case, (0.3, 1.0), side) for side in (MOUNTAIN, ADVANCING, VALLEY, RETREATING)]
        holds &= max(sides) == sides[0] and min(sides) == sides[2]
        names = ["mountain", "advancing", "valley", "retreating"]
        parts.append(f"{case.label}: {listed(names, [1e3 * s for s in sides])}")
    return holds, "1000 × mean loading beyond 0.3 R within 60° of each side: " + "; ".join(parts)


def steep_inboard(reading: Reading) -> Verdict:
    """Fig. 13: a strong inboard lobe on the valley side, above the mountain side's tip peak at 40°."""
    cases = [Case(SLOPE_HEIGHT, s) for s in (30.0, 40.0)]
    if not reading.has(*cases):
        return MISSING
    verdicts, parts = [], []
    for case in cases:
        valley, mountain = (reading.sector(case, INBOARD, side) for side in (VALLEY, MOUNTAIN))
        inner, r, psi = reading.peak(case, INBOARD)
        outer, _, at = reading.peak(case, OUTBOARD)
        lobe = valley > mountain and _away(psi, VALLEY) <= 60
        verdicts.append(lobe and (case.slope_deg < 40 or inner > outer))
        text = (
            f"{case.label}: inboard loading {valley:.5f} valley, {mountain:.5f} mountain; inboard peak {inner:.4f} at "
        )
        parts.append(text + f"ψ = {psi:.0f}°, r = {r:.2f} R; outboard peak {outer:.4f} at ψ = {at:.0f}°")
    return all(verdicts), "; ".join(parts)


def steep_sides(zone: tuple[float, float], higher: float, lower: float) -> Callable[[Reading], Verdict]:
    """Fig. 13: on the steep slopes one side of a zone carries more than the other."""

    def judge(reading: Reading) -> Verdict:
        cases = [Case(SLOPE_HEIGHT, s) for s in (30.0, 40.0)]
        if not reading.has(*cases):
            return MISSING
        names = {ADVANCING: "advancing", RETREATING: "retreating"}
        pairs = [[reading.sector(case, zone, side) for side in (higher, lower)] for case in cases]
        shown = [f"{c.label}: {listed([names[higher], names[lower]], p, 5)}" for c, p in zip(cases, pairs, strict=True)]
        return all(a > b for a, b in pairs), "mean loading within 60° of " + "; ".join(shown)

    return judge


def sides_part(reading: Reading) -> Verdict:
    """Fig. 14: more slope, less inflow on the mountain side and more on the valley side, in both models."""
    cases = reading.slopes()
    if len(cases) < 3 or cases[0].slope_deg:
        return MISSING
    names, holds, parts = [f"{case.slope_deg:g}°" for case in cases], True, []
    for model, title in (("free_wake", "free wake"), (reading.ours, "VPBFSM")):
        mountain, valley = ([reading.side(case, model, mountain=m) for case in cases] for m in (True, False))
        holds &= falls(mountain) and falls([-v for v in valley])
        parts.append(f"{title}, mountain side {listed(names, mountain)}; valley side {listed(names, valley)}")
    return holds, "; ".join(parts)


def agrees_on_slopes(reading: Reading) -> Verdict:
    """Fig. 14: the trends of both models agree, with slight differences in magnitude."""
    cases = [case for case in reading.slopes() if case.slope_deg]
    if len(cases) < 2:
        return MISSING
    tilts = {
        model: [reading.tilt(case, model) for case in cases] for model in ("free_wake", reading.ours, "exact_image")
    }
    names = [f"{case.slope_deg:g}°" for case in cases]
    same = all((a > 0) == (b > 0) for a, b in zip(tilts["free_wake"], tilts[reading.ours], strict=True))
    slight = all(abs(a - b) <= GOOD_AGREEMENT for a, b in zip(tilts["free_wake"], tilts[reading.ours], strict=True))
    text = "valley less mountain side: " + "; ".join(
        f"{title} {listed(names, tilts[model])}"
        for model, title in (("free_wake", "free wake"), (reading.ours, "VPBFSM"), ("exact_image", "exact image"))
    )
    return same and slight, text


STEEP_CASES = tuple(Case(h, STEEP_DEG) for h in (0.9, 1.5))
SLOPE_CLAIMS: tuple[tuple[str, str, Callable[[Reading], Verdict]], ...] = (
    (
        "Fig. 11",
        "h = 1, 15°: a primary loading peak outboard on the retreating side (ψ ≈ 270°), a secondary one inboard on the "
        "valley side, and the lowest loading on the advancing side.",
        two_peaks,
    ),
    (
        "Fig. 12",
        "h = 1, 15°: the VPBFSM closely matches the free wake on the valley side, with some discrepancy on the "
        "mountain side.",
        closer_on_valley(Case(SLOPE_HEIGHT, 15.0)),
    ),
    (
        "Fig. 13",
        "5°, 8°, 10°: the loading is largest on the mountain side and smallest on the valley side.",
        gentle_slopes,
    ),
    (
        "Fig. 13",
        "30°, 40°, inboard: a strong loading lobe on the valley side, exceeding the mountain side's tip peak at 40°.",
        steep_inboard,
    ),
    (
        "Fig. 13",
        "30°, 40°, outboard: the advancing side carries more than the retreating side.",
        steep_sides(OUTBOARD, ADVANCING, RETREATING),
    ),
    (
        "Fig. 13",
        "30°, 40°, tip: the retreating side carries more than the advancing side.",
        steep_sides(TIP, RETREATING, ADVANCING),
    ),
    (
        "Fig. 14",
        "More slope reduces the inflow on the mountain side and increases it on the valley side, in both models.",
        sides_part,
    ),
    ("Fig. 14", "The trends agree closely, with slight differences in magnitude.", agrees_on_slopes),
    (
        "Fig. 16",
        "30°, h = 0.9 and 1.5: the VPBFSM closely matches the free wake on the valley side, with some discrepancy on "
        "the mountain side.",
        closer_on_valley(*STEEP_CASES),
    ),
)
