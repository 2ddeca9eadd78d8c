"""Sweeps: points an hour against one command for each point, and tables of sweeps that are killed again and again.

    python benchmarks/sweep.py [--kind hover|trim|wake] [--commands 3] [--jobs 1] [--kills 10] [--json FILE]

The sweep and the commands run one after the other in one go, all with the same cache of programs, filled by the sweep;
a command's time is that of a whole process, as a script that calls `rotorjax` in a loop has it. Then the same sweep is
killed so many times by SIGKILL, at random moments, and its table is compared with that of the one left alone.
"""

import argparse
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import xarray as xr

from rotorjax.io.atomic import json_text

CASES = {
    "hover": '[case]\ncommand = "inflow"\ncollective_deg = 16.0\n[axes]\n'
    "height = {from = 0.8, to = 2.0, points = 12}\nslope_deg = {from = 0.0, to = 12.0, points = 5}\n",
    "trim": '[case]\ncommand = "trim"\ninflow = "pitt-peters"\ndrag_area = 2.5\n[axes]\n'
    "advance_ratio = {from = 0.0, to = 0.33, points = 12}\n"
    "thrust_coefficient = {from = 0.004, to = 0.007, points = 5}\n",
    "wake": '[case]\ncommand = "inflow"\nmodel = "freewake"\nquick = true\n[axes]\n'
    "height = {from = 0.8, to = 2.0, points = 12}\ncollective_deg = {from = 12.0, to = 18.0, points = 5}\n",
}
COMMANDS = {
    "hover": "inflow --model vpbfsm --collective 16 --height {height} --slope {slope_deg}",
    "trim": "trim --drag-area 2.5 --advance-ratio {advance_ratio} --thrust-coefficient {thrust_coefficient}",
    "wake": "inflow --model freewake --quick --height {height} --collective {collective_deg}",
}


def command(*words: str) -> list[str]:
    return [sys.executable, "-m", "rotorjax.cli", *words]


def sweep(case: Path, out: Path, jobs: int) -> float:
    """Seconds of a sweep in a process of its own."""
    begin = time.perf_counter()
    line = command("sweep", "--case", str(case), "--out", str(out), "--jobs", str(jobs))
    subprocess.run(line, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - begin


def one_by_one(kind: str, table: xr.Dataset, count: int) -> list[float]:
    """Seconds of a command for each of some points, spread over the table."""
    axes = [str(name) for name in table.coords]
    flat = table.stack(row=axes, create_index=False)
    seconds = []
    for k in np.linspace(0, flat.sizes["row"] - 1, count).round().astype(int):
        point = {name: float(flat[name][k]) for name in axes}
        begin = time.perf_counter()
        subprocess.run(command(*COMMANDS[kind].format(**point).split()), stdout=subprocess.DEVNULL, check=True)
        seconds.append(time.perf_counter() - begin)
    return seconds


def killed(case: Path, out: Path, kills: int, jobs: int, longest: float) -> int:
    """Kill a sweep at random moments, then let it end; how many kills met it alive."""
    chance, met = random.Random(1), 0
    line = command("sweep", "--case", str(case), "--out", str(out), "--jobs", str(jobs))
    for _ in range(kills):
        process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        before, begin, patience = len(list(out.glob("points/*.nc"))), time.perf_counter(), chance.uniform(0.3, 1.0)
        while process.poll() is None and time.perf_counter() - begin < patience * longest:
            time.sleep(0.01)
            if len(list(out.glob("points/*.nc"))) > before:
                break
        time.sleep(chance.uniform(0.0, 0.3))
        met += process.poll() is None
        process.send_signal(signal.SIGKILL)
        process.wait()
    sweep(case, out, jobs)
    return met


def largest_difference(one: xr.Dataset, other: xr.Dataset) -> float:
    """Largest relative difference of the numbers of two tables, times left out; infinite where verdicts differ."""
    if not np.array_equal(one["verdict"], other["verdict"]):
        return float("inf")
    gaps = [0.0]
    for name in set(one.data_vars) - {"verdict", "wall_time_s", "residual", "load_change"}:
        a, b = one[name].to_numpy(), other[name].to_numpy()
        scale = max(float(np.nanmax(np.abs(a))), 1e-9)
        gaps.append(float(np.nanmax(np.abs(a - b))) / scale)
    return max(gaps)


def main() -> None:
    """Measure, print and write JSON."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--kind", choices=tuple(CASES), default="hover")
    parser.add_argument("--commands", type=int, default=3)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--kills", type=int, default=0)
    parser.add_argument("--json", type=Path)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder, case = Path(name), Path(name) / "case.toml"
        case.write_text(CASES[chosen.kind])
        cold = sweep(case, folder / "first", chosen.jobs)
        warm = sweep(case, folder / "out", chosen.jobs)
        table = xr.load_dataset(folder / "out" / "sweep.nc")
        points = int(table["verdict"].size)
        seconds = one_by_one(chosen.kind, table, chosen.commands)
        found = {
            "kind": chosen.kind,
            "points": points,
            "converged": int(np.sum(table["verdict"].to_numpy() == "converged")),
            "sweep_s_first": cold,
            "sweep_s": warm,
            "points_an_hour": 3600 * points / warm,
            "points_an_hour_one_by_one": 3600 * len(seconds) / sum(seconds),
        }
        found["ratio"] = found["points_an_hour"] / found["points_an_hour_one_by_one"]
        if chosen.kills:
            found["kills_met"] = killed(case, folder / "killed", chosen.kills, chosen.jobs, warm)
            again = xr.load_dataset(folder / "killed" / "sweep.nc")
            found["largest_difference_after_kills"] = largest_difference(table, again)
    print("\n".join(f"{name:32s} {value}" for name, value in found.items()))
    if chosen.json:
        chosen.json.write_text(json_text(found, indent=1))


if __name__ == "__main__":
    main()
