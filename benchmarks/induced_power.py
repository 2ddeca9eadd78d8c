"""Induced power over the number of blades and their twist: `python benchmarks/induced_power.py`.

Is it twist or the number of blades that takes Caradonna and Tung's rotor beyond 1.25 times the ideal power? Its blades
are twisted by 9° and 18°, or made four of half the chord; the UH-60's lose their twist. The wake's settings are the
default.
"""

from collections.abc import Callable
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp

from rotorjax.bench.settings import study_settings
from rotorjax.reference.published import induced_power_factor, momentum_inflow
from rotorjax.rotor.geometry import Rotor
from rotorjax.validation.measure import disk_inflow
from rotorjax.wake.model import free_wake
from rotorjax.wake.solution import solve

Change = Callable[[Rotor], Rotor]


def twisted(washout_deg: float) -> Change:
    """The same blades with a twist that falls linearly by this from axis to tip in place of their own."""
    washout = jnp.deg2rad(washout_deg)
    return lambda rotor: eqx.tree_at(lambda r: r.twist.values, rotor, -washout * rotor.twist.stations)


def halved(rotor: Rotor) -> Rotor:
    """Twice the blades, each of half the chord."""
    return eqx.tree_at(lambda r: r.chord.values, replace(rotor, blades=2 * rotor.blades), 0.5 * rotor.chord.values)


CASES: tuple[tuple[str, str, Change, tuple[float, ...]], ...] = (
    ("caradonna_tung", "two blades, untwisted", twisted(0.0), (8.0, 11.0)),
    ("caradonna_tung", "two blades, 9° of twist", twisted(9.0), (14.0,)),
    ("caradonna_tung", "two blades, 18° of twist", twisted(18.0), (20.0,)),
    ("caradonna_tung", "four of half the chord, untwisted", halved, (8.0, 11.0)),
    ("uh60", "four blades, untwisted", twisted(0.0), (8.0, 6.0, 10.0, 12.0)),
    ("uh60", "four blades as they are", lambda rotor: rotor, (18.0,)),
)


def main() -> None:
    jax.config.update("jax_enable_x64", True)
    print("rotor           blades                              θ₀     C_T      κ      λ over the disk/√(C_T/2)")
    for name, blades, change, collectives in CASES:
        found = None
        for collective in collectives:
            case = study_settings(name, collective)
            found = solve(free_wake(change(case.rotor), case.operating, None, case.wake), found)
            if not found.converged:
                raise RuntimeError(f"{name}, {blades}, {collective}°: {found.why}")
            factor = induced_power_factor(found.CT, found.CP_induced)
            mean = disk_inflow(found) / momentum_inflow(found.CT)
            print(f"{name:15} {blades:34} {collective:4.0f}° {found.CT:8.5f} {factor:6.3f} {mean:8.3f}", flush=True)


if __name__ == "__main__":
    main()
