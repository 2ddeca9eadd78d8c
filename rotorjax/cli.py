"""The command line: `rotorjax COMMAND …`. Bad input is one line on stderr and exit code 2."""

import argparse
import difflib
import os
import re
import signal
import sys
import traceback
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import NoReturn

from rotorjax import __version__
from rotorjax.errors import InputError

DIVERGED, BAD_INPUT, FAULT, INTERRUPTED, CLOSED = 1, 2, 70, 130, 141
# XLA's older way to write fused loops takes a third less to compile and as long to run, but for the derivative of the
# Biot-Savart sum, which takes twice as long: not where a free wake is solved (benchmarks/xla_flags.py). Later versions
# have no such flag, and XLA ends the process for one that it does not know
HAS_OLDER_WAY = tuple(map(int, version("jaxlib").split(".")[:2])) < (0, 11)
WITHOUT_FREE_WAKE = "--xla_cpu_use_fusion_emitters=false" if HAS_OLDER_WAY else ""


class Parser(argparse.ArgumentParser):
    """A parser whose complaints are one line, like every other bad input."""

    def error(self, message: str) -> NoReturn:
        """Print the complaint and leave with exit code 2."""
        print(f"{self.prog}: error: {message} (try `{self.prog} --help`)", file=sys.stderr)
        sys.exit(BAD_INPUT)


def parser() -> argparse.ArgumentParser:
    """The parser of all commands; each module of `rotorjax.commands` registers its own."""
    from rotorjax.commands import (
        calibrate,
        completion,
        deck,
        doctor,
        inflow,
        linearise,
        new,
        simulate,
        study,
        sweep,
        trim,
        validate,
    )

    top = Parser(prog="rotorjax", description="Rotor inflow near the ground: finite-state model and free vortex wake.")
    top.add_argument("--version", action="version", version=f"rotorjax {__version__}")
    commands = top.add_subparsers(dest="command", metavar="COMMAND", required=True, parser_class=Parser)
    modules = (study, inflow, trim, sweep, simulate, linearise, validate, calibrate, deck, new, doctor, completion)
    for module in modules:
        module.register(commands)
    top.set_defaults(program=top)  # completion describes all commands
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code.

    0; 1 where a case did not converge; 2 for bad input, a full disk included; 70 for a fault of rotorjax itself; 130
    when interrupted; 141 where nobody reads what is printed any more.
    """
    given = sys.argv[1:] if arguments is None else arguments
    chosen = parsed(given)
    programs = None
    try:
        programs = _set_up_jax("" if _solves_free_wake(chosen) else WITHOUT_FREE_WAKE)
        return chosen.run(chosen)
    except InputError as error:
        return _left(chosen, BAD_INPUT, f"error: {_by_option(' '.join(str(error).split()), given)}")
    except KeyboardInterrupt:
        return _left(chosen, INTERRUPTED, "interrupted" + getattr(chosen, "kept", ""))
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for what Python still flushes at its end
        return CLOSED
    except Exception as error:
        return _left(chosen, FAULT, _fault(error))
    finally:
        if programs is not None:
            from rotorjax.io import program_cache

            program_cache.seal(programs, settled=0.0)


def parsed(arguments: Sequence[str]) -> argparse.Namespace:
    """The parsed arguments; leaves with exit code 2 where they are wrong."""
    top = parser()
    for given in arguments:
        if given.startswith("--") and given.endswith("=--"):  # argparse would take the value for no value at all
            top.error(f"argument {given.removesuffix('=--')}: expected a value, but it is '--'")
    chosen, unknown = top.parse_known_args(arguments)
    if unknown:
        _refuse_unknown(top, chosen.command, unknown[0])
    return chosen


def _refuse_unknown(top: argparse.ArgumentParser, command: str, given: str) -> NoReturn:
    """Leave for an argument that a command does not have, with the option that may have been meant."""
    from rotorjax.commands.arguments import commands_of

    parser = commands_of(top)[command]
    options = [option for action in parser._actions for option in action.option_strings if option.startswith("--")]
    near = difflib.get_close_matches(given.partition("=")[0][:100], options, n=1)
    parser.error(f"unknown argument {given[:60]}" + (f": did you mean {near[0]}?" if near else ""))


def _by_option(message: str, given: Sequence[str]) -> str:
    """A complaint about an argument under the option that gave it: `tilt_deg` is what --tilt says."""
    options = {argument.partition("=")[0] for argument in given if argument.startswith("--")}

    def option(found: re.Match[str]) -> str:
        name = "--" + found[1].removesuffix("_deg").replace("_", "-")
        return next((one for one in (name, f"{name}s") if one in options), found[0])

    return re.sub(r"Argument `(\w+)`", option, message)


def _left(chosen: argparse.Namespace, code: int, message: str) -> int:
    print(f"{os.linesep if code == INTERRUPTED else ''}rotorjax {chosen.command}: {message}", file=sys.stderr)
    return code


def _fault(error: Exception) -> str:
    """One line on an exception that nobody expected, its traceback before it if ROTORJAX_TRACEBACK is set."""
    if os.environ.get("ROTORJAX_TRACEBACK"):
        traceback.print_exception(error)
    place = traceback.extract_tb(error.__traceback__)[-1]
    reason = " ".join(f"{type(error).__name__}: {error}".split())[:300]
    return (
        f"internal error: {reason} ({Path(place.filename).name}:{place.lineno}); a fault of rotorjax, not of your "
        "input: please report it with the command, its files and what ROTORJAX_TRACEBACK=1 shows"
    )


def _solves_free_wake(chosen: argparse.Namespace) -> bool:
    """Whether a command solves a free wake: all do that do not say what it depends on."""
    return not hasattr(chosen, "free_wake") or chosen.free_wake(chosen)


def _set_up_jax(xla_flags: str = "") -> Path | None:
    """Double precision, XLA's flags, and compiled programs kept unless JAX_COMPILATION_CACHE_DIR says where.

    Returns the folder of programs where it is ours. For each program that it takes from there XLA prints that this
    processor lacks "prefer-no-gather", which is no feature of processors but a hint of its own; its real errors come as
    exceptions.
    """
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")  # read when jax is imported
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # its threads wait by spinning, in each of XLA's own threads
    if "jax" not in sys.modules:
        os.environ["XLA_FLAGS"] = f"{xla_flags} {os.environ.get('XLA_FLAGS', '')}".strip()  # the user's own come last
    import jax

    jax.config.update("jax_enable_x64", True)
    if jax.config.values["jax_compilation_cache_dir"] is not None:
        return None
    return _keep_programs()


def _keep_programs() -> Path | None:
    import warnings

    import jax

    from rotorjax.io import program_cache

    folder = program_cache.opened()
    if folder is not None:
        jax.config.update("jax_compilation_cache_dir", str(folder))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)
        jax.monitoring.register_event_listener(lambda event, **_: _seal_earlier(event, folder))
        warnings.filterwarnings("ignore", "Error (reading|writing) persistent compilation cache")  # it compiles instead
    return folder


def _seal_earlier(event: str, folder: Path) -> None:
    """Seal the programs that were kept before this one, so that a killed run loses the last alone."""
    if event == "/jax/compilation_cache/cache_misses":
        from rotorjax.io import program_cache

        program_cache.seal(folder)


def script() -> NoReturn:
    """Run as a program. An interrupted one leaves at once: a thread that is still compiling would hold up the exit."""
    from rotorjax.io import terminal

    terminal.make_safe()
    if "simulate" in sys.argv[1:2]:  # a cluster whose time is up asks with SIGTERM: a march then keeps what it had
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    code = main()
    if code == INTERRUPTED:
        sys.stdout.flush()
        os._exit(code)
    sys.exit(code)


if __name__ == "__main__":
    script()
