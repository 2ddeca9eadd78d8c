"""A coaxial pair in the free wake: `python benchmarks/coaxial.py [--out DIR] [--quick] [--derivative]`.

The rotor that NACA TN 2318 tested (Harrington 1951): two two-bladed rotors, radius 3.81 m, chord 0.4572 m, untwisted,
0.19 R apart, solidity 0.152 together; the section is taken as NACA 0012. Prints C_T and C_Q of pair and single rotor
over collective, both rotors of the pair at the same torque; then, at equal thrusts, induced power of the pair over
that of two rotors alone, over the distance between them; momentum theory has √2 at no distance, 1.281 with the lower
rotor in the upper one's far wake (Leishman & Syal 2008, doi:10.4050/JAHS.53.11).
"""

import argparse
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import rotorjax as rj
from rotorjax.bench.plotting import new_figure, save_file, style
from rotorjax.io.atomic import json_text
from rotorjax.wake.several_solution import performance_of

jax.config.update("jax_enable_x64", True)

SPACING, TIP_SPEED = 0.19, 119.5  # over R; m/s (392 ft/s)
COLLECTIVES = (5.0, 7.0, 9.0, 11.0)
DISTANCES = (0.1, 0.19, 0.4, 0.8)


def harrington():
    section = rj.rotor("caradonna_tung")[0].airfoil
    rotor = rj.make_rotor("harrington_2", 2, 3.81, 0.2, 0.4572, section)
    return rotor, rj.operating_point(TIP_SPEED / 3.81)


def at(operating, degrees):
    return rj.operating_point(operating.omega, collective=float(np.deg2rad(degrees)))


def polar(settings) -> list[dict]:
    """C_T and C_Q (equal to C_P) of the single rotor and of the pair, balanced in torque to 1 % by the secant rule."""
    rotor, operating = harrington()
    rows, pair = [], None
    for degrees in COLLECTIVES:
        single = rj.solve(rj.free_wake(rotor, at(operating, degrees), None, settings))
        more, last = 0.5, None  # degrees of the lower rotor beyond the upper one
        for _ in range(5):
            angles = [degrees - more / 2, degrees + more / 2]
            model = rj.several_wakes(
                rotor, operating, [(0, 0, 0), (0, 0, -SPACING)], settings=settings, collectives_deg=angles
            )
            pair = rj.solve(model, pair)
            gap = float(pair.CP[1] / pair.CP[0] - 1)
            if abs(gap) < 0.01 or not pair.converged:
                break
            step = 0.5 if last is None else -gap * (more - last[0]) / (gap - last[1])
            last, more = (more, gap), more + float(np.clip(step, -2, 2))
        row = {
            "collective_deg": degrees,
            "single": [float(single.CT), float(single.CP)],
            "pair": [float(pair.CT.sum()), float(pair.CP.sum())],
            "share_upper": float(pair.CT[0] / pair.CT.sum()),
            "torque_gap": gap,
            "converged": bool(single.converged and pair.converged),
        }
        print(json_text(row), flush=True)
        rows.append(row)
    return rows


def interference(settings, thrust=0.004):
    """Induced power of the pair over twice the single rotor's, both of one thrust, over distance."""
    rotor, operating = harrington()
    single = rj.solve(rj.free_wake(rotor, at(operating, 8), None, settings))
    alone = float(single.CP_induced) * (thrust / float(single.CT)) ** 1.5
    rows, found = [], None
    for distance in DISTANCES:
        model = rj.several_wakes(
            rotor, at(operating, 8), [(0, 0, 0), (0, 0, -distance)], settings=settings, thrusts=thrust
        )
        found = rj.solve(model, found)
        ratio = (found.CP_induced / alone).tolist()
        row = {"distance": distance, "upper": ratio[0], "lower": ratio[1], "pair": float(np.mean(ratio))}
        print(json_text(row | {"converged": found.converged, "why": found.why}), flush=True)
        rows.append(row)
    return rows


def derivative(settings, thrust=0.004, step=1e-5) -> None:
    """d(ΣC_P)/dC_T of both rotors by the implicit function theorem and by differences."""
    rotor, operating = harrington()
    place = [(0, 0, 0), (0, 0, -SPACING)]

    def pair(thrust, start=None):
        model = rj.several_wakes(rotor, at(operating, 8), place, settings=settings, thrusts=thrust)
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
    parser.add_argument("--out", type=Path, help="folder for polar.png and coaxial.json")
    parser.add_argument("--quick", action="store_true", help="quick settings of the wake")
    parser.add_argument("--derivative", action="store_true", help="check the derivative of power by thrust, alone")
    chosen = parser.parse_args()
    settings = rj.quick_settings() if chosen.quick else rj.WakeSettings()
    if chosen.derivative:
        derivative(settings)
        return
    rows, near = polar(settings), interference(settings)
    if chosen.out is None:
        return
    chosen.out.mkdir(parents=True, exist_ok=True)
    (chosen.out / "coaxial.json").write_text(json_text({"polar": rows, "interference": near}, indent=1))
    with style():
        figure = new_figure(6, 4)
        axes = figure.add_subplot()
        for name, label in (("single", "single rotor"), ("pair", "pair, equal torques")):
            thrust, torque = np.array([row[name] for row in rows]).T
            axes.plot(torque, thrust, marker="o", label=label)
        axes.set(xlabel="$C_Q$, both rotors", ylabel="$C_T$, both rotors", title="Coaxial rotors 0.19 R apart")
        axes.legend()
    save_file(figure, chosen.out / "polar.png")


if __name__ == "__main__":
    main()
