"""What the Biot–Savart kernel is worth to the study: its wall time with the kernel and with the plain formula.

    python benchmarks/study_kernel.py [--full] [--json FILE]

Each study runs in a process of its own, one after the other, compilation included; the plain one sums the same
segments, images and blades in (N, S, 3) arrays, as one writes it first.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import jax
import jax.numpy as jnp

from rotorjax.frames import rotate_about_shaft
from rotorjax.io.atomic import json_text


def plain_velocity(points, start, end, strength, core, *, plane=None, blades=1):
    """`segment_velocity` without any care but that for points on a node."""

    def of_one_blade(places):
        def at(point):
            r1, r2, edge = point - start, point - end, end - start
            d1, d2 = (jnp.sqrt(jnp.sum(r * r, 1) + 1e-18) for r in (r1, r2))
            c = jnp.cross(edge, r1)
            bottom = d1 * d2 * (jnp.sum(c * c, 1) + core**2 * jnp.sum(edge * edge, 1) + 1e-18)
            return strength * (d1 + d2) * (d1 * d2 - jnp.sum(r1 * r2, 1)) / bottom @ c / (4 * jnp.pi)

        return jax.vmap(at)(places)

    def of_all_blades(places):
        turns = 2 * jnp.pi / blades * jnp.arange(blades)
        return sum(rotate_about_shaft(of_one_blade(rotate_about_shaft(places, -turn)), turn) for turn in turns)

    v = of_all_blades(points)
    return v if plane is None else v + plane.reflect_vectors(of_all_blades(plane.reflect_points(points)))


def run_plain(arguments):
    """The command line with the plain formula in the free wake."""
    from rotorjax import cli
    from rotorjax.wake import field

    field.segment_velocity = plain_velocity
    return cli.main(arguments)


def seconds(program, out, full):
    """Wall time of one study in a process of its own, and its summary."""
    begin = time.perf_counter()
    arguments = ["study", "--out", str(out), *([] if full else ["--quick"])]
    code = subprocess.run([sys.executable, *program, *arguments], stderr=subprocess.DEVNULL).returncode
    assert code in (0, 1), code
    return time.perf_counter() - begin, json.loads((out / "summary.json").read_text())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="the whole study instead of the quick one")
    parser.add_argument("--json", type=Path, help="where to write the figures")
    chosen, rest = parser.parse_known_args()
    if rest:  # a study in the process that this one started
        sys.exit(run_plain(rest))
    with tempfile.TemporaryDirectory() as folder:
        plain, expected = seconds([__file__], Path(folder) / "plain", chosen.full)
        kernel, found = seconds(["-m", "rotorjax.cli"], Path(folder) / "kernel", chosen.full)
    both = [
        (a["free_wake"]["CT"], b["free_wake"]["CT"])
        for a, b in zip(found["cases"], expected["cases"], strict=True)
        if a["free_wake"]["converged"] and b["free_wake"]["converged"]
    ]
    figures = {
        "study_s_plain": plain,
        "study_s_kernel": kernel,
        "plain_over_kernel": plain / kernel,
        "cases_converged_in_both": len(both),
        "largest_relative_difference_of_CT": max(abs(a / b - 1) for a, b in both),
    }
    for name, value in figures.items():
        print(f"{name:36s} {value:.4g}")
    if chosen.json:
        chosen.json.write_text(json_text(figures, indent=1))


if __name__ == "__main__":
    main()
