"""Compile and run time of the free wake's solve under XLA's start-up flags, each in a process with an empty cache.

`python benchmarks/xla_flags.py [--height H [--slope DEG]] [--rounds N] [--only NAME …]` prints a row a flag: the cold
solve's time, what of it is compiling, and the same solve again in that process, when everything is compiled (the median
of five; one over a slope). Processor time, over all threads, is what other jobs disturb least.
"""

import argparse
import json
import os
import subprocess
import sys
import time

FLAGS = {
    "none": "",
    "no fusion emitters": "--xla_cpu_use_fusion_emitters=false",
    "no emitters, one module": "--xla_cpu_use_fusion_emitters=false --xla_cpu_parallel_codegen_split_count=1",
    "no emitters, two modules": "--xla_cpu_use_fusion_emitters=false --xla_cpu_parallel_codegen_split_count=2",
    "no emitters, no expensive passes": "--xla_cpu_use_fusion_emitters=false --xla_llvm_disable_expensive_passes=true",
    "no emitters, level 2": "--xla_cpu_use_fusion_emitters=false --xla_backend_optimization_level=2",
    "no emitters, level 1": "--xla_cpu_use_fusion_emitters=false --xla_backend_optimization_level=1",
    "no emitters, 512 bits": "--xla_cpu_use_fusion_emitters=false --xla_cpu_prefer_vector_width=512",
}
SOLVE = """
import json, time
import jax
jax.config.update("jax_enable_x64", True)
from rotorjax.bench.cases import Case
from rotorjax.bench.settings import study_settings
from rotorjax.bench.single import single_case

def solved():
    wall, busy = time.perf_counter(), time.process_time()
    data, _ = single_case(Case({height}, {slope}), study_settings(), "freewake")
    return data, time.perf_counter() - wall, time.process_time() - busy

cold, wall, busy = solved()
again = sorted(solved()[1:] for _ in range({repeats}))[{repeats} // 2]
compiling, ct = float(cold["compile_time_s"]), float(cold["CT"])
print(json.dumps(dict(wall=wall, busy=busy, compiling=compiling, again=again[0], again_busy=again[1], CT=ct)))
"""


def measured(flags: str, height: float | None, slope: float) -> dict[str, float]:
    """One cold process: wall and processor times (s) of a first solve and of the same again, and C_T."""
    env = {k: v for k, v in os.environ.items() if not k.startswith(("JAX_", "XLA_"))} | {"XLA_FLAGS": flags}
    code = SOLVE.format(height=height, slope=slope, repeats=1 if slope else 5)
    run = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True)
    return json.loads(run.stdout.splitlines()[-1])


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--height", type=float)
    parser.add_argument("--slope", type=float, default=0.0)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--only", nargs="+", choices=FLAGS, default=list(FLAGS))
    chosen = parser.parse_args()
    print(f"started {time.strftime('%H:%M')}, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    print("| flags | cold: wall s | compiling s | processor s | again: wall s | processor s | C_T |")
    print("|---|---|---|---|---|---|---|")
    for _ in range(chosen.rounds):
        for name in chosen.only:
            try:
                row = measured(FLAGS[name], chosen.height, chosen.slope)
            except subprocess.CalledProcessError as error:
                print(f"| {name} | {(error.stderr or '').strip().splitlines()[-1:]} |", flush=True)
                continue
            cold = f"{row['wall']:.1f} | {row['compiling']:.1f} | {row['busy']:.1f}"
            print(f"| {name} | {cold} | {row['again']:.2f} | {row['again_busy']:.2f} | {row['CT']:.9f} |", flush=True)


if __name__ == "__main__":
    main()
