"""Text for terminals that lack some characters: Ω becomes Omega where it cannot be shown, and nothing fails."""

import codecs
import io
import sys
import unicodedata

OTHERS = {
    "°": " deg", "×": "x", "·": ".", "−": "-", "–": "-", "…": "...", "→": "->", "←": "<-", "≤": "<=", "≥": ">=",
    "≈": "~", "√": "sqrt ", "∞": "inf", "µ": "mu",
    "²": "^2", "³": "^3", "‖": "||", "‘": "'", "’": "'", "“": '"', "”": '"',
}  # fmt: skip
ERRORS = "rotorjax.spelt"


def spelt(character: str) -> str:
    """A character in ASCII: Greek letters by their names, digits below the line as digits; ? where there is nothing.

    >>> "".join(map(spelt, "ΩR, λ₀, 3°"))  # as Unicode spells it
    'OmegaR, lamda0, 3 deg'
    """
    if character.isascii() or character in OTHERS:
        return OTHERS.get(character, character)
    name = unicodedata.name(character, "")
    if name.startswith("GREEK"):
        letter = name.partition(" WITH")[0].rpartition(" ")[2]
        return letter.capitalize() if "CAPITAL" in name else letter.lower()
    return unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode() or "?"


def make_safe() -> None:
    """Let stdout and stderr spell out what their encoding (latin-1, cp1252) lacks."""
    codecs.register_error(ERRORS, _spell_out)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=ERRORS)


def _spell_out(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeEncodeError)
    return "".join(map(spelt, error.object[error.start : error.end])), error.end
