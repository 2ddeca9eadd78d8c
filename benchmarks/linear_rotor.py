"""The linear rotor: what it costs and how true it is, for the UH-60 at C_T = .00575.

Prints, for each inflow and flight:
1. seconds from a trim to the periodic model, the first time (compiling) and again, and to modes and a reduced model;
2. the reduced model against the periodic one's harmonic-0 transfer function up to 2/rev, dB and degrees, for θ₀ → C_T,
   θ₁c → β₁s, w → C_T and q → M;
3. the periodic model against the nonlinear march over a revolution, steps of θ₀, θ₁c, w, q and height, in % of the
   response's largest value: worst over C_T, L, M, blades' flap and inflow, and over every output;
4. exponents by design parameters against central differences, relative to the largest.

5. with --wake, the free wake at μ = .15: seconds of each stage from the trim on (compilation in the first of each),
   peak memory, the errors of 2 and 3, those of the condensed model, and the leading exponents.
6. with --table, an inflow identified over μ and h from the linear free wake (coarse wakes), its error over a revolution
   beside Pitt and Peters' own, and at a flight held out; and there the matrices between those of two other flights.

    python benchmarks/linear_rotor.py [--inflow pitt-peters vpbfsm] [--order 20] [--wake] [--table] [--json FILE]
"""

import argparse
import resource
import time
from dataclasses import replace

import equinox as eqx
import jax
import numpy as np

from rotorjax.io.atomic import json_text
from rotorjax.linearisation import flight, identified, rotor, steps, wake_flight
from rotorjax.linearisation.compact import compact, frequencies
from rotorjax.linearisation.condensed import aligned
from rotorjax.linearisation.found import CONTROLS, OUTPUTS, Wanted
from rotorjax.linearisation.modes import modes
from rotorjax.linearisation.sensitivity import sensitivity
from rotorjax.ode.harmonic import average
from rotorjax.ode.hill import harmonic_transfer
from rotorjax.trim.run import request, run
from rotorjax.trim.solve import trim
from rotorjax.wake.settings import flight_settings

THRUST = 0.00575
FLIGHTS = {"hover": {}, "h = 1": {"height": 1.0}, "μ = .15": {"advance": 0.15}, "μ = .3": {"advance": 0.3}}
STEPPED = ("theta_0", "theta_1c", "w", "q")
PAIRS = (("CT", "theta_0"), ("beta_1s", "theta_1c"), ("CT", "w"), ("M", "q"))
MAIN = ("CT", "L", "M", "beta_0", "beta_1c", "beta_1s", "lambda_0", "lambda_1c", "lambda_1s")
COARSE = {"panels": 8, "age_step_deg": 20.0, "near_wake_deg": 100.0}
PARAMETERS = {
    "hinge offset": (lambda design: design[1].blade.offset, 1e-5),
    "density over inertia": (lambda design: design[1].blade.air, 1e-4),
    "thrust": (lambda design: design[0].thrust, 1e-7),
}


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
    small, reduce_s = timed(lambda: compact(average(model), order, truth))
    where = {f"{q}/{m}": (model.outputs.index(q), model.inputs.index(m)) for q, m in PAIRS}
    names = STEPPED + (("height",) if result.request.height else ())
    stepped = rotor.linear_rotor(base, names, OUTPUTS)
    sizes = [steps.size_of(n) for n in names]
    error = steps.largest_gap(steps.marched(base, names, stepped.outputs), steps.modelled(stepped, sizes))
    main = [stepped.outputs.index(n) for n in MAIN]
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
        "worst_step": {n: stepped.outputs[int(np.argmax(error[:, m]))] for m, n in enumerate(names)},
        "modes": {m.name: [m.exponent.real, m.exponent.imag] for m in found},
    }


def wake_row(order):
    """The free wake in forward flight."""
    found = flight.linearise_trim(request("uh60", THRUST, "freewake", advance=0.15), Wanted(order=order))
    if not isinstance(found, flight.LinearFlight):
        raise SystemExit(f"freewake, μ = .15: {found.trimmed.outcome.why}")
    model, wake = found.periodic, found.wake
    where = {f"{q}/{m}": (model.outputs.index(q), model.inputs.index(m)) for q, m in PAIRS}
    main, ins = [model.outputs.index(n) for n in MAIN], [model.inputs.index(n) for n in STEPPED]
    return {
        "inflow": "freewake",
        "flight": "μ = .15",
        "states": wake.states,
        "azimuths": wake.azimuths,
        "stages_s": found.seconds,
        "peak_GB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
        "gap_db": {k: float(found.small.gap_db[v]) for k, v in where.items()},
        "gap_deg": {k: float(found.small.gap_deg[v]) for k, v in where.items()},
        "step_error_main": {n: float(wake.step_error[main, m].max()) for n, m in zip(STEPPED, ins, strict=True)},
        "step_error_median": float(np.median(wake.step_error)),
        "condensed_error_main": {
            n: float(wake.condensed_error[main, m].max()) for n, m in zip(STEPPED, ins, strict=True)
        },
        "condensed_error_median": float(np.median(wake.condensed_error)),
        "modes": {m.name: [m.exponent.real, m.exponent.imag] for m in found.modes},
    }


def in_wake(advance, height, near):
    """Trim, condensed model, basis and unit steps of a flight in a coarse free wake, from a flight nearby."""
    wanted = request("uh60", THRUST, "freewake", advance=advance, height=height)
    result = run(replace(wanted, wake=flight_settings(4, **COARSE)), near and near[0].trimmed)
    base = wake_flight.base_in_flight(rotor.base_of(result.trimmed), rotor.AZIMUTHS)
    model = wake_flight.all_states(base, identified.INPUTS, (*identified.OUTPUTS, "lambda_0"))
    small, truth = wake_flight.condense(model, base, near and near[1].model)
    return result, small, truth


def table_rows(speeds, heights, held):
    """Errors of an inflow identified over a grid, in it and at a flight held out, beside Pitt and Peters' own."""
    found, flown, near = [], {}, None
    for height in heights:
        for advance in speeds:
            near, took = timed(lambda mu=advance, h=height, n=near: in_wake(mu, h, n))
            flown[advance, height] = near
            found.append(identified.identified(*with_pitt_peters(near[1], advance, height), advance, height or np.inf))
            print(
                f"identified at μ = {advance:g}, h = {height or np.inf:g}: error {100 * found[-1].error:.1f} %, "
                f"Pitt and Peters {100 * found[-1].pitt_peters_error:.1f} %; {took:.0f} s",
                flush=True,
            )
    data = identified.table(found)
    print(identified.text(data))
    advance, height = held
    there = in_wake(advance, height, near)
    model, linear, start = with_pitt_peters(there[1], advance, height)
    target = identified.target_of(model, linear)
    between = identified.interpolated(data, advance, height or np.inf)
    errors = [identified.error_of(inflow, start, target, linear) for inflow in (between, start)]
    print(f"held out μ = {advance:g}, h = {height or np.inf:g}: {100 * errors[0]:.1f} %, Pitt and Peters' own", end=" ")
    print(f"{100 * errors[1]:.1f} %")
    return {"text": identified.text(data), "held_out": held, "error": errors[0], "pitt_peters_error": errors[1]} | (
        matrices_between([flown[speed, height] for speed in speeds if (speed, height) in flown], there)
    )


def with_pitt_peters(small, advance, height):
    """The mean model of a wake, that of the same flight with Pitt and Peters' inflow, and that inflow's own."""
    trimmed = run(request("uh60", THRUST, "pitt-peters", advance=advance, height=height)).trimmed
    return average(small.model), average(rotor.linear_rotor(rotor.base_of(trimmed))), identified.own(trimmed)


def matrices_between(ends, there):
    """Error of steps by matrices half way between those of the first and last flight, beside the condensed model's."""
    if len(ends) < 2:
        return {}
    one, two = aligned([ends[0][1], ends[-1][1]])
    middle = replace(one, **{name: (getattr(one, name) + getattr(two, name)) / 2 for name in "abcd"})
    truth, errors = there[2], {}
    for name, model in (("condensed", there[1].model), ("between", middle), ("first", one)):
        own = np.stack([model.step(column)[1] for column in np.eye(len(model.inputs))], axis=-1)
        gap = steps.largest_gap(truth, own)
        errors[name] = {"median": float(np.median(gap)), "CT/theta_0": float(gap[0, 0])}
    print("a revolution after a step, over the largest response, by", errors)
    return {"between": errors}


def derivatives(trimmed):
    """Largest gap of the exponents' derivatives from central differences, over the largest derivative."""
    gaps = {}
    for name, (where, step) in PARAMETERS.items():
        found, ends = sensitivity(trimmed, where), []
        for change in (step, -step):
            design = (trimmed.flight, trimmed.p)
            condition, p = eqx.tree_at(where, design, where(design) + change)
            end = sensitivity(trim(p, condition, trimmed.residual, trimmed.z), where).exponents
            ends.append(np.array([end[np.argmin(np.abs(end - v))] for v in found.exponents]))
        slopes = (ends[0] - ends[1]) / (2 * step)
        gaps[name] = float(np.abs(slopes - found.exponents_by).max() / np.abs(slopes).max())
    return gaps


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--inflow", nargs="*", default=["pitt-peters"])
    parser.add_argument("--order", type=int, default=20)
    parser.add_argument("--wake", action="store_true", help="the free wake in forward flight too, some minutes")
    parser.add_argument("--table", action="store_true", help="an identified inflow over μ and h, some minutes")
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
            for text, key in (("main", "step_error_main"), ("all", "step_error_all")):
                print(f"  steps, {text}:", ", ".join(f"{k} {100 * v:.2f} %" for k, v in one[key].items()))
            if inflow == "pitt-peters" and name in ("hover", "μ = .15"):
                found[name] = derivatives(result.trimmed)
                print("  derivatives:", ", ".join(f"{k} {v:.0e}" for k, v in found[name].items()), flush=True)
    if chosen.wake:
        rows.append(wake_row(chosen.order))
        print(json_text(rows[-1], indent=1))
    table = table_rows((0.1, 0.2), (None, 1.0), (0.15, None)) if chosen.table else {}
    if chosen.json:
        with open(chosen.json, "w") as file:
            file.write(json_text({"flights": rows, "derivatives": found, "identified": table}, indent=1))


if __name__ == "__main__":
    main()
