"""In which depth does the finite states' wake contract? `python benchmarks/contraction.py [--quick] [--clearance C]`.

For each length of the contraction: rms difference from the free wake's inflow under the free wake's loads, over its
mean out of ground effect, in free air and over level ground; and of the finite states with their own blade loads
induced power in free air over the ideal, which may not be less than 1, and at constant thrust over ground over that in
free air. The UH-60 at 18° chose the length, by the differences and with its power in view; its other pitch and the
other rotors are judged.
"""

import argparse
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.bench.cases import Case
from rotorjax.bench.finite_state import model_of
from rotorjax.bench.record import rms_difference
from rotorjax.bench.settings import StudySettings, study_settings
from rotorjax.inflow.balance import Stations, pressure
from rotorjax.potential.contraction import CLEARANCE, contraction
from rotorjax.potential.model import FiniteStateModel, steady_state, unit_inflow, unit_states
from rotorjax.validation.finite_state import MEASURED, own_powers
from rotorjax.validation.point import Point
from rotorjax.wake.solution import Solution, solve

LENGTHS = (0.1, 0.15, 0.2, 0.25, 0.3, 0.35)
HEIGHTS = (None, 2.0, 1.5, 1.0, 0.75)
CASES = (("uh60", 18.0), ("uh60", 14.0), ("caradonna_tung", 8.0), ("knight_hefner_2", 8.0), ("knight_hefner_4", 8.0))


def contracting(length: float, clearance: float, height: float | None, settings: StudySettings) -> FiniteStateModel:
    """The default model with another contraction."""
    wake = contraction(length=length, clearance=clearance)
    return eqx.tree_at(lambda m: m.wake, model_of(Case(height), settings), wake)


@eqx.filter_jit
def _inflow(model: FiniteStateModel, loads: jax.Array, stations: Stations) -> jax.Array:
    state = steady_state(model, pressure(loads, stations, model))
    return jnp.tensordot(state.a, unit_inflow(model, unit_states(model), *stations.xy), 1)


def difference(model: FiniteStateModel, wake: Solution, mean: float) -> float:
    """Rms difference from a free wake's inflow over `mean`."""
    stations = Stations(jnp.asarray(wake.r), jnp.asarray(wake.widths), 2 * np.pi / 8 * jnp.arange(8))
    loads = jnp.broadcast_to(jnp.asarray(wake.dct_dr), (8, wake.r.size))
    return rms_difference(np.asarray(_inflow(model, loads, stations)) / mean, wake.inflow / mean, wake.widths)


def wakes_of(rotor: str, pitch: float, quick: bool) -> list[Solution]:
    """Free wakes at HEIGHTS."""
    found: list[Solution] = []
    for height in HEIGHTS:
        found.append(solve(Point(rotor, pitch, height).model(quick), found[-1] if found else None))
        if not found[-1].converged:
            raise RuntimeError(f"{rotor} at {pitch:g}°, h = {height}: {found[-1].why}")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clearance", type=float, default=CLEARANCE, help="height at which it contracts half as much")
    parser.add_argument(
        "--quick", action="store_true", help="the coarse wake of `rotorjax study --quick`; UH-60 at 18°"
    )
    options = parser.parse_args()
    clearance, quick = options.clearance, options.quick
    jax.config.update("jax_enable_x64", True)
    print(f"clearance {clearance:g} R; differences OGE, h =", *HEIGHTS[1:], "; power OGE; ratios at h =", *MEASURED)
    for rotor, pitch in CASES[:1] if quick else CASES:
        settings, wakes = study_settings(rotor, pitch, quick=quick), wakes_of(rotor, pitch, quick)
        for length in LENGTHS:
            apart = [
                difference(contracting(length, clearance, height, settings), wake, wakes[0].mean_inflow)
                for height, wake in zip(HEIGHTS, wakes, strict=True)
            ]
            ratios, factor = own_powers(settings, partial(contracting, length, clearance))
            print(
                f"{rotor:16} {pitch:3.0f}° L {length:4.2f} R:", *(f"{a:.3f}" for a in apart),
                f"; {factor:.3f};", *(f"{a:.3f}" for a in ratios), flush=True,
            )  # fmt: skip


if __name__ == "__main__":
    main()
