"""report.md: settings, cases, a table for each figure, the paper's claims with verdicts, where the models part."""

import resource
import sys
from collections.abc import Mapping, Sequence
from json import loads

import numpy as np
import xarray as xr

from rotorjax.bench.azimuth import valley_side
from rotorjax.bench.cases import Case
from rotorjax.bench.dataset import present
from rotorjax.bench.flapping import flap_harmonics_deg
from rotorjax.bench.markdown import table
from rotorjax.bench.plotting import MODEL_STYLE
from rotorjax.bench.wake_file import lost_at
from rotorjax.study.claim import GOOD_AGREEMENT, Claim
from rotorjax.study.claims import checks, paper_claims
from rotorjax.study.divergence import where_they_part
from rotorjax.study.reading import Reading

TABLE_R = (0.25, 0.4, 0.55, 0.7, 0.8, 0.9, 0.95)


def report(
    merged: xr.Dataset, drawn: Sequence[str], missing: Sequence[str], wakes: Mapping[str, str], wall_time_s: float
) -> str:
    """The report in Markdown. drawn, missing: figures that were and were not drawn; wakes: files of those that can be
    turned, by their case; wall_time_s: of this run.
    """
    reading = Reading(merged)
    claims = paper_claims(reading)
    parts = [
        "# Rotor inflow in ground effect: free vortex wake and VPBFSM",
        _answer(reading, claims),
        _introduction(merged, wall_time_s),
        "## Where the two models part, and why\n\n" + where_they_part(reading),
        "## The paper's claims\n\n" + _claim_table(claims),
        *(["## The wakes, to turn\n\n" + _wakes(wakes)] if wakes else []),
        "## Figures\n\n" + _figures(reading, drawn, missing),
        *(["## Calibrated model\n\n" + _calibrated(reading)] if "calibrated_inflow" in merged else []),
        "## What both models must show\n\n" + _claim_table(checks(reading)),
        "## Cases\n\n" + _case_table(reading),
        *(["## Flapping blades\n\n" + flapping_table(reading)] if "flap" in merged else []),
        "## Settings\n\n" + _settings(merged),
    ]
    return "\n\n".join(parts) + "\n"


def _span(values: Sequence[float], digits: int) -> str:
    """From the least to the largest, or the one that they are."""
    low, high = (f"{of(values):.{digits}f}" for of in (min, max))
    return low if low == high else f"{low} to {high}"


def _answer(reading: Reading, claims: Sequence[Claim]) -> str:
    """Five lines: does the finite-state model follow the free wake, where, by how much, at what cost."""
    level, slopes = reading.level(), [case for case in reading.slopes() if case.slope_deg]
    if not reading.has(OGE) or not level:
        return "Whether the finite-state model follows the free wake is not answered: cases are missing."

    def spans(cases: Sequence[Case]) -> str:
        found = []
        for model in ("vpbfsm", "printed"):
            rms = [reading.number(case, f"{model}_inflow_rms_difference") for case in cases]
            found.append(_span(rms, 2))
        return f"{found[0]} (as printed {found[1]})"

    within = [c.label for c in level if reading.number(c, "vpbfsm_inflow_rms_difference") <= GOOD_AGREEMENT]
    tilts = [reading.tilt(c, "vpbfsm") / reading.tilt(c, "free_wake") for c in slopes]
    compared = [c for c in claims if not c.of_the_free_wake and c.holds is not None]
    wall = float(reading.merged["wall_time_s"].mean())
    lines = [
        "**Does the finite-state model follow the free wake?** Rms difference of the inflow over the mean out of "
        "ground effect, default choices, and the paper's own in brackets:\n",
        f"1. Out of ground effect: {spans([OGE])}.",
        f"2. Over level ground: {spans(level)}; within {GOOD_AGREEMENT:.2f} at {', '.join(within) or 'no height'}.",
        f"3. On slopes: {spans(slopes)}; valley less mountain is {_span(tilts, 1)} times the free wake's."
        if slopes
        else "3. On slopes: not examined.",
        f"4. Of {len(compared)} claims of the paper that the finite-state model enters, "
        f"{sum(c.holds or 0 for c in compared)} hold with the default choices and "
        f"{sum(c.printed_holds or 0 for c in compared)} as printed.",
        f"5. Cost: a wake takes {wall:.0f} s on the mean, the finite states a few products of small matrices.",
    ]
    return "\n".join(lines)


def peak_memory_gb() -> float:
    """Largest memory this process has held, in GB."""
    kilo = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return kilo * (1 if sys.platform == "darwin" else 1024) / 1e9


def _introduction(merged: xr.Dataset, wall_time_s: float) -> str:
    settings = loads(merged.attrs["settings"])
    failed = [str(n) for n in merged["case"].to_numpy()[merged["converged"].to_numpy() == 0]]
    text = (
        f"Rotor {settings['rotor']}, collective {settings['collective_deg']:g}°, {settings['blades']} blades, hover. "
        "Each case is solved with the free wake; its loading dC_T/dr̄(r̄, ψ) drives the VPBFSM with its default "
        "choices, as printed in the paper, and as printed over the exact image of its rigid wake cylinder. All "
        "inflow is induced, positive down, and divided by the free wake's out of ground effect (OGE), mean over what "
        f"the blades sweep, {float(merged['reference_inflow']):.5f} ΩR. C_T = T/(ρA(ΩR)²). ψ = 0° is aft and the "
        "mountain side, 90° the advancing, 180° the valley, 270° the retreating side.\n\n"
        f"{len(merged['case'])} cases. This run took {wall_time_s:.0f} s, finished cases taken as they were found; "
        f"the wakes took {float(merged['wall_time_s'].sum()):.0f} s when they were solved, two at a time. Peak memory "
        f"{peak_memory_gb():.2f} GB. "
    )
    if not failed:
        return text + "All cases converged."
    why = merged["why"].to_numpy()[merged["converged"].to_numpy() == 0]
    return text + "**Not converged:** " + "; ".join(f"{n} ({w})" for n, w in zip(failed, why, strict=True)) + "."


def _case_table(reading: Reading) -> str:
    head = ["case", "C_T", "C_Pi", "mean inflow/ΩR", "residual/R", "ΔC_T", "converged", "free wake: ground"]
    head += ["VPBFSM: mean/ΩR", "VPBFSM: ground", "as printed: mean/ΩR", "as printed: ground"]
    head += ["exact image: mean/ΩR", "rms difference, VPBFSM", "as printed", "exact image", "time/s"]
    names = ["CT", "CP_induced", "free_wake_mean_inflow", "free_wake_residual", "free_wake_load_change", "converged"]
    names += ["free_wake_ground_normal_velocity_rms", "vpbfsm_mean_inflow", "vpbfsm_ground_normal_velocity_rms"]
    names += ["printed_mean_inflow", "printed_ground_normal_velocity_rms", "exact_image_mean_inflow"]
    names += [f"{model}_inflow_rms_difference" for model in ("vpbfsm", "printed", "exact_image")] + ["wall_time_s"]
    rows = []
    for case in present(reading.merged):
        values: list[object] = [
            reading.number(case, name) if name in reading.merged else float("nan") for name in names
        ]
        values[5] = "yes" if values[5] else "**no**"
        lost = lost_at(reading.merged.sel(case=case.name))
        rows.append(
            [case.label if lost is None else f"{case.label} (**lost at {lost}**, whose numbers these are)", *values]
        )
    note = (
        "\n\nResidual: rms node displacement when the wake is passed once through its own velocities. ΔC_T: relative "
        "change of C_T in that pass. Ground: rms normal velocity on the plane, over √(C_T/2) for the free wake and "
        "over the incoming flow inside the wake radius for the VPBFSM. Rms difference: area-weighted over "
        "0.25 ≤ r̄ ≤ 0.95, both inflows over the OGE mean."
    )
    return table(head, rows) + note


def flapping_table(reading: Reading) -> str:
    """What it changes that blades flap."""
    head = ["case", "β₀/°", "β₁c/°", "β₁s/°", "C_T", "C_T, rigid", "C_Pi", "C_Pi, rigid"]
    head += ["mean inflow/ΩR", "mean inflow/ΩR, rigid"]
    names = ["CT", "rigid_CT", "CP_induced", "rigid_CP_induced", "free_wake_mean_inflow", "rigid_mean_inflow"]
    rows = []
    for case in present(reading.merged):
        data = reading.merged.sel(case=case.name)
        if np.all(np.isfinite(data["flap"])):
            rows.append([case.label, *flap_harmonics_deg(data), *(reading.number(case, name) for name in names)])
    return (
        "Blades are free to flap about their hinges, on a hub that stays, with no cyclic pitch; inflow is taken normal "
        "to them. β = β₀ + β₁c cos ψ + β₁s sin ψ, up positive. Each starts from the wake of rigid blades, the numbers "
        "of which stand beside.\n\n" + table(head, rows)
    )


def _calibrated(reading: Reading) -> str:
    """Inflow of the calibrated VPBFSM beside the default one's."""
    names = ["free_wake_mean_inflow", "vpbfsm_mean_inflow", "calibrated_mean_inflow"]
    names += ["vpbfsm_inflow_rms_difference", "calibrated_inflow_rms_difference"]
    rows = [(c.label, *(reading.number(c, n) for n in names)) for c in present(reading.merged) if reading.has(c)]
    head = ["case", "free wake: mean/ΩR", "VPBFSM: mean/ΩR", "calibrated: mean/ΩR"]
    head += ["rms difference, VPBFSM", "rms difference, calibrated"]
    mean = [float(np.mean(v)) for v in zip(*(row[4:] for row in rows), strict=True)]
    return table(head, [*rows, ("mean", *[""] * 3, *mean)])


def _claim_table(claims: Sequence[Claim]) -> str:
    verdict = {True: "holds", False: "**does not hold**", None: "not examined"}
    rows = []
    for c in claims:
        if c.of_the_free_wake:
            rows.append((c.where, c.text, verdict[c.holds], "(the free wake's alone)", c.evidence))
        else:
            both = f"{c.evidence}. As printed: {c.printed_evidence}"
            rows.append((c.where, c.text, verdict[c.holds], verdict[c.printed_holds], both))
    return table(["where", "claim", "verdict", "as printed", "evidence"], rows)


def _wakes(wakes: Mapping[str, str]) -> str:
    """Links."""
    pages = ", ".join(f"[{label}]({file})" for label, file in wakes.items())
    return f"With rigid blades, from which flapping ones start; each a page that opens offline: {pages}."


def _figures(reading: Reading, drawn: Sequence[str], missing: Sequence[str]) -> str:
    parts = []
    for name in drawn:
        title = f"Fig. {name.removeprefix('fig').lstrip('0')}" if name.startswith("fig") else "Overview"
        parts.append(f"### {title}\n\n![{title}]({name}.png)")
        if (rows := FIGURE_TABLES.get(name)) and (text := rows(reading)):
            parts.append(text)
    if missing:
        parts.append("Not drawn, for lack of cases: " + ", ".join(missing) + ".")
    return "\n\n".join(parts)


def _settings(merged: xr.Dataset) -> str:
    settings = loads(merged.attrs["settings"])
    rows = [(f"`{k}`", ", ".join(map(str, v)) if isinstance(v, list) else v) for k, v in settings.items()]
    return table(["setting", "value"], rows) + f"\n\nFingerprint: `{merged.attrs['fingerprint']}`"


def _along_radius(reading: Reading, cases: Sequence[Case], name: str, scale: float, valley: bool = False) -> str:
    """Table of a station array at a few radii, for each case; on a slope mountain and valley side."""
    rows = []
    for case in cases:
        if not reading.has(case):
            continue
        field = reading.field(case, name) * scale
        sides = {"": field[0]}
        if case.slope_deg and valley:
            sides = {", mountain": field[0], ", valley": valley_side(field)}
        for side, values in sides.items():
            rows.append([case.label + side, *(float(np.interp(r, reading.r, values)) for r in TABLE_R)])
    return table(["r̄ =", *map(str, TABLE_R)], rows) if rows else ""


def _inflow_table(reading: Reading, cases: Sequence[Case], models: Sequence[str]) -> str:
    title = {name: look["label"] for name, look in MODEL_STYLE.items()}
    texts = []
    for model in models:
        text = _along_radius(reading, cases, f"{model}_inflow", 1 / reading.reference, valley=True)
        if text:
            texts.append(f"{title[model]}:\n\n{text}")
    return "\n\n".join(texts)


def _terms_table(reading: Reading) -> str:
    names = {"VPBFSM": "vpbfsm_rms_difference_by_terms", "as printed": "printed_rms_difference_by_terms"}
    if names["VPBFSM"] not in reading.merged:
        return ""
    rows = [[f"rms difference, {title}", *map(float, reading.merged[n].to_numpy())] for title, n in names.items()]
    return table(["pressure terms", *map(str, reading.merged["terms"].to_numpy())], rows)


def _sectors_table(reading: Reading, cases: Sequence[Case]) -> str:
    """Mean loading inboard, outboard and at the tip on four sides."""
    rows = []
    zones = {"0.2–0.55": (0.2, 0.55), "0.6–0.9": (0.6, 0.9), "0.9–1": (0.9, 1.0)}
    for case in cases:
        if reading.has(case):
            rows += [
                [case.label, name, *(1e3 * reading.sector(case, zone, side) for side in (0.0, 90.0, 180.0, 270.0))]
                for name, zone in zones.items()
            ]
    head = ["case", "r̄", "mountain 0°", "advancing 90°", "valley 180°", "retreating 270°"]
    return "1000 dC_T/dr̄, mean within 60° of each side:\n\n" + table(head, rows) if rows else ""


BOTH, ALL = ("free_wake", "vpbfsm"), ("free_wake", "vpbfsm", "printed", "exact_image")
OGE = Case()
FIGURE_TABLES = {
    "fig06": lambda q: "1000 dC_T/dr̄:\n\n" + _along_radius(q, [OGE, *q.level()], "free_wake_dct_dr", 1e3),
    "fig07": lambda q: (
        "1000 dC_T/dr̄, free wake, then VPBFSM:\n\n"
        + _along_radius(q, [OGE], "free_wake_dct_dr", 1e3)
        + "\n\n"
        + _along_radius(q, [OGE], "vpbfsm_dct_dr", 1e3)
    ),
    "fig08a": _terms_table,
    "fig08b": lambda q: _inflow_table(q, [OGE], BOTH),
    "fig09": lambda q: _inflow_table(q, [Case(1.0)], ALL),
    "fig10a": lambda q: _inflow_table(q, [OGE, *q.level()], ("free_wake",)),
    "fig10b": lambda q: _inflow_table(q, [OGE, *q.level()], ("vpbfsm",)),
    "fig11": lambda q: _sectors_table(q, [Case(1.0, 15.0)]),
    "fig12": lambda q: _inflow_table(q, [Case(1.0, 15.0)], ALL),
    "fig13": lambda q: _sectors_table(q, [c for c in q.slopes() if c.slope_deg not in (0.0, 15.0)]),
    "fig14a": lambda q: _inflow_table(q, [c for c in q.slopes() if c.slope_deg], ("free_wake",)),
    "fig14b": lambda q: _inflow_table(q, [c for c in q.slopes() if c.slope_deg], ("vpbfsm",)),
    "fig15": lambda q: _sectors_table(q, [Case(0.9, 30.0), Case(1.5, 30.0)]),
    "fig16a": lambda q: _inflow_table(q, [Case(h, 30.0) for h in (0.9, 1.0, 1.5)], ("free_wake",)),
    "fig16b": lambda q: _inflow_table(q, [Case(h, 30.0) for h in (0.9, 1.0, 1.5)], ("vpbfsm",)),
}
