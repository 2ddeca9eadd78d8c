"""Files that are whole or not there: made in memory, written under a temporary name and renamed."""

import json
import math
import os
import platform
import tempfile
import time
import zlib
from pathlib import Path
from typing import Any

from rotorjax.errors import InputError

LEFT_OVER = 3600.0  # s, after which another machine's temporary file is no longer being written


def write_bytes(path: str | Path, content: bytes | memoryview) -> None:
    """Write a whole file. All files that rotorjax writes go through here.

    The content appears under `path` complete or not at all; an interrupt leaves the old file as it was, and what a
    killed run left half written is removed by the next one that writes `path`. What is no regular file (a pipe,
    /dev/null) is written to, never replaced. Raises InputError where the file cannot be written, a full disk included.
    """
    path = Path(path)
    try:
        if path.exists() and not path.is_file():
            path.write_bytes(content)
        else:
            _replace(path.resolve(), content)  # a link stays a link
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: the file must be writable, but is not: {_reason(error)}") from None


def write_text(path: str | Path, text: str) -> None:
    """Write a whole text file in UTF-8. Raises InputError where it cannot be written."""
    write_bytes(path, text.encode())


def write_json(path: str | Path, content: Any) -> None:
    """Write strict JSON as `json_text` has it. Raises InputError where it cannot be written."""
    write_text(path, json_text(content, indent=2) + "\n")


def json_text(content: Any, indent: int | None = None) -> str:
    """Strict JSON: numbers that are not finite become null, arrays lists."""
    return json.dumps(_plain(content), indent=indent, ensure_ascii=False, allow_nan=False)


def make_folder(path: str | Path) -> Path:
    """Make a folder with its parents and prove that files can be written in it.

    Raises InputError where that fails.
    """
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: the output folder must be writable, but is not: {_reason(error)}") from None
    return path


def check_output(path: str | Path | None) -> None:
    """Prove, before the work, that a file can be written after it; its folder is made. None: nothing is to be written.

    Raises InputError where it cannot.
    """
    if path is None:
        return
    path = Path(path)
    try:
        folder, special = path.resolve().parent, path.exists() and not path.is_file()
    except (OSError, ValueError) as error:
        raise InputError(f"{str(path)!r}: the file must be writable, but is not: {_reason(error)}") from None
    if path.is_dir():
        raise InputError(f"{path}: the output must be a file, but is a folder")
    if special and not os.access(path, os.W_OK):
        raise InputError(f"{path}: the file must be writable, but is not")
    if not special:
        make_folder(folder)


def _replace(path: Path, content: bytes | memoryview) -> None:
    temporary = path.with_name(f".{_crc(path.name)}-{_crc(platform.node())}-{os.getpid()}.part")
    for old in path.parent.glob(f".{_crc(path.name)}-*-*.part"):
        if _left_over(old):
            old.unlink(missing_ok=True)
    try:
        temporary.write_bytes(content)  # as readable as any other new file
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def _crc(text: str) -> str:
    return f"{zlib.crc32(os.fsencode(text)):08x}"


def _left_over(temporary: Path) -> bool:
    """Whether the process that wrote a temporary file is gone; of another machine's only its age tells."""
    _, machine, process = temporary.stem.split("-")
    if os.name != "posix" or machine != _crc(platform.node()):
        return temporary.stat().st_mtime + LEFT_OVER < time.time()
    try:
        os.kill(int(process), 0)
    except ProcessLookupError:
        return True
    except PermissionError:
        return False
    return int(process) == os.getpid()


def _reason(error: OSError | ValueError) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
