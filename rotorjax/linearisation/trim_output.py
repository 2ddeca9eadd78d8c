"""What `rotorjax linearise` leaves behind of a trimmed rotor: models, README, pictures, linearise.json and a report."""

from pathlib import Path
from typing import Any

from rotorjax.bench import plotting
from rotorjax.io.atomic import write_json, write_text
from rotorjax.io.page import write_page
from rotorjax.linearisation import flight_output, hover_output
from rotorjax.linearisation.compact import HIGHEST
from rotorjax.linearisation.flight import LinearFlight
from rotorjax.linearisation.handover import Time, handed_over, save
from rotorjax.linearisation.hover_flight import LinearHover
from rotorjax.linearisation.told import by_name, mode_content, signals, title_of
from rotorjax.trim.run import numbers

Found = LinearFlight | LinearHover


def write(found: Found, folder: Path, time: Time = "seconds") -> dict[str, Any]:
    """Write every result into a folder that exists, and return the content of linearise.json."""
    request = found.result.request
    save(
        {name: handed_over(model, request.rotor, request.operating, time) for name, model in found.models.items()},
        folder,
        title_of(found),
    )
    for name, figure in _teller(found).pictures(found).items():
        plotting.save(figure, folder / name)
    content = summary(found) | {"time": time}
    write_json(folder / "linearise.json", content)
    text = report(found)
    write_text(folder / "report.md", text)
    write_page(folder / "report.html", text)
    return content


def _teller(found: Found) -> Any:
    """Of what only a hover, or only a flight, has."""
    return hover_output if isinstance(found, LinearHover) else flight_output


def summary(found: Found) -> dict[str, Any]:
    """Content of linearise.json: azimuth is time, rotor units; errors by output, then input, null where absent."""
    full, small = found.full, found.small
    return _teller(found).summary(found) | {
        "trim": numbers(found.result),
        "omega_rad_s": full.notes["omega_rad_s"],
        "inputs": signals(full.inputs, full.input_units, full.u),
        "outputs": signals(full.outputs, full.output_units, full.y),
        "reduced_order": small.model.order,
        "reduced_states": list(small.model.states),
        "reduced_unstable_modes": small.unstable,
        "highest_per_rev": HIGHEST,
        "reduced_gap_db": by_name(full, small.gap_db),
        "reduced_gap_deg": by_name(full, small.gap_deg),
        "modes": [mode_content(mode) for mode in found.modes],
        "stages_s": found.seconds,
    }


def report(found: Found) -> str:
    """The report in Markdown."""
    times = ", ".join(f"{stage} {seconds:.1f} s" for stage, seconds in found.seconds.items())
    parts = (f"# Linear model: {title_of(found)}", _answer(found), _teller(found).report(found), "## Time", times)
    return "\n\n".join(parts) + "\n"


def _answer(found: Found) -> str:
    """What is asked first: whether it is damped, how good it is, how it is loaded."""
    worst = max(found.modes, key=lambda mode: mode.exponent.real)
    rate = f"{worst.name}, growth {worst.exponent.real:.3g} per radian at {abs(worst.exponent.imag):.3g}/rev"
    damped = f"All modes are damped, the least: {rate}." if worst.exponent.real < 0 else f"It grows, fastest: {rate}."
    loaded = f"README.md beside this page says how {', '.join(f'{name}.mat' for name in found.models)} are loaded."
    return "\n".join(f"- {line[0].upper()}{line[1:]}" for line in (damped, *_teller(found).lines(found), loaded))


def lines(found: Found) -> str:
    """What the command prints."""
    modes = [f"  {m.name:<34} {m.exponent.real:+.4f} {m.exponent.imag:+.4f}i per radian" for m in found.modes]
    return "\n".join([title_of(found), *_teller(found).lines(found), *modes])
