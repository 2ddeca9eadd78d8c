"""What is tried: each target makes one input of a random generator, and raises `Finding` where the answer is wrong."""

import contextlib
import io
import math
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any
from unittest import mock

import equinox as eqx
import jax
import numpy as np

from rotorjax import cli
from rotorjax.calibration.calibration_file import MODEL_VERSION, SETS, Calibration
from rotorjax.calibration.calibration_file import load as load_calibration
from rotorjax.deck.case import read_case as read_deck
from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.inflow.momentum import induced_inflow
from rotorjax.operating import operating_point
from rotorjax.rotor import catalogue, geometry
from rotorjax.rotor.airfoil import airfoil_table, linear_airfoil
from rotorjax.rotor.derived import MOST_SOLIDITY, MOST_TIP_MACH, derived
from rotorjax.rotor.hub import rotor_inputs
from rotorjax.simulation.case import read_case as read_flight
from rotorjax.trim.run import check, request
from rotorjax.trim.solve import flight
from rotorjax.wake.settings import wake_settings
from tests.fuzz import values

REPORTS = Path(__file__).parents[1] / "data" / "reports"
LONGEST = 1500  # characters of a message


class Finding(AssertionError):
    """An input that was answered wrongly."""


class Reached(BaseException):
    """A command came to its solver: its input was accepted."""


def require(holds: bool, what: str) -> None:
    if not holds:
        raise Finding(what)


def refusal(error: InputError, name: str = "") -> None:
    """What a clean refusal is: one short line that names the file."""
    text = str(error)
    require(0 < len(text) <= LONGEST and "\n" not in text and "Traceback" not in text, f"message: {text[:200]!r}")
    require(name in text, f"message without {name}: {text[:200]!r}")


def all_finite(tree: Any) -> bool:
    return all(np.all(np.isfinite(np.asarray(leaf, float))) for leaf in jax.tree.leaves(eqx.filter(tree, eqx.is_array)))


def file_trial(path: Path, content: bytes, read: Callable[[Path], Any], sound: Callable[[Any], None]) -> str:
    path.write_bytes(content)
    try:
        found = read(path)
    except InputError as error:
        refusal(error, path.name)
        return "refused"
    sound(found)
    return "accepted"


def sound_rotor(found: tuple[geometry.Rotor, Any]) -> None:
    rotor, operating = found
    require(all_finite(found), "a rotor with numbers that are not finite")
    numbers = derived(rotor, operating)
    require(0 < numbers.solidity <= MOST_SOLIDITY, f"solidity {numbers.solidity}")
    require(0 < numbers.tip_mach <= MOST_TIP_MACH, f"tip Mach {numbers.tip_mach}")
    require(abs(float(operating.collective)) <= math.pi / 4 + 1e-9, "collective")
    require(1 <= rotor.blades <= geometry.MOST_BLADES, "blades")
    require(bool(np.all(np.asarray(rotor.airfoil.cd) >= 0)), "negative drag")


def rotor_file(rng: Random, folder: Path) -> str:
    content = values.spoiled_toml(rng, ROTOR.replace("FILE", str(REPORTS / "foil.csv")))
    return file_trial(folder / "rotor.toml", content, catalogue.load, sound_rotor)


def airfoil_file(rng: Random, folder: Path) -> str:
    name = rng.choice(TABLES)
    (folder / Path(name).name).write_bytes(values.spoiled_bytes(rng, (REPORTS / name).read_bytes()))
    more = rng.choice(("", "symmetric = true", "prandtl_glauert = true", 'full_range = "flat plate"'))
    text = ROTOR.replace("FILE", Path(name).name).replace("[operating]", f"{more}\n[operating]")
    return file_trial(folder / "rotor.toml", text.encode(), catalogue.load, sound_rotor)


def calibration_file(rng: Random, folder: Path) -> str:
    def sound(found: Calibration) -> None:
        require(all(math.isfinite(v) for v in found.parameters.values()), "parameters that are not finite")
        require(isinstance(found.converged, bool) and math.isfinite(found.rms_error), "head")

    return file_trial(folder / "c.toml", values.spoiled_toml(rng, CALIBRATION), load_calibration, sound)


def flight_case(rng: Random, folder: Path) -> str:
    def sound(found: Any) -> None:
        require(np.all(np.isfinite(found.columns)) and 0 < found.duration <= 1e5, "a case that is not finite")
        require(0 < found.request.thrust <= 0.1, "thrust")

    return file_trial(folder / "case.toml", values.spoiled_toml(rng, FLIGHT), read_flight, sound)


def deck_case(rng: Random, folder: Path) -> str:
    def sound(found: Any) -> None:
        motion = found.motion(np.linspace(0, found.duration * found.omega, 50))
        require(all(np.all(np.isfinite(v)) for v in motion.values()), "a motion that is not finite")

    return file_trial(folder / "deck.toml", values.spoiled_toml(rng, DECK), read_deck, sound)


def command_line(rng: Random, folder: Path) -> str:
    """A command with odd values, up to its solver."""
    command, options, solvers = rng.choice(COMMANDS)
    arguments = [*command.split(), *(["--out", str(folder / "out")] if "--out" in options else [])]
    for option in rng.sample([o for o in options if o != "--out"], k=min(len(options) - 1, rng.randint(1, 3))):
        value = rng.choice(values.WORDS) if rng.random() < 0.15 else f"{values.number(rng):g}"
        arguments += [f"{option}={value}"] if rng.random() < 0.5 else [option, value]
    with contextlib.ExitStack() as stack:
        for solver in solvers:
            stack.enter_context(mock.patch(solver, side_effect=Reached))
        stack.enter_context(mock.patch("rotorjax.cli._set_up_jax", return_value=None))
        told = stack.enter_context(contextlib.redirect_stderr(io.StringIO()))
        stack.enter_context(contextlib.redirect_stdout(io.StringIO()))
        try:
            code = cli.main(arguments)
        except Reached:
            return "accepted"
        except SystemExit as left:
            code = left.code
    lines = told.getvalue().strip().splitlines()
    require(code == 2, f"{arguments}: exit code {code}: {told.getvalue()[-300:]}")
    require(len(lines) == 1 and len(lines[0]) <= LONGEST, f"{arguments}: {told.getvalue()[:300]!r}")
    return "refused"


def public_function(rng: Random, folder: Path) -> str:
    """A constructor with odd arguments: InputError, or finite arrays."""
    del folder
    name = rng.choice(list(FUNCTIONS))
    function, ordinary = FUNCTIONS[name]
    given = dict(ordinary)
    for key in rng.sample(list(ordinary), k=rng.randint(1, min(2, len(ordinary)))):
        given[key] = values.anything(rng)
    try:
        found = function(**given)
    except InputError as error:
        refusal(error)
        return "refused"
    require(all_finite(found), f"{name}({given}) is not finite")
    return "accepted"


def momentum(rng: Random, folder: Path) -> str:
    """Momentum theory's inflow of any thrust, climb and wind: finite, of the thrust's sign, and a root."""
    del folder
    scale = rng.choice((1e-6, 1e-3, 0.01, 0.1))
    thrust, climb, wind = (scale * rng.choice((0.0, 1.0, -1.0, rng.uniform(-1, 1))) for _ in range(3))
    found = float(_induced(thrust, climb * 10, wind**2))
    require(math.isfinite(found) and found * thrust >= 0, f"inflow {found} of {thrust}, {climb * 10}, {wind**2}")
    left = 2 * found * math.sqrt(wind**2 + (found + climb * 10) ** 2) - thrust
    require(abs(left) <= 1e-6 * abs(thrust) + 1e-15, f"residual {left} of {thrust}, {climb * 10}, {wind**2}")
    return "accepted"


_induced = jax.jit(induced_inflow)


def _table(**given: Any) -> Any:
    return airfoil_table(given["alpha"], given["mach"], [0, given["cl"], 0, 1, 0], [0.1, 0.1, given["cd"], 0.1, 0.1])


def _request(**given: Any) -> Any:
    wanted = request("uh60", **given)
    check(wanted)
    return wanted.flight


FUNCTIONS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "operating_point": (
        operating_point,
        {"omega": 27.0, "density": 1.2, "sound_speed": 340.0, "viscosity": 1.5e-5, "collective": 0.1, "climb": 0.0},
    ),
    "plane": (plane, {"height": 1.0, "slope_deg": 10.0}),
    "rotor": (
        lambda **given: geometry.rotor("a", airfoil=linear_airfoil(), **given),
        {"blades": 2, "radius": 1.0, "root_cutout": 0.2, "chord": 0.08, "twist": 0.1, "sweep": 0.0, "tip_loss": 0.97},
    ),
    "hinge": (
        geometry.hinge,
        {"offset": 0.05, "blade_mass": 1.2, "first_moment": 0.55, "flap_inertia": 0.33, "delta3": 0.0, "precone": 0.0}
        | {"flap_spring": 0.0, "lag_spring": 0.0, "damper": ([0.0, 0.1], [0.0, 10.0]), "damper_arm": 0.1},
    ),
    "linear_airfoil": (linear_airfoil, {"slope": 5.7, "cd": 0.01, "zero_lift": 0.0}),
    "airfoil_table": (_table, {"alpha": [-180, -10, 0, 10, 180], "mach": 0.0, "cl": -1.0, "cd": 0.01}),
    "wake_settings": (
        wake_settings,
        {"panels": 14, "age_step_deg": 15.0, "near_wake_deg": 90.0, "free_turns": 2.0, "closure_turns": 2}
        | {"azimuths": 8, "release": 0.97, "tip_core": 0.02, "turbulence": 1e-4, "stall_chords": 0.5},
    ),
    "rotor_inputs": (rotor_inputs, {"theta_0": 0.2, "u": 0.1, "w": 0.0, "p": 0.0, "omega": 1.0, "height": 1.0}),
    "flight": (flight, {"thrust": 0.006, "advance": 0.1, "climb": 0.0, "tilt": 0.0, "drag_area": 0.0, "height": 1.0}),
    "request": (_request, {"thrust": 0.006, "inflow": "pitt-peters", "advance": 0.1, "height": 1.0, "climb": 0.0}),
}
_ROTOR = ("--rotor", "--collective")
_PLACE = ("--height", "--slope", "--climb")
COMMANDS: tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...] = (
    (
        "inflow",
        (*_ROTOR, *_PLACE, "--model", "--harmonics", "--json", "--plot"),
        ("rotorjax.bench.single.single_case",),
    ),
    (
        "trim --thrust-coefficient 0.00575",
        ("--rotor", "--thrust-coefficient", "--advance-ratio", *_PLACE, "--inflow", "--tilt", "--drag-area"),
        ("rotorjax.trim.curve.curve",),
    ),
    ("study", ("--out", *_ROTOR, "--heights", "--slopes", "--harmonics"), ("rotorjax.study.run.solve_cases",)),
    (
        "linearise",
        ("--out", *_ROTOR, *_PLACE, "--inputs", "--outputs", "--order", "--harmonics"),
        ("rotorjax.linearisation.run.linearise_case",),
    ),
    ("validate", ("--out", *_ROTOR, "--case"), ("rotorjax.validation.run.validate",)),
    ("calibrate hayden", ("--out", "--heights", "--parameters", "--loading"), ("rotorjax.calibration.hayden_run.run",)),
    ("simulate", ("--out", "--case"), ("rotorjax.simulation.run.fly",)),
    ("deck", ("--out", "--case"), ("rotorjax.deck.run.run_case",)),
)
TARGETS = (
    rotor_file, airfoil_file, calibration_file, flight_case, deck_case, command_line, public_function, momentum,
)  # fmt: skip
TABLES = (
    *("foil.csv", "table_formats/semi.csv", "table_formats/polar.txt", "table_formats/aerodyn.dat"),
    *("c81_layouts/dust.c81", "c81_layouts/oneline.c81", "keys_ignored/limited.C81", "keys_ignored/half.C81"),
)
ROTOR = """
[rotor]
name = "T"
blades = 2
radius = 1.0
root_cutout = 0.15
tip_loss = 0.97
chord = 0.08
twist_deg = { r = [0.0, 1.0], value = [4.0, -4.0] }
sweep_deg = 0.0
rotation = "clockwise"
[airfoil]
file = "FILE"
[operating]
rpm = 1200.0
density = 1.225
sound_speed = 340.0
viscosity = 1.5e-5
collective_deg = 8.0
climb = 0.0
[hinge]
offset = 0.05
blade_mass = 1.2
first_moment = 0.55
flap_inertia = 0.33
lag_spring = 1.0
"""
PARAMETERS = "\n".join(f"{p.name} = {0.5 * (p.lower + p.upper):g}" for p in SETS["hayden"].parameters)
CALIBRATION = f"""
[calibration]
set = "hayden"
model_version = {MODEL_VERSION}
rotorjax = "0.1.0"
converged = true
rms_error = 0.00355
[parameters]
{PARAMETERS}
[fitted_with]
loading = "elliptic"
"""
FLIGHT = """
[flight]
rotor = "uh60"
inflow = "pitt-peters"
thrust_coefficient = 0.00575
advance_ratio = 0.1
height = 2.0
[time]
duration = 3.0
steps_per_turn = 120
[history]
t = [0.0, 0.5, 0.6, 3.0]
collective_deg = [0.0, 0.0, 1.0, 1.0]
w = [0.0, 0.0, 1.0, 1.0]
"""
DECK = """
[rotor]
name = "uh60"
collective_deg = 17.0
[model]
variant = "dynamic"
harmonics = 1
[time]
duration = 4.0
[path]
t = [0.0, 1.0, 3.0, 4.0]
height = [1.6, 1.6, 1.4, 1.4]
edge = [-1.5, -1.5, 1.5, 1.5]
[deck]
heave = 0.06
heave_period = 8.0
pitch_deg = 2.0
"""
