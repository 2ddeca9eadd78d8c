"""Arguments that several commands share."""

import argparse
from pathlib import Path


def add_rotor(parser: argparse.ArgumentParser) -> None:
    """--rotor and --collective."""
    parser.add_argument("--rotor", default="uh60", metavar="NAME|FILE", help="catalogue name or TOML file (uh60)")
    parser.add_argument(
        "--collective",
        type=float,
        metavar="DEG",
        help="collective pitch (the rotor file's: 18 for uh60)",
    )


def add_harmonics(parser: argparse.ArgumentParser) -> None:
    """--harmonics."""
    parser.add_argument(
        "--harmonics", type=int, default=1, metavar="N", help="harmonics of the VPBFSM on a slope, 1 to 4 (1)"
    )


def add_calibration(parser: argparse.ArgumentParser) -> None:
    """--calibration."""
    parser.add_argument(
        "--calibration",
        type=Path,
        metavar="FILE",
        help="calibration.toml: the calibrated VPBFSM beside the printed one",
    )
