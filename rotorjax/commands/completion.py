"""`rotorjax completion`: a script with which a shell completes commands, options and files."""

import argparse
from pathlib import Path

from rotorjax.commands.arguments import commands_of


def register(commands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "completion",
        help="completion of commands, options and files by the shell",
        description="Print a script for a shell, for example: rotorjax completion bash > "
        "~/.local/share/bash-completion/completions/rotorjax",
    )
    parser.add_argument("shell", choices=("bash", "zsh", "tcsh"), help="which shell")
    parser.set_defaults(run=run, free_wake=lambda _: False)


def run(chosen: argparse.Namespace) -> int:
    """Print; the exit code."""
    import shtab

    top: argparse.ArgumentParser = chosen.program
    for each in (top, *commands_of(top).values()):
        for action in each._actions:
            if action.type is Path:
                setattr(action, "complete", shtab.DIRECTORY if action.metavar == "DIR" else shtab.FILE)  # noqa: B010
    print(shtab.complete(top, shell=chosen.shell))
    return 0
