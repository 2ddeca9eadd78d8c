"""The long run: `python -m tests.fuzz --count 10000 --seed 0`, from the repository's root."""

import argparse
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from pathlib import Path
from random import Random

import jax

from tests.fuzz.targets import TARGETS, Finding

SLOWEST = 30.0  # seconds of a trial, compilation included, above which it counts as hanging


def trial(target: object, seed: int) -> tuple[str, str]:
    """What became of one input: refused, accepted, or a finding with its reason."""
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            end = target(Random(seed), Path(folder))  # type: ignore[operator]
        except Finding as error:
            return "finding", str(error)
        except Exception:
            return "finding", "".join(traceback.format_exc(limit=-3))
    took = time.perf_counter() - begun
    return (end, "") if took < SLOWEST else ("finding", f"{took:.0f} s")


def run(count: int, seed: int = 0, only: str | None = None) -> tuple[Counter, list[str]]:
    """Run trials in turn over the targets; counts by target and end, and what was found."""
    targets = [t for t in TARGETS if only in (None, t.__name__)]
    counts, findings = Counter(), []
    for k in range(count):
        target = targets[k % len(targets)]
        end, why = trial(target, seed + k)
        counts[target.__name__, end] += 1
        if end == "finding":
            findings.append(f"{target.__name__} --seed {seed + k} --only {target.__name__} --count 1: {why}")
    return counts, findings


def main() -> int:
    """Run, print the counts and what was found; 1 where something was."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", choices=[t.__name__ for t in TARGETS])
    chosen = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    begun = time.perf_counter()
    counts, findings = run(chosen.count, chosen.seed, chosen.only)
    for name in dict.fromkeys(name for name, _ in counts):
        print(f"{name:18s} " + "  ".join(f"{e} {counts[name, e]:6d}" for e in ("refused", "accepted", "finding")))
    for finding in findings[:20]:
        print(finding)
    print(f"{sum(counts.values())} inputs in {time.perf_counter() - begun:.0f} s: {len(findings)} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
