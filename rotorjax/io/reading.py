"""Files that users name, read with care: regular files of sensible size, text in UTF-8."""

import stat
from pathlib import Path

from rotorjax.errors import InputError

LARGEST = 2**31  # bytes
LARGEST_TEXT = 2**26  # bytes: rotor, case and table files have some thousands


def read_bytes(path: str | Path, largest: int = LARGEST) -> bytes:
    """Content of a regular file. Raises InputError where there is none, it is too large or cannot be read."""
    path = Path(path)
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):  # a pipe would wait for ever, /dev/zero never end
            raise InputError(f"{path}: the path must be a file, but is {_kind(found.st_mode)}")
        if found.st_size > largest:
            raise InputError(f"{path}: the file must have at most {largest} bytes, but has {found.st_size}")
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: the file must be readable, but is not: {error.strerror or error}") from None
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{str(path)!r}: the path must be a file's, but cannot be one: {error}") from None


def read_text(path: str | Path) -> str:
    """Text of a regular file in UTF-8, with or without a byte-order mark, line ends as \\n.

    Raises InputError where there is none, it is too large or not UTF-8.
    """
    content = read_bytes(path, LARGEST_TEXT)
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
            raise InputError(f"{path}: the file must be text in UTF-8, but is UTF-16: save it as UTF-8") from None
        line = content[: error.start].count(b"\n") + 1
        raise InputError(
            f"{path}: the file must be text in UTF-8, but byte {content[error.start]:#04x} in line {line} is not"
        ) from None


def _kind(mode: int) -> str:
    return "a folder" if stat.S_ISDIR(mode) else "a pipe" if stat.S_ISFIFO(mode) else "a device or socket"
