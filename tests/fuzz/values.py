"""Odd values, and ways to spoil a text."""

import re
from random import Random

NUMBER = re.compile(r"(?<![\w.])\d+\.\d*")

# fmt: off
NUMBERS = (
    0.0, -0.0, 1.0, -1.0, 0.5, 1e-30, 5e-324, 1e-3, 0.1, 0.3, 0.9999999, 3.0, 7.0, 45.0, 90.0, 1e3, 1e6, 1e30, 1e200,
    1e308, -1e308, float("inf"), float("-inf"), float("nan"),
)
WORDS = (
    "", " ", "no", "true", "uh60", "freewake", "x" * 300, "a\nb", "ä", "\u2028", "--", "-", "1,5", "1e400", "None",
)
IN_TOML = (
    "true", "false", "[]", "{}", "[1]", "[1, 2]", "[[1], 2]", '"no"', '"x"', "nan", "inf", "-inf", "1e400", "0x7f",
    "9" * 400, "9" * 5000, "[" * 3000, "1979-05-27", '"\\u0000"', "'''a'''", "{ r = [0, 1], value = [1, 2] }",
    "{ r = [1, 0], value = [1, nan] }", "[true, 1, 2]", "[0.0, 1e308, 1.0]", f'"{"x" * 5000}"', "1_000", "5e-324", "-0",
)
# fmt: on
BYTES = (
    b"\x00",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"\xe4",
    b"\r",
    b"\n\n",
    b";",
    b",",
    b"\t",
    b"#",
    b"1e308",
    b"nan",
    b'"',
)


def number(rng: Random) -> float:
    """Odd numbers, and ordinary ones of any size and sign."""
    if rng.random() < 0.5:
        return rng.choice(NUMBERS)
    return rng.choice((1, -1)) * 10 ** rng.uniform(-4, 4)


def anything(rng: Random) -> object:
    """A number, or what is none."""
    others = (None, True, "1.0", "x" * 5000, [], [1.0, 2.0], {}, 10**400, b"1", object(), 1j, 2**31)
    return rng.choice(others) if rng.random() < 0.25 else number(rng)


def spoiled_toml(rng: Random, text: str) -> bytes:
    """A TOML text with one to three things wrong: values, keys, tables, bytes."""
    lines = text.splitlines()
    for _ in range(rng.randint(1, 3)):
        i = rng.randrange(len(lines))
        key = lines[i].partition("=")[0]
        lines[i] = rng.choice((
            lambda key=key: f"{key} = {rng.choice(IN_TOML)}",
            lambda key=key: f"{key} = {number(rng)!r}",
            lambda i=i: NUMBER.sub(lambda found: f"{float(found[0]) * rng.uniform(0.8, 1.25):.6g}", lines[i]),
            lambda: "",
            lambda i=i: f"{lines[i]}\n{lines[i]}",
            lambda i=i: lines[i][1:],
            lambda: f"[{rng.choice(('foo', 'rotor', 'time', 'hinge', 'wake'))}]",
        ))()  # fmt: skip
    return spoiled_bytes(rng, "\n".join(lines).encode()) if rng.random() < 0.2 else "\n".join(lines).encode()


def spoiled_bytes(rng: Random, content: bytes) -> bytes:
    """Bytes with something put in, taken out or cut off."""
    at = rng.randrange(len(content) + 1)
    cut = rng.randint(0, 40)
    return rng.choice((
        content[:at] + rng.choice(BYTES) + content[at:],
        content[:at] + content[at + cut :],
        content[:at],
        content[:at] + content[max(0, at - cut) : at] + content[at:],
        rng.choice(BYTES) + content,
    ))  # fmt: skip
