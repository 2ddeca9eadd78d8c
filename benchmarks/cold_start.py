"""What a first answer waits for: programs, fusions and seconds, each command in a process of its own.

    python benchmarks/cold_start.py [--only oge level slope vpbfsm help counts] [--json FILE]
    python benchmarks/cold_start.py --only trim trim_wake study full_study

The UH-60 in hover out of ground effect, at h = 1 and over 15°, as the command line solves them: with an empty cache of
programs, then again with the one that the first run filled; and on demand trims at μ = .15 and the study, cold only.
Processor seconds, over all threads, are what other jobs disturb least. The Biot–Savart sum in C (biot_savart.py, 4000 ×
4000 pairs) is timed beside them, to scale by.
"""

import argparse
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

INFLOW = ("inflow", "--rotor", "uh60", "--model")
COMMANDS = {
    "oge": (*INFLOW, "freewake"),
    "level": (*INFLOW, "freewake", "--height", "1"),
    "slope": (*INFLOW, "freewake", "--height", "1", "--slope", "15"),
    "vpbfsm": (*INFLOW, "vpbfsm"),
}
TRIM = ("trim", "--rotor", "uh60", "--thrust-coefficient", "0.00575", "--advance-ratio", "0.15", "--inflow")
LONG = {
    "trim": (*TRIM, "pitt-peters"),
    "trim_wake": (*TRIM, "freewake"),
    "study": ("study", "--quick"),
    "full_study": ("study",),
}
"""Cold alone, and where they are asked for; those that write do so into the cache's folder."""
COUNTED_WITH = "--xla_cpu_use_fusion_emitters=false"  # as in the tests
COMPILED = "/jax/core/compile/backend_compile_duration"


def environment(cache: str) -> dict[str, str]:
    """This one, without jax's and XLA's settings, and with a cache folder of its own."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("JAX_", "XLA_"))}
    return kept | {"XDG_CACHE_HOME": cache}


def timed(arguments: tuple[str, ...], cache: str) -> tuple[float, float]:
    """Wall and processor seconds of one command."""
    code = "import sys; from rotorjax.cli import main; sys.exit(main(sys.argv[1:]))"
    wall, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-c", code, *arguments], env=environment(cache), stdout=subprocess.PIPE, check=True)
    wall, after = time.perf_counter() - wall, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def commands(names: list[str]) -> dict[str, float]:
    """Seconds of the commands, cold and warm."""
    found = {}
    for name in [name for name in names if name in LONG]:
        with tempfile.TemporaryDirectory() as cache:
            out = () if name.startswith("trim") else ("--out", cache)
            wall, busy = timed((*LONG[name], *out), cache)
        found |= {f"cold_{name}_s": round(wall, 1), f"cold_{name}_cpu_s": round(busy, 1)}
        print(f"{' '.join(LONG[name])}, cold: {wall:.1f} s, processor {busy:.1f} s", flush=True)
    for name in [name for name in names if name in COMMANDS]:
        key = name if name == "vpbfsm" else f"inflow_{name}"
        with tempfile.TemporaryDirectory() as cache:
            for start in ("cold", "warm"):
                wall, busy = timed(COMMANDS[name], cache)
                found |= {f"{start}_{key}_s": round(wall, 2), f"{start}_{key}_cpu_s": round(busy, 2)}
                print(f"{' '.join(COMMANDS[name])}, {start}: {wall:.1f} s, processor {busy:.1f} s", flush=True)
    return found


def counts() -> dict[str, int]:
    """Programs that one wake after the other takes in a fresh process, and fusions of an evaluation."""
    import equinox as eqx
    import jax

    from rotorjax.bench import wake_file
    from rotorjax.bench.cases import Case
    from rotorjax.bench.settings import study_settings
    from rotorjax.wake.equilibrium import evaluate
    from rotorjax.wake.solution import solve
    from rotorjax.wake.start import prescribed

    jax.config.update("jax_enable_x64", True)
    programs = []
    jax.monitoring.register_event_duration_secs_listener(lambda event, *_, **__: programs.append(event == COMPILED))
    settings, found, last = study_settings(), {}, None
    cases = {"oge": Case(), "level": Case(1.0), "slope": Case(1.0, 15.0)}
    for name, case in cases.items():
        before = sum(programs)
        last = solve(wake_file.model_of(case, settings), last)
        assert last.converged, last.why
        found[f"programs_{name}"] = sum(programs) - before
    for name in ("oge", "level"):
        model = wake_file.model_of(cases[name], settings)
        arrays, rest = eqx.partition(model, eqx.is_array)
        program = jax.jit(lambda arrays, x, rest=rest: evaluate(eqx.combine(arrays, rest), x))
        text = program.lower(arrays, prescribed(model)).compile().as_text()
        found[f"fusions_evaluate_{name}"] = len(re.findall(r" fusion\(", text))
    return found


def in_c() -> float | None:
    """Milliseconds of the Biot–Savart sum over 4000 × 4000 pairs in C, or None without a compiler."""
    import jax
    import numpy as np
    from biot_savart import c_kernel, compile_c, measure, problem

    jax.config.update("jax_enable_x64", True)
    with tempfile.TemporaryDirectory() as folder:
        library = compile_c(Path(folder))
        if library is None:
            return None
        return 1e3 * float(np.median(measure({"C": c_kernel(library, problem(4000, np.float64))}, 5)["C"]))


def main() -> None:
    """Measure, print and write."""
    parts = [*COMMANDS, "help", "counts"]
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--only", nargs="+", choices=[*parts, *LONG], default=parts)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--count", action="store_true", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.count:
        print(json.dumps(counts()))
        return
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores", flush=True)
    found: dict[str, float | None] = {}
    if "help" in chosen.only:
        found["help_s"] = round(min(timed(("--help",), tempfile.gettempdir())[0] for _ in range(3)), 2)
    if "counts" in chosen.only:
        env = environment(tempfile.gettempdir()) | {"XLA_FLAGS": COUNTED_WITH}
        run = subprocess.run([sys.executable, __file__, "--count"], env=env, stdout=subprocess.PIPE, check=True)
        found |= json.loads(run.stdout)
    found |= commands(chosen.only)
    found["c_kernel_ms"] = in_c()
    print(json.dumps(found, indent=2))
    if chosen.json is not None:
        chosen.json.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
