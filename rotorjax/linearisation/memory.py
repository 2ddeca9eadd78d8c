"""What the compiler has left is given back to the system before gigabytes are asked for.

XLA frees what it needed to compile a program, a gigabyte for a derivative of the rotor in its free wake, but in small
pieces, which the C library keeps for others like them: a matrix finds no place there.
"""

import ctypes
import sys


def give_back() -> None:
    """Return memory that is free within this process to the system, where its C library can (GNU's; else nothing)."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform == "linux" else None
    if trim is not None:
        trim(0)
