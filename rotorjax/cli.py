"""The command line: `rotorjax COMMAND …`. Bad input is one line on stderr and exit code 2."""

import argparse
import os
import platform
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from rotorjax import __version__
from rotorjax.errors import InputError

DIVERGED, BAD_INPUT, INTERRUPTED = 1, 2, 130


class Parser(argparse.ArgumentParser):
    """A parser whose complaints are one line, like every other bad input."""

    def error(self, message: str) -> NoReturn:
        """Print the complaint and leave with exit code 2."""
        print(f"{self.prog}: error: {message} (try `{self.prog} --help`)", file=sys.stderr)
        sys.exit(BAD_INPUT)


def parser() -> argparse.ArgumentParser:
    """The parser of all commands; each module of `rotorjax.commands` registers its own."""
    from rotorjax.commands import calibrate, deck, inflow, linearise, simulate, study, trim, validate

    top = Parser(prog="rotorjax", description="Rotor inflow near the ground: finite-state model and free vortex wake.")
    top.add_argument("--version", action="version", version=f"rotorjax {__version__}")
    commands = top.add_subparsers(dest="command", metavar="COMMAND", required=True, parser_class=Parser)
    for module in (study, inflow, trim, simulate, linearise, validate, calibrate, deck):
        module.register(commands)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code: 0, 1 where a case did not converge, 2 for bad input."""
    chosen = parser().parse_args(arguments)
    _set_up_jax()
    try:
        return chosen.run(chosen)
    except InputError as error:
        print(f"rotorjax {chosen.command}: error: {' '.join(str(error).split())}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print(f"\nrotorjax {chosen.command}: interrupted; finished cases are kept", file=sys.stderr)
        return INTERRUPTED


def program_cache() -> Path:
    """Folder of compiled programs, so that a command's second run need not compile: safe to delete at any time.

    One for each machine, since programs are made for its processor and home folders are shared.
    """
    caches = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(caches) / "rotorjax" / (platform.node() or "programs")


def _set_up_jax() -> None:
    """Double precision, and compiled programs kept unless JAX_COMPILATION_CACHE_DIR or the caller says where.

    For each program that it takes from there XLA prints that this processor lacks "prefer-no-gather", which is no
    feature of processors but a hint of its own; its real errors come as exceptions.
    """
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")  # read when jax is imported
    import jax

    jax.config.update("jax_enable_x64", True)
    if jax.config.values["jax_compilation_cache_dir"] is None:
        jax.config.update("jax_compilation_cache_dir", str(program_cache()))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.5)


def script() -> NoReturn:
    """Run as a program. An interrupted one leaves at once: a thread that is still compiling would hold up the exit."""
    code = main()
    if code == INTERRUPTED:
        sys.stdout.flush()
        os._exit(code)
    sys.exit(code)


if __name__ == "__main__":
    script()
