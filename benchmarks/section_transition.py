"""Knight and Hefner's rotors over where their section turns turbulent: `python benchmarks/section_transition.py`.

Thrust at a given pitch, torque and figure of merit at a given thrust, less what was measured. The blades' Reynolds
numbers, up to 242 000, are those of a laminar separation bubble, and how much that lifts depends on how turbulent the
air is. In place of the report's section, measured in a wind tunnel before 1937: NACA 0015 by NeuralFoil (a fit to
XFOIL's e^N; `pip install neuralfoil`, written with 0.3.3), at each Mach number with the Reynolds number that a station
has there. N = 9 is still air, 4 is air with 0.6 % of turbulence (Mack 1977, Tu = exp(-(N + 8.43)/2.4)).
"""

import argparse

import equinox as eqx
import jax
import numpy as np

import rotorjax as rj
from rotorjax.reference.published import figure_of_merit, knight_hefner
from rotorjax.rotor.airfoil import AirfoilTable, airfoil_table, lift_drag
from rotorjax.rotor.full_range import FLAT_PLATE, completed
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import hover_settings
from rotorjax.wake.solution import solve

ROTORS = {2: "knight_hefner_2", 4: "knight_hefner_4"}
PITCHES_DEG = (8.0, 6.0, 4.0, 10.0)
REPORTED = (1.7, 3.375, 5.025, 6.675)  # angles of the section's test, below stall
TIP_REYNOLDS, TIP_MACH = 242e3, 0.2251
MACH = np.array([0.05, 0.1, 0.15, 0.2, 0.225, 0.25])


def section(exponent: float) -> AirfoilTable:
    """NACA 0015 with transition where disturbances have grown by e^exponent; a flat plate beyond 17.5°."""
    try:
        import aerosandbox
        import neuralfoil
    except ImportError as error:
        raise SystemExit(f"section_transition.py needs {error.name}: pip install neuralfoil") from error

    shape, alpha = aerosandbox.Airfoil("naca0015"), np.arange(0.0, 18.0, 0.5)
    found = [
        neuralfoil.get_aero_from_airfoil(
            shape, alpha=alpha, Re=TIP_REYNOLDS * mach / TIP_MACH, n_crit=exponent, model_size="xxxlarge"
        )
        for mach in MACH
    ]
    lift = np.stack(
        [(f["CL"] - f["CL"][0]) / np.sqrt(1 - mach**2) for f, mach in zip(found, MACH, strict=True)], axis=1
    )
    drag = np.stack([f["CD"] for f in found], axis=1)
    whole = completed((alpha, MACH, lift), (alpha, MACH, drag), FLAT_PLATE, symmetric=True)
    return airfoil_table(*whole, f"NACA 0015, e^{exponent:g}")


def rows(blades: int, air: AirfoilTable | None, pitches: tuple[float, ...]) -> list[str]:
    """What is printed of one rotor with a section, its own where there is none."""
    told, found, polar = [], None, knight_hefner(blades)
    for pitch in pitches:
        rotor, operating = rj.rotor(ROTORS[blades], pitch)
        rotor = rotor if air is None else eqx.tree_at(lambda r: r.airfoil, rotor, air)
        found = solve(free_wake(rotor, operating, None, hover_settings()), found)
        if not found.converged:
            raise RuntimeError(f"{ROTORS[blades]}, {pitch}°: {found.why}")
        thrust = found.CT / np.interp(pitch, polar.pitch_deg, polar.thrust) - 1
        measured = np.interp(found.CT, polar.thrust, polar.torque)
        merit = figure_of_merit(found.CT, found.CP) - figure_of_merit(found.CT, measured)
        told.append(f"{pitch:5.0f}° {100 * thrust:+6.1f} % {100 * (found.CP / measured - 1):+6.1f} % {merit:+7.3f}")
    return sorted(told)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="8° only")
    pitches = PITCHES_DEG[:1] if parser.parse_args().quick else PITCHES_DEG
    jax.config.update("jax_enable_x64", True)
    own = rj.rotor(ROTORS[2])[0].airfoil
    sections = {"as reported": None, "e^4": section(4.0), "e^6": section(6.0), "e^9": section(9.0)}
    for name, air in sections.items():
        lift, drag = lift_drag(own if air is None else air, np.deg2rad(REPORTED), np.full(len(REPORTED), TIP_MACH))
        print(
            f"{name}: c_l", *(f"{c:.3f}" for c in lift), " c_d", *(f"{c:.4f}" for c in drag), f"at {REPORTED}°, r = R"
        )
        for blades in ROTORS:
            print(f"  {blades} blades      C_T  C_Q at C_T  figure of merit", *rows(blades, air, pitches), sep="\n  ")


if __name__ == "__main__":
    main()
