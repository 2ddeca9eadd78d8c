"""How fast the Biot–Savart sum is: against C, numba and the plain formula, with its derivatives, memory and error.

    python benchmarks/biot_savart.py [--json FILE] [--sizes 1000 4000 16000]

Every round runs all kernels in turn, and ratios are medians over the rounds: the machine may be busy with other work.
N points against N segments, given as eight filaments; seconds exclude compilation, which is shown apart.
"""

import argparse
import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OMP_WAIT_POLICY", "passive")  # idle C threads must not slow down the next kernel

import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.io.atomic import json_text
from rotorjax.wake.biot_savart import filament_velocity, segment_velocity

C_SOURCE = r"""
#include <math.h>
#define KERNEL(NAME, T, ROOT)                                                                      \
void NAME(int n, int m, const T *restrict p, const T *restrict a, const T *restrict b,             \
          const T *restrict g, const T *restrict rc, T *restrict v) {                              \
    const T *ax = a, *ay = a + m, *az = a + 2 * m, *bx = b, *by = b + m, *bz = b + 2 * m;          \
    _Pragma("omp parallel for schedule(static)")                                                   \
    for (int i = 0; i < n; i++) {                                                                  \
        T px = p[i], py = p[n + i], pz = p[2 * n + i], ux = 0, uy = 0, uz = 0;                     \
        _Pragma("omp simd reduction(+:ux,uy,uz)")                                                  \
        for (int j = 0; j < m; j++) {                                                              \
            T x1 = px - ax[j], y1 = py - ay[j], z1 = pz - az[j];                                   \
            T x2 = px - bx[j], y2 = py - by[j], z2 = pz - bz[j];                                   \
            T lx = bx[j] - ax[j], ly = by[j] - ay[j], lz = bz[j] - az[j];                          \
            T d1 = ROOT(x1 * x1 + y1 * y1 + z1 * z1), d2 = ROOT(x2 * x2 + y2 * y2 + z2 * z2);      \
            T q = x1 * x2 + y1 * y2 + z1 * z2, d = d1 * d2;                                        \
            T cx = y1 * z2 - z1 * y2, cy = z1 * x2 - x1 * z2, cz = x1 * y2 - y1 * x2;              \
            T k = g[j] * (d1 + d2) * (d - q)                                                       \
                / (d * (cx * cx + cy * cy + cz * cz + rc[j] * rc[j] * (lx * lx + ly * ly + lz * lz))); \
            ux += k * cx; uy += k * cy; uz += k * cz;                                              \
        }                                                                                          \
        const T f = (T)0.07957747154594767;                                                        \
        v[i] = f * ux; v[n + i] = f * uy; v[2 * n + i] = f * uz;                                   \
    }                                                                                              \
}
KERNEL(velocity_float64, double, sqrt)
KERNEL(velocity_float32, float, sqrtf)
"""
C_FLAGS = ["-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-fopenmp", "-shared", "-fPIC"]


def problem(count, dtype, seed=0):
    """Points (N, 3) among eight wandering filaments of N segments in all."""
    rng = np.random.default_rng(seed)
    nodes = np.cumsum(0.05 * rng.normal(size=(8, count // 8 + 1, 3)), axis=1)
    strength, core = rng.normal(size=(8, count // 8)), np.full((8, count // 8), 0.05)
    return tuple(jnp.asarray(x, dtype) for x in (rng.normal(size=(count, 3)), nodes, strength, core))


def as_segments(args):
    points, nodes, strength, core = args
    return points, nodes[:, :-1].reshape(-1, 3), nodes[:, 1:].reshape(-1, 3), strength.reshape(-1), core.reshape(-1)


def compile_c(folder):
    """The C reference's library, or None with a message."""
    compiler = shutil.which("cc")
    if compiler is None:
        print("no C compiler (cc): the C reference is skipped, and so are the ratios to it")
        return None
    source, library = folder / "reference.c", folder / "reference.so"
    source.write_text(C_SOURCE)
    subprocess.run([compiler, *C_FLAGS, str(source), "-o", str(library), "-lm"], check=True)
    return ctypes.CDLL(str(library))


def c_kernel(library, args):
    points, start, end, strength, core = (np.ascontiguousarray(np.asarray(x).T) for x in as_segments(args))
    out = np.empty_like(points)
    arrays = [x.ctypes.data_as(ctypes.c_void_p) for x in (points, start, end, strength, core, out)]
    function = getattr(library, f"velocity_{points.dtype.name}")

    def run():
        function(points.shape[1], start.shape[1], *arrays)
        return out.T

    return run


def numba_kernel(args):
    """The same loop in numba, or None with a message."""
    try:
        import numba
    except ImportError:
        print("numba is not installed: its row is skipped")
        return None
    from math import sqrt

    @numba.njit(parallel=True, fastmath=True)
    def velocity(p, a, b, g, rc, out):
        for i in numba.prange(p.shape[1]):
            px, py, pz = p[0, i], p[1, i], p[2, i]
            ux = uy = uz = p[0, 0] * 0
            for j in range(a.shape[1]):
                x1, y1, z1 = px - a[0, j], py - a[1, j], pz - a[2, j]
                x2, y2, z2 = px - b[0, j], py - b[1, j], pz - b[2, j]
                lx, ly, lz = b[0, j] - a[0, j], b[1, j] - a[1, j], b[2, j] - a[2, j]
                d1, d2 = sqrt(x1 * x1 + y1 * y1 + z1 * z1), sqrt(x2 * x2 + y2 * y2 + z2 * z2)
                q, d = x1 * x2 + y1 * y2 + z1 * z2, d1 * d2
                cx, cy, cz = y1 * z2 - z1 * y2, z1 * x2 - x1 * z2, x1 * y2 - y1 * x2
                soft = rc[j] * rc[j] * (lx * lx + ly * ly + lz * lz)
                k = g[j] * (d1 + d2) * (d - q) / (d * (cx * cx + cy * cy + cz * cz + soft))
                ux, uy, uz = ux + k * cx, uy + k * cy, uz + k * cz
            out[0, i], out[1, i], out[2, i] = ux, uy, uz

    points, start, end, strength, core = (np.ascontiguousarray(np.asarray(x).T) for x in as_segments(args))
    strength, out = (strength / (4 * np.pi)).astype(points.dtype), np.empty_like(points)

    def run():
        velocity(points, start, end, strength, core, out)
        return out.T

    return run


def ptera_kernel(args):
    """PteraSoftware's line-vortex kernel, or None with a message."""
    try:
        from pterasoftware import _aerodynamics_functions as ptera

        kernel = ptera._collapsed_velocities_from_line_vortices  # of version 5; takes core radii as we do
    except (ImportError, AttributeError):
        print("PteraSoftware 5 is not installed: its row is skipped")
        return None
    points, start, end, strength, core = (np.asarray(x, float) for x in as_segments(args))
    met = np.zeros(4, np.int64)  # it counts the singular pairs it meets
    return lambda: kernel(points, start, end, strength, core, met)


def plain(points, start, end, strength, core):
    """The formula as one writes it: vmap over points, (S, 3) arrays."""

    def at(point):
        r1, r2, edge = point - start, point - end, end - start
        d1, d2 = jnp.linalg.norm(r1, axis=1), jnp.linalg.norm(r2, axis=1)
        c = jnp.cross(r1, r2)
        bottom = d1 * d2 * (jnp.sum(c * c, 1) + core**2 * jnp.sum(edge * edge, 1))
        k = strength * (d1 + d2) * (d1 * d2 - jnp.sum(r1 * r2, 1)) / bottom
        return k @ c / (4 * jnp.pi)

    return jax.vmap(at)(points)


def compiled(function, *args):
    """A call without arguments that waits for the result, and the seconds its compilation took."""
    begin = time.perf_counter()
    executable = jax.jit(function).lower(*args).compile()
    seconds = time.perf_counter() - begin
    return lambda: jax.block_until_ready(executable(*args)), seconds


def kernels(library, count, dtype):
    """Name → call of everything that is compared at this size, and name → seconds of compilation."""
    args = problem(count, dtype)
    tangents = tuple(jnp.asarray(np.random.default_rng(1).normal(size=x.shape), dtype) for x in args)

    def loss(args):
        return 0.5 * jnp.sum(filament_velocity(*args) ** 2)

    runs, compiling = {}, {}
    if library is not None:
        runs["C, all threads"] = c_kernel(library, args)
    ours = {
        "forward": (filament_velocity, *args),
        "jvp": (lambda a, t: jax.jvp(filament_velocity, a, t), args, tangents),
        "gradient of all": (jax.grad(loss), args),
        "forward, loose segments": (segment_velocity, *as_segments(args)),
    }
    for name, (function, *inputs) in ours.items():
        runs[name], compiling[name] = compiled(function, *inputs)
    if count <= 4000:
        runs["plain vmap formula"], compiling["plain vmap formula"] = compiled(plain, *as_segments(args))
    for name, make in (("numba", numba_kernel), ("PteraSoftware", ptera_kernel)):
        kernel = make(args)
        if kernel is not None:
            runs[name] = kernel
    return runs, compiling


def measure(runs, rounds):
    """Seconds (rounds,) of every kernel, all of them in turn each round."""
    for run in runs.values():
        run()
    seconds = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in runs.items():
            begin = time.perf_counter()
            run()
            seconds[name].append(time.perf_counter() - begin)
    return {name: np.array(times) for name, times in seconds.items()}


def check_equal(runs, dtype):
    ours = np.asarray(runs["forward"]())
    tolerance = 1e-10 if dtype == np.float64 else 3e-4  # the C formula cancels far from a segment
    for name in ("C, all threads", "numba", "forward, loose segments", "plain vmap formula"):
        if name in runs:
            error = np.abs(np.asarray(runs[name]()) - ours).max() / np.abs(ours).max()
            if not error < tolerance:
                raise SystemExit(f"{name} differs from the forward kernel by {error:.1e}")


def peak_memory_mb(count):
    """Peak memory of the gradient above its inputs, in a fresh process."""
    child = subprocess.run(
        [sys.executable, __file__, "--memory", str(count)], check=True, capture_output=True, text=True
    )
    return float(child.stdout.split()[-1])


def report_memory(count):
    """Print how far the resident set rises while the compiled gradient runs (Linux: its high-water mark is reset)."""
    args = problem(count, np.float64)
    run, _ = compiled(jax.grad(lambda a: 0.5 * jnp.sum(filament_velocity(*a) ** 2)), args)
    status = lambda key: next(int(x.split()[1]) for x in Path("/proc/self/status").read_text().splitlines() if key in x)  # noqa: E731
    Path("/proc/self/clear_refs").write_text("5")
    before = status("VmRSS:")
    run()
    print((status("VmHWM:") - before) / 1024)


def trial_pairs(count, nasty):
    """Points (N, 3), both ends (N, 3) and cores (N,); nasty: a sixth each on the axis or its extension, on a node, next
    to one, with next to no core, with next to no length, far away."""
    rng = np.random.default_rng(3)
    p, a, edge, away = rng.normal(size=(4, count, 3))
    b, core = a + 0.3 * edge, 10 ** rng.uniform(-3, 0, count)
    if not nasty:
        return p, a, b, core
    kind, along = np.arange(count) % 6, rng.uniform(-2, 3, (count, 1))
    node = np.where(along > 0.5, a, b)
    is_kind = lambda k: (kind == k)[:, None]  # noqa: E731
    p = np.select([is_kind(0), is_kind(1), is_kind(2)], [a + along * (b - a), node, node + 1e-6 * away], p)
    core = np.where(kind == 3, 10.0 ** -rng.integers(4, 300, count), core)
    b = np.where(is_kind(4), a + 10.0 ** -rng.integers(3, 9, (count, 1)) * away, b)
    return np.where(is_kind(5), p * 10.0 ** rng.integers(2, 6, (count, 1)), p), a, b, core


def max_relative_error(count=1000):
    """Largest error on `count` random and as many nasty pairs against mpmath's 50 digits.

    Relative to what the segment induces at that distance when seen square on: on its axis the velocity itself is zero.
    """
    import mpmath

    one = lambda p, a, b, c: segment_velocity(p[None], a[None], b[None], jnp.ones(1), c[None])[0]  # noqa: E731
    worst = 0.0
    for nasty in (False, True):
        pairs = trial_pairs(count, nasty)
        got = np.asarray(jax.jit(jax.vmap(one))(*map(jnp.asarray, pairs)))
        with mpmath.workdps(50):
            for v, p, a, b, core in zip(got, *pairs, strict=True):
                exact = lambda x: mpmath.matrix([mpmath.mpf(float(c)) for c in x])  # noqa: E731
                r1, r2 = exact(p) - exact(a), exact(p) - exact(b)
                edge = r1 - r2
                d1, d2, length = (mpmath.sqrt(sum(c * c for c in x)) for x in (r1, r2, edge))
                c = [r1[k - 2] * r2[k - 1] - r1[k - 1] * r2[k - 2] for k in range(3)]
                spread = 4 * mpmath.pi * (sum(x * x for x in c) + (length * mpmath.mpf(float(core))) ** 2)
                if 0 in (d1, d2, spread):
                    worst = max(worst, float(np.abs(v).max()))
                    continue
                k = sum(edge[j] * (r1[j] / d1 - r2[j] / d2) for j in range(3)) / spread
                error = mpmath.sqrt(sum((x * k - mpmath.mpf(float(y))) ** 2 for x, y in zip(c, v, strict=True)))
                worst = max(worst, float(error / (k * length * d1)))
    return worst


def run_size(library, count, dtype, rounds):
    runs, compiling = kernels(library, count, dtype)
    check_equal(runs, dtype)
    seconds = measure(runs, rounds)
    print(f"\n{np.dtype(dtype).name}, N = M = {count}, {os.cpu_count()} cores, {rounds} rounds")
    print(f"| {'kernel':24s} | median ms | 1e9 pairs/s | time / forward | throughput / C | compile s |")
    print("|---|---|---|---|---|---|")
    for name, times in seconds.items():
        to_forward = np.median(times / seconds["forward"])
        to_c = f"{np.median(seconds['C, all threads'] / times):.2f}" if library is not None else ""
        made = f"{compiling[name]:.1f}" if name in compiling else ""
        print(
            f"| {name:24s} | {1e3 * np.median(times):.2f} | {count**2 / np.median(times) / 1e9:.3f} "
            f"| {to_forward:.2f} | {to_c} | {made} |",
            flush=True,
        )
    return seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--json", type=Path, help="write the six headline figures to this file")
    parser.add_argument("--sizes", type=int, nargs="+", default=[1000, 4000, 16000], help="multiples of 8")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--memory", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    if options.memory:
        return report_memory(options.memory)
    with tempfile.TemporaryDirectory() as folder:
        library = compile_c(Path(folder))
        seconds = {}
        for count in dict.fromkeys([*options.sizes, *([4000] if options.json else [])]):
            for dtype in (np.float64, np.float32):
                rounds = options.rounds if count <= 4000 else max(3, options.rounds // 5)
                seconds[count, dtype] = run_size(library, count, dtype, rounds)
    if options.json is None:
        return None
    double, single = seconds[4000, np.float64], seconds[4000, np.float32]
    ratio = lambda s: None if library is None else float(np.median(s["C, all threads"] / s["forward"]))  # noqa: E731
    figures = {
        "forward_f64_ratio_to_c": ratio(double),
        "forward_f32_ratio_to_c": ratio(single),
        "jvp_over_forward": float(np.median(double["jvp"] / double["forward"])),
        "grad_over_forward": float(np.median(double["gradient of all"] / double["forward"])),
        "grad_peak_memory_mb_at_20000": peak_memory_mb(20000),
        "max_rel_error_f64": max_relative_error(),
    }
    options.json.write_text(json_text(figures, indent=2) + "\n")
    print(json_text(figures, indent=2))
    return None


if __name__ == "__main__":
    main()
