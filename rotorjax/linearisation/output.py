"""What `rotorjax linearise` leaves behind: models, pictures, linearise.json, report.md and report.html."""

from pathlib import Path
from typing import Any

import numpy as np

from rotorjax.bench import plotting
from rotorjax.bench.markdown import table
from rotorjax.io.atomic import write_json, write_text
from rotorjax.io.page import write_page
from rotorjax.linearisation import figures
from rotorjax.linearisation.handover import Time, handed_over
from rotorjax.linearisation.marching import STEPS
from rotorjax.linearisation.reduce import HIGHEST, Small
from rotorjax.linearisation.run import TOL, Linearised
from rotorjax.linearisation.waves import Spectrum
from rotorjax.ode.export import save_mat, save_netcdf
from rotorjax.wake.solution import Solution


def write(found: Linearised, title: str, folder: str | Path, time: Time = "seconds") -> dict[str, Any]:
    """Write every result into a folder that exists, and return the content of linearise.json. time: of the models.

    Raises InputError where the folder cannot be written.
    """
    folder = Path(folder)
    small = found.small
    models = {"full": found.periodic, "reduced_frequency": small.frequency.model, "reduced_time": small.time.model}
    flown = found.solution.model
    for name, model in models.items():
        model = handed_over(model, flown.rotor, flown.operating, time)
        save_netcdf(model, folder / f"{name}.nc")
        save_mat(model, folder / f"{name}.mat")
    plotting.save(figures.residuals(found.solution.residuals, TOL), folder / "residuals")
    plotting.save(figures.bode(found.full, small.frequency.model, HIGHEST), folder / "bode")
    plotting.save(figures.steps(found.full, small.time.model, found.marched, STEPS), folder / "steps")
    if found.spectrum is not None:
        plotting.save(figures.stability(found.spectrum), folder / "stability")
    content = summary(found)
    write_json(folder / "linearise.json", content)
    text = report(found, title, content)
    write_text(folder / "report.md", text)
    write_page(folder / "report.html", text)
    return content


def orbit(solution: Solution, at_rest: float | None = None) -> dict[str, Any]:
    """The orbit's part of linearise.json."""
    return {
        "converged": solution.converged,
        "why": solution.why,
        "residual": solution.residual,
        "rhs_residual": at_rest,
        "iterations": solution.iterations,
        "residuals": list(solution.residuals),
        "wall_time_s": solution.wall_time_s,
        "compile_time_s": solution.compile_time_s,
        "CT": solution.CT,
        "CQ": solution.CP,
        "lambda0": solution.mean_inflow,
    }


def summary(found: Linearised) -> dict[str, Any]:
    """Content of linearise.json. Errors are given by output, then input; growth and frequency per rad of azimuth."""
    full, small = found.full, found.small

    def by_name(values: np.ndarray) -> dict[str, dict[str, float]]:
        rows = zip(full.outputs, values, strict=True)
        return {out: dict(zip(full.inputs, map(float, row), strict=True)) for out, row in rows}

    content: dict[str, Any] = {
        "orbit": orbit(found.solution, found.at_rest),
        "inputs": dict(zip(full.inputs, full.input_units, strict=True)),
        "outputs": dict(zip(full.outputs, full.output_units, strict=True)),
        "full_order": full.order,
        "harmonics": list(found.harmonics),
        "full_unstable_modes": small.unstable,
        "reduced_order": small.frequency.model.order,
        "reduction": small.frequency.method,
        "reduction_bound": small.frequency.reduced.bound,
        "bode_highest_per_rev": HIGHEST,
        "bode_error_db": by_name(small.frequency.bode_error_db),
        "step_error": by_name(found.march_error),
        "step_sizes": {name: STEPS[name] for name in full.inputs},
        "reduced_models": {
            use: {
                "order": one.model.order,
                "method": one.method,
                "unstable_modes": one.unstable,
                "bode_error_db": by_name(one.bode_error_db),
                "step_error": by_name(one.step_error),
            }
            for use, one in (("frequency", small.frequency), ("time", small.time))
        },
        "steady_gain": by_name(full.response(np.zeros(1))[0].real),
        "floquet_multipliers": [],
        "pairing": None,
    }
    if found.spectrum is not None:
        content |= _spectrum(found.spectrum)
    times = {"compile_time_s": found.compile_time_s, "wall_time_s": sum(found.seconds.values())}
    return content | {"stages_s": found.seconds} | times


def _spectrum(found: Spectrum) -> dict[str, Any]:
    """Growing and decaying waves of an axisymmetric wake."""
    names = ("smallest", "median", "largest")
    multipliers = [
        {
            "wave_number": mode.wave,
            "real": mode.multiplier.real,
            "imaginary": mode.multiplier.imag,
            "magnitude": abs(mode.multiplier),
            "growth": mode.exponent.real,
            "frequency": mode.exponent.imag,
            "growth_over_pairing": mode.exponent.real / found.pairing.rate[1],
            "rounding_error": mode.error,
        }
        for mode in found.modes
    ]
    pairing = {
        field: dict(zip(names, getattr(found.pairing, field), strict=True))
        for field in ("circulation", "spacing", "rate")
    }
    return {"floquet_multipliers": multipliers, "pairing": pairing}


def report(found: Linearised, title: str, content: dict[str, Any]) -> str:
    """The report in Markdown."""
    parts = [f"# Linear model of the free wake: {title}", _orbit(content), _models(found, content)]
    parts += [_responses(found, content)]
    if found.spectrum is not None:
        parts.append(_stability(content))
    times = ", ".join(f"{stage} {seconds:.1f} s" for stage, seconds in content["stages_s"].items())
    parts.append(
        f"## Time\n\n{times}; {content['wall_time_s']:.0f} s in all, of which {content['compile_time_s']:.0f} s "
        "compiling."
    )
    return "\n\n".join(parts) + "\n"


def _orbit(content: dict[str, Any]) -> str:
    o = content["orbit"]
    return (
        "Lengths are over R, velocities over ΩR, circulation over ΩR²; time is azimuth (rad), so that a frequency is "
        "counted per revolution. C_T = T/(ρA(ΩR)²), C_Q = Q/(ρA(ΩR)²R), λ₀ is the area-mean inflow, positive down.\n\n"
        "## Periodic wake\n\n"
        f"C_T = {o['CT']:.6f}, C_Q = {o['CQ']:.7f}, λ₀ = {o['lambda0']:.5f}. {o['iterations']} Newton iterations in "
        f"{o['wall_time_s']:.1f} s ({o['compile_time_s']:.1f} s of them compiling); one more pass moves the wake by "
        f"{o['residual']:.1e} R (rms). The rate of change of the state, as marched in time, is {o['rhs_residual']:.1e} "
        "of the state (rms). Each rise of the residual below is a step of the continuation.\n\n"
        "![Residuals](residuals.png)"
    )


def _models(found: Linearised, content: dict[str, Any]) -> str:
    small, slope = found.small, found.spectrum is None
    kind = (
        f"All blades alike: {found.periodic.order} states with A, B, C, D at {found.periodic.t.size} azimuths of a "
        "passage (full.nc, full.mat). Time-invariant below by "
        + ("averaging." if len(found.harmonics) == 1 else f"harmonics {found.harmonics} of the passage.")
        if slope
        else "Constant in the blades' frames; axisymmetric disturbances are all that these inputs and outputs meet."
    )
    small_text = (
        f"Reduced model: {small.frequency.model.order} states, {_kept(small.frequency)}. "
        f"It is right in frequency and in time, so that "
        "reduced_frequency and reduced_time (.nc, .mat) hold the same."
        if small.time is small.frequency
        else f"{small.frequency.model.order} states cannot hold {small.unstable} unstable modes and a response beside "
        "them, so there are two reduced models: reduced_frequency (.nc, .mat) for steady frequencies, which must not "
        "be marched in time, and reduced_time (.nc, .mat) for marching, which is wrong at steady "
        f"frequencies. `--order {small.unstable + 40}` or so gives one model that is right in both."
    )
    return (
        f"## Models\n\nFull model: {content['full_order']} states, {small.unstable} unstable modes. {kind}\n\n"
        f"{small_text}"
    )


def _kept(small: Small) -> str:
    """How a model was reduced, with its error bound over all frequencies where the method has one."""
    bound = small.reduced.bound
    told = "no error bound, errors as measured" if bound is None else f"error bound over all frequencies {bound:.2g}"
    return f"{small.method}, all unstable modes kept; {told}"


def _responses(found: Linearised, content: dict[str, Any]) -> str:
    full = found.full
    rows = [
        (
            f"{out} ({full.output_units[q]})",
            f"{name} ({full.input_units[m]})",
            content["steady_gain"][out][name],
            content["bode_error_db"][out][name],
            content["reduced_models"]["time"]["step_error"][out][name],
            content["step_error"][out][name],
        )
        for m, name in enumerate(full.inputs)
        for q, out in enumerate(full.outputs)
    ]
    head = (
        "output",
        "input",
        "gain at frequency 0",
        f"Bode error up to {HIGHEST:g}/rev, dB",
        "step error of the reduced model for time",
        "step error against the nonlinear march",
    )
    sizes = ", ".join(f"{name} {STEPS[name]:.4g} {unit}" for name, unit in content["inputs"].items())
    return (
        "## Responses\n\n" + table(head, rows) + "\n\nStep errors: largest difference over a revolution, over the "
        f"largest response. The nonlinear march takes steps of {sizes}; unstable modes grow in it as they will, "
        "nothing is projected out.\n\n![Bode diagrams](bode.png)\n\n![Steps](steps.png)"
    )


def _stability(content: dict[str, Any]) -> str:
    pairing = content["pairing"]
    rows = [
        (
            m["wave_number"],
            m["growth"],
            m["frequency"],
            m["magnitude"],
            m["growth_over_pairing"],
            f"{m['rounding_error']:.0e}",
        )
        for m in content["floquet_multipliers"]
    ]
    head = ("wave number", "growth per rad", "frequency, 1/rev", "|multiplier|", "growth / pairing", "rounding")
    return (
        "## Stability\n\nThe fastest growing modes of each azimuthal wave number p (a phase of 2πp/B from blade to "
        "blade). Vortex pairing puts neighbouring turns out of phase, which is frequency B/2 − p as seen from the "
        f"blade, up to multiples of B. Its rate in a row of vortices is πΓ/4b² = {pairing['rate']['median']:.3g} per "
        f"rad ({pairing['rate']['smallest']:.3g} to {pairing['rate']['largest']:.3g} along the wake; Γ = "
        f"{pairing['circulation']['median']:.4g}, b = {pairing['spacing']['median']:.3g}); cores, curvature and the "
        "finite age of the wake make the real ones slower.\n\n"
        + (table(head, rows) if rows else "No mode grows.")
        + "\n\n![Stability](stability.png)"
    )


def lines(content: dict[str, Any]) -> str:
    """What the command prints."""
    o, modes = content["orbit"], content["floquet_multipliers"]
    text = [
        f"orbit: residual {o['residual']:.1e} R, rhs {o['rhs_residual']:.1e}, {o['iterations']} iterations, "
        f"{o['wall_time_s']:.1f} s",
        f"full model: {content['full_order']} states, {content['full_unstable_modes']} unstable modes",
        f"reduced model: {content['reduced_order']} states, balanced"
        + ("" if content["reduction"] == "balanced" else ": one for frequencies, one for time"),
    ]
    for out, row in content["bode_error_db"].items():
        for name, value in row.items():
            text.append(
                f"{out} per {name}: Bode error {value:.3f} dB up to {content['bode_highest_per_rev']:g}/rev, linear "
                f"against nonlinear step {100 * content['step_error'][out][name]:.2f} %, reduced against full step "
                f"{100 * content['reduced_models']['time']['step_error'][out][name]:.2f} %"
            )
    if modes:
        m = modes[0]
        text.append(
            f"fastest mode: wave number {m['wave_number']}, |multiplier| {m['magnitude']:.3g}, growth "
            f"{m['growth']:.3g} per rad, {m['growth_over_pairing']:.2f} of the pairing rate"
        )
    return "\n".join(text)
