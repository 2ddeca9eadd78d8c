"""The linear rotor: what it costs and how true it is, for the UH-60 at C_T = .00575.

Prints, for each inflow and flight:
1. seconds from a trim to the periodic model, the first time (compiling) and again, and to modes and a reduced model;
2. the reduced model against the periodic one's harmonic-0 transfer function up to 2/rev, dB and degrees, for θ₀ → C_T,
   θ₁c → β₁s, w → C_T and q → M;
3. the periodic model against the nonlinear march over a revolution, steps of θ₀, θ₁c, w, q and height, in % of the
   response's largest value: worst over C_T, L, M, blades' flap and inflow, and over every output; this again with a
   straight lag damper, for torque and forces in the disk's plane after a step cross kinks of its table;
4. exponents by design parameters against central differences, relative to the largest.

5. with --wake, the free wake at μ = .15: seconds of each stage from the trim on (compilation in the first of each), of
   the linearisation without compiling (from the first azimuth to the last), peak memory, the errors of 2 and 3, those
   of the condensed model, the leading exponents, and errors of torque and forces in the disk's plane with the damper's
   table and with a straight damper;
6. with --table, an inflow identified over μ and h from the linear free wake (coarse wakes), its error over a revolution
   beside Pitt and Peters' own, and at flights held out, at a μ and at a height of their own; and at the first of these
   the matrices between those of the flights beside it.

    python benchmarks/linear_rotor.py [--inflow pitt-peters vpbfsm] [--order 20] [--wake] [--table DIR] [--json FILE]
"""

import argparse
import resource
import time
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.io.atomic import json_text, make_folder
from rotorjax.linearisation import flight, identified, identify, rotor, steps, wake_flight
from rotorjax.linearisation.compact import compact, frequencies, motion_of
from rotorjax.linearisation.condensed import Condensed, aligned
from rotorjax.linearisation.found import CONTROLS, OUTPUTS, Wanted
from rotorjax.linearisation.modes import modes
from rotorjax.linearisation.sensitivity import sensitivity
from rotorjax.ode.harmonic import average
from rotorjax.ode.hill import harmonic_transfer
from rotorjax.ode.runge_kutta import RK4
from rotorjax.rotor.monotone import with_slopes
from rotorjax.trim.in_wake import TrimmedInWake
from rotorjax.trim.run import Request, request, run
from rotorjax.trim.solve import trim
from rotorjax.wake.settings import flight_settings

THRUST = 0.00575
FLIGHTS = {"hover": {}, "h = 1": {"height": 1.0}, "μ = .15": {"advance": 0.15}, "μ = .3": {"advance": 0.3}}
STEPPED = ("theta_0", "theta_1c", "w", "q")
PAIRS = (("CT", "theta_0"), ("beta_1s", "theta_1c"), ("CT", "w"), ("M", "q"))
MAIN = ("CT", "L", "M", "beta_0", "beta_1c", "beta_1s", "lambda_0", "lambda_1c", "lambda_1s")
INPLANE = ("CQ", "X", "Y")
COARSE = {"panels": 8, "age_step_deg": 20.0, "near_wake_deg": 100.0}
SPEEDS, HEIGHTS = (0.1, 0.15, 0.2), (None, 2.0, 1.0)
HELD_OUT = ((0.125, None), (0.175, None), (0.125, 1.4), (0.15, 1.4), (0.175, 1.4))
"""The table's flights, and those that it has not seen: μ and height over R."""
PARAMETERS = {
    "hinge offset": (lambda design: design[1].blade.offset, 1e-5),
    "density over inertia": (lambda design: design[1].blade.air, 1e-4),
    "thrust": (lambda design: design[0].thrust, 1e-7),
    "twist": (lambda design: design[1].rotor.twist.values, 1e-5),
    "height": (lambda design: design[0].height, 1e-5),
}
"""Where each stands in flight and rotor, and the differences' step. Twist: linear, rad over R."""


class InWake(NamedTuple):
    """A flight in a coarse wake. small, truth: condensed model, and unit steps of that of all states."""

    request: Request
    trimmed: TrimmedInWake
    small: Condensed
    truth: np.ndarray


def timed(call):
    """Result and seconds of a call."""
    begin = time.perf_counter()
    found = call()
    return found, time.perf_counter() - begin


def row(inflow, name, order):
    """One flight."""
    result, trim_s = timed(lambda: run(request("uh60", THRUST, inflow, **FLIGHTS[name])))
    base = rotor.base_of(result.trimmed)
    _, first_s = timed(lambda: rotor.linear_rotor(base, CONTROLS, OUTPUTS))
    model, again_s = timed(lambda: rotor.linear_rotor(base, CONTROLS, OUTPUTS))
    truth = harmonic_transfer(model, frequencies())[:, 0]
    found, modes_s = timed(lambda: modes(model))
    small, reduce_s = timed(lambda: compact(average(model), order, truth, motion_of(model)))
    where = {f"{q}/{m}": (model.outputs.index(q), model.inputs.index(m)) for q, m in PAIRS}
    names = STEPPED + (("height",) if result.request.height else ())
    error, main = stepped(base, names), [OUTPUTS.index(n) for n in MAIN]
    trimmed = result.trimmed
    smooth = trim(straight_damper(trimmed.p), trimmed.flight, trimmed.residual, trimmed.z)
    without = stepped(rotor.base_of(smooth), names)
    return result, {
        "inflow": inflow,
        "flight": name,
        "converged": result.converged,
        "states": model.order,
        "trim_s": trim_s,
        "linear_first_s": first_s,
        "linear_again_s": again_s,
        "modes_s": modes_s,
        "reduce_s": reduce_s,
        "reduced_order": small.model.order,
        "unstable": small.unstable,
        "gap_db": {k: float(small.gap_db[v]) for k, v in where.items()},
        "gap_deg": {k: float(small.gap_deg[v]) for k, v in where.items()},
        "step_error_main": {n: float(error[main, m].max()) for m, n in enumerate(names)},
        "step_error_all": {n: float(error[:, m].max()) for m, n in enumerate(names)},
        "worst_step": {n: OUTPUTS[int(np.argmax(error[:, m]))] for m, n in enumerate(names)},
        "step_error_straight_damper": {n: float(without[:, m].max()) for m, n in enumerate(names)},
        "modes": {m.name: [m.exponent.real, m.exponent.imag] for m in found},
    }


def stepped(base, names):
    """Errors (q, m) of the linear model's steps, over every output."""
    model = rotor.linear_rotor(base, names, OUTPUTS)
    by_model = steps.modelled(model, [steps.size_of(name) for name in names])
    return steps.largest_gap(steps.marched(base, names, OUTPUTS), by_model)


def straight_damper(p):
    """The rotor with a linear lag damper: one line from end to end of its table."""
    rate, end = p.blade.damper_rate, p.blade.damper_force[-1, 0]
    return eqx.tree_at(lambda q: q.blade.damper_force, p, with_slopes(rate, rate * end / rate[-1], jnp))


def wake_without_kinks(trimmed):
    """Errors (q, m) of the free wake's linear steps with a straight damper, about a periodic march of its own."""
    base = rotor.base_of(trimmed)
    base = wake_flight.base_in_flight(base._replace(p=straight_damper(base.p)), rotor.AZIMUTHS)
    model = wake_flight.all_states(base, CONTROLS, OUTPUTS)
    unit = model.step(base.p.rotor.blades) * np.array([steps.size_of(name) for name in CONTROLS])
    marched = steps.marched(base, CONTROLS, OUTPUTS, base.p.rotor.blades * model.steps, 1, RK4)
    return steps.largest_gap(marched, unit)


def wake_row(order):
    """The free wake in forward flight."""
    passed = []

    def progress(stage, _):
        if stage.startswith("linearisation "):
            passed.append(time.perf_counter())

    found = flight.linearise_trim(request("uh60", THRUST, "freewake", advance=0.15), Wanted(order=order), progress)
    if not isinstance(found, flight.LinearFlight):
        raise SystemExit(f"freewake, μ = .15: {found.trimmed.outcome.why}")
    model, wake = found.periodic, found.wake
    where = {f"{q}/{m}": (model.outputs.index(q), model.inputs.index(m)) for q, m in PAIRS}
    main, ins = [model.outputs.index(n) for n in MAIN], [model.inputs.index(n) for n in STEPPED]
    rest = {"damper's table": wake.step_error, "straight damper": wake_without_kinks(found.result.trimmed)}
    inplane = [model.outputs.index(n) for n in INPLANE]
    return {
        "inflow": "freewake",
        "flight": "μ = .15",
        "states": wake.states,
        "azimuths": wake.azimuths,
        "stages_s": found.seconds,
        "linearised_compiled_s": (passed[-1] - passed[0]) * len(passed) / (len(passed) - 1),
        "peak_GB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
        "gap_db": {k: float(found.small.gap_db[v]) for k, v in where.items()},
        "gap_deg": {k: float(found.small.gap_deg[v]) for k, v in where.items()},
        "step_error_main": {n: float(wake.step_error[main, m].max()) for n, m in zip(STEPPED, ins, strict=True)},
        "step_error_inplane": {
            damper: {n: [float(v) for v in error[inplane, m]] for n, m in zip(STEPPED, ins, strict=True)}
            for damper, error in rest.items()
        },
        "step_error_median": float(np.median(wake.step_error)),
        "condensed_error_main": {
            n: float(wake.condensed_error[main, m].max()) for n, m in zip(STEPPED, ins, strict=True)
        },
        "condensed_error_median": float(np.median(wake.condensed_error)),
        "modes": {m.name: [m.exponent.real, m.exponent.imag] for m in found.modes},
    }


def in_wake(advance, height, near):
    """Request, trim, condensed model and unit steps of a flight in a coarse free wake, from a flight nearby."""
    wanted = request("uh60", THRUST, "freewake", advance=advance, height=height)
    wanted = replace(wanted, wake=flight_settings(4, **COARSE))
    result = run(wanted, near and near.trimmed)
    if not result.converged:
        raise SystemExit(f"coarse wake at μ = {advance:g}, h = {height}: {result.trimmed.outcome.why}")
    base = wake_flight.base_in_flight(rotor.base_of(result.trimmed), rotor.AZIMUTHS)
    model = wake_flight.all_states(base, identified.INPUTS, (*identified.OUTPUTS, "lambda_0"))
    return InWake(wanted, result.trimmed, *wake_flight.condense(model, base, near and near.small.model))


def table_rows(speeds, heights, held, folder):
    """Errors of an inflow identified over a grid, in it and at flights held out, beside Pitt and Peters' own."""
    found, flown, near = [], {}, None
    for height in heights:
        for advance in speeds:
            near, took = timed(lambda mu=advance, h=height, n=near: in_wake(mu, h, n))
            flown[advance, height] = near
            found.append(identify.fitted(average(near.small.model), near.request))
            print(f"{identify.lines(found[-1:])[0]}; {took:.0f} s", flush=True)
            identify.write(found, folder)  # as far as it is
    data = identified.table(found)
    print(identified.text(data))
    there = {place: in_wake(*place, near) for place in held}
    rows = [held_out(data, one) for one in there.values()]
    mu, height = held[0]
    below, over = max(v for v in speeds if v <= mu), min(v for v in speeds if v >= mu)
    ends = [flown[speed, height] for speed in (below, over) if height in heights]
    return {"text": identified.text(data), "held_out": rows} | matrices_between(ends, there[held[0]])


def held_out(data, flown):
    """Error at a flight that a table has not seen, of what is interpolated in it and of Pitt and Peters' own."""
    advance, height = flown.request.advance, flown.request.height or np.inf
    start = identify.beside(flown.request)
    target = identified.target_of(average(flown.small.model), start.rotor)
    between = identified.interpolated(data, advance, height)
    error, own = (identified.error_of(inflow, start.inflow, target, start.rotor) for inflow in (between, start.inflow))
    print(
        f"held out μ = {advance:g}, h = {height:g}: {100 * error:.1f} %, Pitt and Peters' own {100 * own:.1f} %: "
        f"{error / own:.2f} of it",
        flush=True,
    )
    return {"advance_ratio": advance, "height": height, "error": error, "pitt_peters_error": own}


def matrices_between(ends, there):
    """Error of steps by matrices half way between those of the first and last flight, beside the condensed model's."""
    if len(ends) < 2:
        return {}
    one, two = aligned([ends[0].small, ends[-1].small])
    middle = replace(one, **{name: (getattr(one, name) + getattr(two, name)) / 2 for name in "abcd"})
    truth, errors = there.truth, {}
    for name, model in (("condensed", there.small.model), ("between", middle), ("first", one)):
        own = np.stack([model.step(column)[1] for column in np.eye(len(model.inputs))], axis=-1)
        gap = steps.largest_gap(truth, own)
        errors[name] = {"median": float(np.median(gap)), "CT/theta_0": float(gap[0, 0])}
    print("a revolution after a step, over the largest response, by", errors)
    return {"between": errors}


def derivatives(trimmed):
    """Largest gap of the exponents' derivatives from central differences, over the largest derivative."""
    gaps, design = {}, (trimmed.flight, trimmed.p)
    for name, (where, step) in PARAMETERS.items():
        if where(design) is None:
            continue
        way = trimmed.p.rotor.twist.stations if name == "twist" else np.ones(())
        found, ends = sensitivity(trimmed, where, way=way), []
        for change in (step * way, -step * way):
            condition, p = eqx.tree_at(where, design, where(design) + change)
            end = sensitivity(trim(p, condition, trimmed.residual, trimmed.z), where, way=way).exponents
            ends.append(np.array([end[np.argmin(np.abs(end - v))] for v in found.exponents]))
        slopes = (ends[0] - ends[1]) / (2 * step)
        gaps[name] = float(np.abs(slopes - found.exponents_by).max() / np.abs(slopes).max())
    return gaps


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--inflow", nargs="*", default=["pitt-peters"], help="none: neither models nor derivatives")
    parser.add_argument("--order", type=int, default=20)
    parser.add_argument("--wake", action="store_true", help="the free wake in forward flight too, some minutes")
    parser.add_argument("--table", metavar="DIR", help="an identified inflow over μ and h, written there; some minutes")
    parser.add_argument("--json", help="file to write")
    chosen = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    rows, found = [], {}
    for inflow in chosen.inflow:
        for name in FLIGHTS:
            result, one = row(inflow, name, chosen.order)
            rows.append(one)
            print(
                f"{inflow}, {name}: {one['states']} states; linear {one['linear_first_s']:.1f} s first, "
                f"{one['linear_again_s']:.2f} s again; modes {one['modes_s']:.2f} s; to {one['reduced_order']} states "
                f"{one['reduce_s']:.2f} s, {one['unstable']} unstable"
            )
            print("  reduced:", ", ".join(f"{k} {v:.2f} dB {one['gap_deg'][k]:.1f}°" for k, v in one["gap_db"].items()))
            for text, key in (
                ("main", "step_error_main"),
                ("all", "step_error_all"),
                ("all, straight lag damper", "step_error_straight_damper"),
            ):
                print(f"  steps, {text}:", ", ".join(f"{k} {100 * v:.2f} %" for k, v in one[key].items()))
            if inflow == "pitt-peters" and name in ("h = 1", "μ = .15"):
                found[name] = derivatives(result.trimmed)
                print("  derivatives:", ", ".join(f"{k} {v:.0e}" for k, v in found[name].items()), flush=True)
    if chosen.wake:
        rows.append(wake_row(chosen.order))
        print(json_text(rows[-1], indent=1))
    table = {}
    if chosen.table:
        table = table_rows(SPEEDS, HEIGHTS, HELD_OUT, make_folder(Path(chosen.table)))
    if chosen.json:
        with open(chosen.json, "w") as file:
            file.write(json_text({"flights": rows, "derivatives": found, "identified": table}, indent=1))


if __name__ == "__main__":
    main()
