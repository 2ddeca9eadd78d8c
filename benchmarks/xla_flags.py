"""Compile and run time of the free wake's solve under XLA's start-up flags, each in a process with an empty cache.

`python benchmarks/xla_flags.py [--height H] [--rounds N] [--only NAME …]` prints a row a flag: the cold command's time,
what of it is compiling, and the same solve again in that process, when everything is compiled.
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
start = time.perf_counter()
import jax
jax.config.update("jax_enable_x64", True)
from rotorjax.bench.cases import Case
from rotorjax.bench.settings import study_settings
from rotorjax.bench.single import single_case
settings, case = study_settings(), Case({height})
cold, _ = single_case(case, settings, "freewake")
total = time.perf_counter() - start
warm = min(float(single_case(case, settings, "freewake")[0]["wall_time_s"]) for _ in range(3))
compiling, ct = float(cold["compile_time_s"]), float(cold["CT"])
print(json.dumps({{"total_s": total, "compile_s": compiling, "warm_s": warm, "CT": ct}}))
"""


def measured(flags: str, height: float | None) -> dict[str, float]:
    """One cold process: total_s, compile_s, warm_s and C_T."""
    env = {k: v for k, v in os.environ.items() if not k.startswith(("JAX_", "XLA_"))} | {"XLA_FLAGS": flags}
    code = SOLVE.format(height=height)
    run = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True)
    return json.loads(run.stdout.splitlines()[-1])


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--height", type=float)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--only", nargs="+", choices=FLAGS, default=list(FLAGS))
    chosen = parser.parse_args()
    print(f"started {time.strftime('%H:%M')}, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    print("| flags | cold solve s | of it compiling s | again s | C_T |\n|---|---|---|---|---|")
    for _ in range(chosen.rounds):
        for name in chosen.only:
            try:
                row = measured(FLAGS[name], chosen.height)
            except subprocess.CalledProcessError as error:
                print(f"| {name} | {(error.stderr or '').strip().splitlines()[-1:]} | | | |", flush=True)
                continue
            print(
                f"| {name} | {row['total_s']:.1f} | {row['compile_s']:.1f} | {row['warm_s']:.2f} | {row['CT']:.9f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
