"""What a script needs to know: six tasks through the front door, timed from nothing, beside what they took before it.

    python benchmarks/door.py [TASK …] [--json FILE]

Each task runs in a process of its own with an empty program cache, and must print a finite number. Lines are those of
the task, without `import jax` and the x64 switch; `before` counts modules and lines that the same took at version 0.1.0
without the door (tests and notebooks of that time).
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time

from rotorjax.io.atomic import json_text

START = "import jax\njax.config.update('jax_enable_x64', True)\nimport jax.numpy as jnp\n"
TASKS = {
    "finite-state inflow over ground": (
        (3, 4),
        """import rotorjax as rj
solved = rj.solve(rj.finite_state(*rj.rotor("uh60", 18.0), rj.plane(1.0)))
print(float(solved.mean_inflow))""",
    ),
    "free-wake C_T": (
        (5, 9),
        """import rotorjax as rj
print(rj.solve(rj.free_wake(*rj.rotor("uh60", 18.0), rj.plane(1.0))).CT)""",
    ),
    "its gradient": (
        (7, 15),
        """import rotorjax as rj
rotor, operating = rj.rotor("uh60", 18.0)
def thrust(height):
    return rj.solve(rj.free_wake(rotor, operating, rj.plane(height))).CT
print(float(jax.jit(jax.grad(thrust))(1.0)))""",
    ),
    "linear model": (
        (7, 12),
        """import rotorjax as rj
hover = rj.solve(rj.free_wake(*rj.rotor("uh60", 18.0), rj.plane(1.0)))
model = rj.linearise(hover, ("collective", "height"), ("CT",))
print(float(abs(model.b).max()))""",
    ),
    "calibration of b and p": (
        (2, 5),
        """import rotorjax as rj
fit = rj.calibrate("hayden").fit
print(float(fit.rms))""",
    ),
    "trim": (
        (2, 4),
        """import rotorjax as rj
level = rj.trim(*rj.rotor("uh60"), 0.00575, advance=0.15)
print(level.means.CQ)""",
    ),
}


def timed(code: str) -> tuple[float, float]:
    """Seconds from nothing compiled, and the number printed."""
    with tempfile.TemporaryDirectory() as cache:
        env = os.environ | {"JAX_COMPILATION_CACHE_DIR": cache}
        begun = time.perf_counter()
        run = subprocess.run([sys.executable, "-c", START + code], env=env, capture_output=True, text=True, check=True)
        return time.perf_counter() - begun, float(run.stdout.split()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tasks", nargs="*", choices=[*TASKS, []], help="all")
    parser.add_argument("--json", metavar="FILE")
    chosen = parser.parse_args()
    rows = {}
    print("| task | modules before | lines before | imports now | lines now | cold, s | number |")
    print("|---|---|---|---|---|---|---|")
    for name in chosen.tasks or TASKS:
        (modules, lines), code = TASKS[name]
        seconds, number = timed(code)
        rows[name] = {"lines": code.count("\n") + 1, "cold_s": seconds, "number": number}
        print(
            f"| {name} | {modules} | {lines} | 1 | {rows[name]['lines']} | {seconds:.0f} | {number:.5g} |", flush=True
        )
    if chosen.json:
        with open(chosen.json, "w", encoding="utf-8") as file:
            file.write(json_text(rows, indent=1))


if __name__ == "__main__":
    main()
