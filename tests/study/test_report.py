"""The report holds every section, every case and every claim, and its numbers are the data's."""

import json
from pathlib import Path

from rotorjax.bench.cases import HEIGHTS, SLOPES_DEG, study_cases
from rotorjax.bench.markdown import table
from rotorjax.io import netcdf
from rotorjax.study.claims import paper_claims
from rotorjax.study.divergence import contraction
from rotorjax.study.reading import Reading


def test_report_is_complete(written, merged):
    text = (written / "report.md").read_text()
    for case in study_cases(HEIGHTS, SLOPES_DEG):
        assert f"| {case.label} |" in text
    for claim in paper_claims(Reading(merged)):
        assert claim.text in text
        assert claim.evidence in text
    for picture in [line.split("](")[1].rstrip(")") for line in text.splitlines() if line.startswith("![")]:
        assert (written / picture).exists()
    assert "nan" not in text
    assert all(len(row.split("|")) > 3 for row in text.splitlines() if row.startswith("|"))


def test_summary_agrees_with_the_data_set(written):
    summary = json.loads((Path(written) / "summary.json").read_text())
    merged = netcdf.read(written / "cases.nc")
    assert len(summary["cases"]) == merged.sizes["case"] == 15
    for entry, name in zip(summary["cases"], merged["case"].to_numpy(), strict=True):
        data = merged.sel(case=name)
        assert entry["free_wake"]["CT"] == float(data["CT"])
        assert entry["inflow_rms_difference"] == float(data["vpbfsm_inflow_rms_difference"])
        exact = summary["exact_image_inflow_rms_difference"][name]
        assert exact == float(data["exact_image_inflow_rms_difference"])


def test_contraction_is_the_tip_vortexs_least_radius(merged):
    paths = merged["tip_vortex"].copy()
    paths[..., :2] *= 0.77
    assert abs(contraction(Reading(merged.assign(tip_vortex=paths)), study_cases([], [])[0]) - 0.77) < 1e-12


def test_tables_show_missing_numbers_as_a_dash():
    assert table(["a", "b"], [[1.0, float("nan")]]) == "| a | b |\n|---|---|\n| 1 | – |"
