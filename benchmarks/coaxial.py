"""A coaxial pair in the free wake: `python benchmarks/coaxial.py [--json FILE] [--quick] [--ground] [--derivative]`.

Of the rotor that NACA TN 2318 tested (`tn2318_2`), two of them 0.19 R apart in every other place. At equal thrusts,
induced power of the pair over that of two rotors alone, over the distance between them: momentum theory has √2 at no
distance, 1.281 with the lower rotor in the upper one's far wake (Leishman & Syal 2008, doi:10.4050/JAHS.53.11), where
the upper one is alone (1). Polar and thrust sharing at equal torques: `rotorjax validate --case coaxial`.
"""

import argparse
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import rotorjax as rj
from rotorjax.io.atomic import json_text
from rotorjax.wake.several_solution import performance_of

jax.config.update("jax_enable_x64", True)

SPACING = 0.19
DISTANCES = (0.02, 0.05, 0.1, 0.19, 0.4, 0.8, 1.6)
HEIGHTS = (3.0, 2.0, 1.5, 1.0, 0.75)
"""Of the lower rotor over the ground, over R."""


def interference(settings, thrust=0.004):
    """Induced power of the pair over twice the single rotor's, both of one thrust, over distance."""
    rotor, operating = rj.rotor("tn2318_2", 8.0)
    single = rj.solve(rj.free_wake(rotor, operating, None, settings))
    alone = float(single.CP_induced) * (thrust / float(single.CT)) ** 1.5
    rows, found = [], None
    for distance in DISTANCES:
        model = rj.several_wakes(rotor, operating, [(0, 0, 0), (0, 0, -distance)], settings=settings, thrusts=thrust)
        found = rj.solve(model, found)
        ratio = (found.CP_induced / alone).tolist()
        row = {"distance": distance, "upper": ratio[0], "lower": ratio[1], "pair": float(np.mean(ratio))}
        print(json_text(row | {"converged": found.converged, "why": found.why}), flush=True)
        rows.append(row)
    return rows


def over_ground(settings, thrust=0.004):
    """Induced power at one thrust over that in free air, of the pair's rotors and of one alone, over height."""
    rotor, operating = rj.rotor("tn2318_2", 8.0)

    def solved(places, height, start=None):
        ground = None if height is None else rj.plane(height)
        model = rj.several_wakes(rotor, operating, places, settings=settings, ground=ground, thrusts=thrust)
        return rj.solve(model, start)

    pair, single = [(0, 0, SPACING), (0, 0, 0)], [(0, 0, 0)]
    free, rows, found = [solved(places, None) for places in (pair, single)], [], [None, None]
    for height in HEIGHTS:
        found = [solved(places, height, start) for places, start in zip((pair, single), found, strict=True)]
        both, one = (here.CP_induced / there.CP_induced for here, there in zip(found, free, strict=True))
        row = {"height": height, "upper": float(both[0]), "lower": float(both[1]), "single": float(one[0])}
        row["pair"] = float(found[0].CP_induced.sum() / free[0].CP_induced.sum())
        print(json_text(row | {"converged": [f.converged for f in found], "why": [f.why for f in found]}), flush=True)
        rows.append(row)
    return rows


def derivative(settings, thrust=0.004, step=1e-5) -> None:
    """d(ΣC_P)/dC_T of both rotors by the implicit function theorem and by differences."""
    rotor, operating = rj.rotor("tn2318_2", 8.0)
    place = [(0, 0, 0), (0, 0, -SPACING)]

    def pair(thrust, start=None):
        model = rj.several_wakes(rotor, operating, place, settings=settings, thrusts=thrust)
        return rj.solve(model, start, tol=1e-10)

    here = pair(thrust)

    def power(more):
        model = eqx.tree_at(lambda m: m.thrusts, here.found.model, here.found.model.thrusts + more)
        return jnp.sum(performance_of(here.found, model).power)

    forward, reverse = jax.jvp(jax.jit(power), (0.0,), (1.0,))[1], jax.grad(jax.jit(power))(0.0)
    difference = (pair(thrust + step, here).CP.sum() - pair(thrust - step, here).CP.sum()) / (2 * step)
    print(json_text({"forward": float(forward), "reverse": float(reverse), "difference": float(difference)}))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for all numbers")
    parser.add_argument("--quick", action="store_true", help="quick settings of the wake")
    parser.add_argument("--ground", action="store_true", help="the pair over level ground")
    parser.add_argument("--derivative", action="store_true", help="check the derivative of power by thrust, alone")
    chosen = parser.parse_args()
    settings = rj.quick_settings() if chosen.quick else rj.WakeSettings()
    if chosen.derivative:
        derivative(settings)
        return
    found = over_ground(settings) if chosen.ground else interference(settings)
    if chosen.json is not None:
        chosen.json.write_text(json_text(found, indent=1))


if __name__ == "__main__":
    main()
