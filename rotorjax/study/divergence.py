"""Where the inflow of the two models parts, and what the numbers say about why."""

import numpy as np

from rotorjax.study.cases import Case
from rotorjax.study.dataset import present
from rotorjax.study.markdown import table
from rotorjax.study.reading import Reading

ZONES = {"root (0.25–0.5)": (0.25, 0.5), "middle (0.5–0.8)": (0.5, 0.8), "tip (0.8–0.95)": (0.8, 0.95)}


def where_they_part(reading: Reading) -> str:
    """Paragraphs and a table in Markdown: by zone, by mean and shape, by contraction of the wake."""
    cases = [case for case in present(reading.merged) if reading.has(case)]
    if not cases:
        return "No case has a sound solution of both models."
    head = ["case", "mean: VPBFSM / free wake", "exact image / free wake", *(f"rms, {z}" for z in ZONES)]
    head += ["shape only, printed factor", "shape only, exact image", "wake radius at 0.3 R below"]
    rows = [_row(reading, case) for case in cases]
    return table(head, rows) + "\n\n" + "\n\n".join(_reasons(reading, cases))


def contraction(reading: Reading, case: Case, depth: float = 0.3) -> float:
    """Least radius (over R) of the tip vortices above `depth` below the disk: 1 is the VPBFSM's cylinder."""
    path = reading.field(case, "tip_vortex")
    radius = np.hypot(path[..., 0], path[..., 1])
    above = np.isfinite(radius) & (path[..., 2] > -depth)
    return float(np.min(radius[above])) if above.any() else float("nan")


def shape_rms(reading: Reading, case: Case, model: str) -> float:
    """Rms difference once the model's inflow is scaled to the free wake's mean over the annulus compared."""
    ours, theirs = reading.inflow(case, model), reading.inflow(case, "free_wake")
    inside = (reading.r >= 0.25) & (reading.r <= 0.95)
    weights = np.where(inside, reading.r * reading.widths, 0.0)
    scaled = ours * float(np.mean(theirs @ weights) / np.mean(ours @ weights))
    return float(np.sqrt(np.mean((scaled - theirs) ** 2 @ weights) / weights.sum()))


def _row(reading: Reading, case: Case) -> list[object]:
    free = reading.mean(case, "free_wake")
    return [
        case.label,
        *(reading.mean(case, model) / free for model in ("vpbfsm", "exact_image")),
        *(reading.zone_rms(case, "vpbfsm", zone) for zone in ZONES.values()),
        *(shape_rms(reading, case, model) for model in ("vpbfsm", "exact_image")),
        contraction(reading, case),
    ]


def _reasons(reading: Reading, cases: list[Case]) -> list[str]:
    oge = Case()
    grounded = [case for case in cases if case.height is not None]
    texts = [
        "The VPBFSM gets the free wake's loading, so what differs is only how a loading makes inflow. Three things do.",
    ]
    if oge in cases:
        texts.append(
            "**The wake contracts, the cylinder does not.** Out of ground effect the tip vortex passes "
            f"{contraction(reading, oge):.2f} R within 0.3 R below the disk, where the VPBFSM keeps a cylinder of radius "
            "1. Inside the vortex the free wake's inflow is higher, outside it is lower, up to upwash at the tip: the "
            f"rms difference is {reading.zone_rms(oge, 'vpbfsm', ZONES['root (0.25–0.5)']):.3f}, "
            f"{reading.zone_rms(oge, 'vpbfsm', ZONES['middle (0.5–0.8)']):.3f} and "
            f"{reading.zone_rms(oge, 'vpbfsm', ZONES['tip (0.8–0.95)']):.3f} in the three zones. Three polynomials "
            f"smooth over it; scaled to the same mean, {shape_rms(reading, oge, 'vpbfsm'):.3f} remains."
        )
    if grounded:
        worst = max(grounded, key=lambda c: reading.number(c, "vpbfsm_inflow_rms_difference"))
        best = min(grounded, key=lambda c: reading.number(c, "vpbfsm_inflow_rms_difference"))
        better = sum(
            reading.number(c, "exact_image_inflow_rms_difference") < reading.number(c, "vpbfsm_inflow_rms_difference")
            for c in grounded
        )
        texts.append(
            "**The ground acts through a factor, not through physics.** Sources on the footprint alone over-predict the "
            "ground effect, and the printed factor was fitted at one height to hold it back. Over ground the difference "
            f"is smallest at {best.label} ({reading.number(best, 'vpbfsm_inflow_rms_difference'):.3f}) and largest at "
            f"{worst.label} ({reading.number(worst, 'vpbfsm_inflow_rms_difference'):.3f}). The exact image of the same "
            f"cylinder, with no factor, is closer to the free wake in {better} of {len(grounded)} cases."
        )
        low = min(grounded, key=lambda c: (c.slope_deg, c.height or 0))
        texts.append(
            "**The real wake turns outward above the ground.** The free wake's tip vortices run out along the plane "
            "and leave the disk's neighbourhood; a cylinder that ends at the plane, or at its image, keeps all vorticity "
            f"at r = 1. At {low.label} the mean inflow is {reading.mean(low, 'free_wake'):.3f} in the free wake, "
            f"{reading.mean(low, 'vpbfsm'):.3f} with the printed factor and {reading.mean(low, 'exact_image'):.3f} with "
            "the exact image (over the OGE mean)."
        )
    return texts
