"""Compiled programs, kept in a folder from one command to the next and checked before they are used.

Jax takes a file of its cache for what its name says: a truncated one is never repaired, and an exchanged one gives
wrong numbers without a word. So each program has a seal beside it, a digest of its name and content, and what has none
that fits is removed before jax looks: the next command compiles it again. Only the folder's owner can write in it.
"""

import hashlib
import os
import platform
import stat
import sys
import time
from importlib.metadata import version
from pathlib import Path

from rotorjax import __version__

MOST_BYTES = 2**29  # of all programs, of other versions and machines too: some twenty studies
SETTLED = 1.0  # s after which a program's file is complete
PROGRAM, SEAL = "-cache", ".sha256"  # jax's ending, and ours after it


def opened() -> Path | None:
    """The folder of this machine's programs, checked, cleaned and trimmed; None, with a line on stderr, if of no use.

    It is safe to delete at any time.
    """
    try:
        folder = caches() / key()
        for one in (folder.parent, folder):
            one.mkdir(mode=0o700, parents=True, exist_ok=True)
            _check_owner(one)
        clean(folder)
        trim(folder.parent, MOST_BYTES)
    except (OSError, RuntimeError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        print(f"rotorjax: compiled programs are not kept, the next run compiles again: {reason}", file=sys.stderr)
        return None
    return folder


def caches() -> Path:
    """The folder of all machines' programs. Raises RuntimeError where the user has no home."""
    named = Path(os.environ.get("XDG_CACHE_HOME") or "")
    return (named if named.is_absolute() else Path.home() / ".cache") / "rotorjax" / "programs"


def key() -> str:
    """Name of what programs are made for and by: the processor with its features, the versions and XLA's flags.

    Home folders are shared by machines, and jax's own names leave the processor out.
    """
    made = [__version__, version("jax"), version("jaxlib"), os.environ.get("XLA_FLAGS", ""), str(os.cpu_count())]
    return hashlib.sha256("\n".join([*made, platform.machine(), _processor()]).encode()).hexdigest()[:16]


def _processor() -> str:
    """Name and features of the processor, as far as the system tells them."""
    try:
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
    except OSError:
        return platform.processor()
    told = {line.partition(":")[0].strip(): line for line in reversed(lines)}  # of the first core
    return "\n".join(told.get(name, "") for name in ("model name", "flags", "Features", "CPU part"))


def _check_owner(folder: Path) -> None:
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode):
        raise RuntimeError(f"{folder} must be a folder, and no link")
    if os.name == "posix" and (found.st_uid != os.geteuid() or found.st_mode & 0o022):
        raise RuntimeError(f"{folder} must be writable by its owner alone, who must be you (chmod 700)")
    if not os.access(folder, os.W_OK):
        raise RuntimeError(f"{folder} must be writable, but is not")


def clean(folder: Path) -> None:
    """Remove every program without a seal that fits, as a killed run leaves it or a fault of the disk, and its seal."""
    for program in folder.glob(f"*{PROGRAM}"):
        try:
            sound = _sealed(program).read_bytes() == _digest(program)
        except OSError:
            sound = False
        if not sound:
            program.unlink(missing_ok=True)
    for seal in folder.glob(f"*{SEAL}"):
        if not seal.with_name(seal.name.removesuffix(SEAL)).exists():
            seal.unlink(missing_ok=True)


def seal(folder: Path, settled: float = SETTLED) -> None:
    """Seal the programs that have been complete for a time (s) and have no seal yet."""
    for program in folder.glob(f"*{PROGRAM}"):
        try:
            if not _sealed(program).exists() and program.stat().st_mtime + settled <= time.time():
                _sealed(program).write_bytes(_digest(program))
        except OSError:
            continue  # another run has removed it, or the disk is full: without a seal it is compiled again


def trim(root: Path, most: int) -> None:
    """Remove the oldest programs below a folder until at most `most` bytes are left."""
    found = sorted(((p.stat().st_mtime, p.stat().st_size, p) for p in root.glob(f"*/*{PROGRAM}")), reverse=True)
    total = 0
    for _, size, program in found:
        total += size
        if total > most:
            _sealed(program).unlink(missing_ok=True)
            program.unlink(missing_ok=True)


def _sealed(program: Path) -> Path:
    return program.with_name(program.name + SEAL)


def _digest(program: Path) -> bytes:
    return hashlib.sha256(program.name.encode() + b"\0" + program.read_bytes()).digest()
