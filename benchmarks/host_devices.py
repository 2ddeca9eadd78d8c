"""Can two host devices use two cores better than one device with two threads? The Biot–Savart sum, sharded by points.

    python benchmarks/host_devices.py [--rounds 15]

XLA's CPU back end shows the cores as one device. `--xla_force_host_platform_device_count` splits them into several, and
`shard_map` then gives each its share of the points. Both run in turn in one process; ratios are medians.
"""

import argparse
import os
import time

os.environ["XLA_FLAGS"] = os.environ.get("XLA_FLAGS", "") + " --xla_force_host_platform_device_count=2"

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh
from jax.sharding import PartitionSpec as P

from rotorjax.wake.biot_savart import segment_velocity


def seconds(run, rounds):
    """Median time of a call of each function, all in turn."""
    times = {name: [] for name in run}
    for _ in range(rounds):
        for name, call in run.items():
            begin = time.perf_counter()
            jax.block_until_ready(call())
            times[name].append(time.perf_counter() - begin)
    return {name: float(np.median(t)) for name, t in times.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    jax.config.update("jax_enable_x64", True)
    mesh = Mesh(np.array(jax.devices()), ("points",))
    whole = (P(),) * 4
    print("   N    one device    two devices    two / one    largest difference")
    for count in (1000, 4000, 16000):
        rng = np.random.default_rng(0)
        args = [jnp.asarray(rng.normal(size=s)) for s in ((count, 3), (count, 3), (count, 3), (count,))]
        args.append(jnp.full(count, 0.03))
        one = jax.jit(segment_velocity)
        # check_vma: the kernel's own primitive has no rule for replication
        split = jax.shard_map(
            segment_velocity, mesh=mesh, in_specs=(P("points"), *whole), out_specs=P("points"), check_vma=False
        )
        two = jax.jit(split)
        difference = float(jnp.max(jnp.abs(np.asarray(one(*args)) - np.asarray(two(*args)))))
        found = seconds({"one": lambda f=one, a=args: f(*a), "two": lambda f=two, a=args: f(*a)}, rounds)
        print(
            f"{count:6d} {1e3 * found['one']:9.1f} ms {1e3 * found['two']:11.1f} ms "
            f"{found['two'] / found['one']:11.2f} {difference:16.1e}"
        )


if __name__ == "__main__":
    main()
