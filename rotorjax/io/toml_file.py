"""One reader for all TOML files: what their keys are, and complaints in the file's own words.

A schema says for each table which keys there are, what each holds, in which unit and range. `read_toml` parses a file,
checks it against its schema and hands the values on; whatever is wrong is one line that names file, table, key and
value. What a constructor refuses later is told under the file's own key too.
"""

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeVar

from rotorjax.checks import Range, check_list, check_range, closest, number_of, shown
from rotorjax.errors import ArgumentError, InputError
from rotorjax.io.reading import read_text

T = TypeVar("T")
Kind = Literal["number", "whole number", "text", "true or false", "numbers", "stations", "anything"]
_LONGEST_TEXT = 250
_WORDS = {
    "number": "a finite number",
    "text": "text in quotes",
    "whole number": "a whole number",
    "stations": "a number or a table of the two lists r and value",
    "numbers": "a list of numbers",
}


class Key(NamedTuple):
    """What a key holds. range: of each of its numbers. required: whether it must be there. choices: of a text. least:
    how many numbers a list has.

    A "stations" is a number or a table {r = [...], value = [...]}, r over R, and comes out as a float or a pair.
    """

    kind: Kind
    range: Range = Range()
    required: bool = False
    choices: tuple[str, ...] = ()
    least: int = 2


OTHERS = "*"
"""The key of a schema's table that says what all others hold."""
Schema = Mapping[str, Mapping[str, Key]]
Tables = dict[str, dict[str, Any]]


def read_toml(
    path: str | Path,
    schema: Schema,
    build: Callable[[Tables, Path], T],
    names: Mapping[str, str] | None = None,
    optional: tuple[str, ...] = (),
    changes: Mapping[str, Mapping[str, Any]] | None = None,
) -> T:
    """Read a file and make something of its tables: build(tables, folder of the file).

    Tables hold what the file gives, numbers as floats. A table with required keys must be there unless it is among the
    optional ones. names: the file's key for an argument of another name that `build` may refuse. changes: values by
    table and key that stand in place of the file's and are checked as these are; None leaves a key out.

    Raises InputError, naming file, key and value, for a file that is not there, not UTF-8 or not TOML, tables and keys
    that are unknown, misspelt or missing, values of the wrong type or out of range, and whatever `build` raises.
    """
    path, text = Path(path), read_text(path)
    try:
        tables = _checked(_changed(_parse(text), changes or {}), schema, optional)
        return build(tables, path.parent)
    except ArgumentError as error:
        raise InputError(f"{path}: {error.under(_own_key(error.name, schema, names or {}))}") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _parse(text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError("the file must be TOML, but its brackets are nested too deeply") from None
    except ValueError as error:  # TOMLDecodeError, and integers of more digits than Python reads
        raise InputError(f"the file must be TOML, but is not: {str(error).splitlines()[0][:200]}") from None


def _changed(data: dict[str, Any], changes: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    for table, values in changes.items():
        if isinstance(old := data.get(table, {}), dict):
            data = {**data, table: {k: v for k, v in {**old, **values}.items() if v is not None}}
    return data


def _checked(data: dict[str, Any], schema: Schema, optional: tuple[str, ...]) -> Tables:
    for table, values in data.items():
        if table not in schema:
            raise InputError(f"[{shown(table)[1:-1]}] is not a known table: {closest(table, schema)}")
        if not isinstance(values, dict):
            raise InputError(f"[{table}] must be a table, but is {shown(values)}")
    for table, keys in schema.items():
        if table not in (*data, *optional) and any(key.required for key in keys.values()):
            needed = ", ".join(name for name, key in keys.items() if key.required)
            raise InputError(f"table [{table}] is missing; it must hold {needed}")
    return {table: _checked_table(table, data.get(table, {}), keys) for table, keys in schema.items() if table in data}


def _checked_table(table: str, values: dict[str, Any], keys: Mapping[str, Key]) -> dict[str, Any]:
    for name in values:
        if name not in keys and OTHERS not in keys:
            raise InputError(f"[{table}] has the unknown key '{shown(name)[1:-1]}': {closest(name, keys)}")
    for name, key in keys.items():
        if key.required and name not in values:
            raise InputError(f"[{table}] must have the key '{name}' ({key.kind}), but it is missing")
    return {
        name: value_of(f"[{table}] {name}", value, keys[name if name in keys else OTHERS])
        for name, value in values.items()
    }


def value_of(where: str, value: Any, key: Key) -> Any:
    """A key's value, checked, numbers as floats. Raises InputError that says where it stands."""
    try:
        return _READERS[key.kind](where, value, key)
    except ArgumentError as error:
        raise error.under(error.name) from None


def _wrong(where: str, value: Any, key: Key) -> InputError:
    return InputError(f"{where} must be {_WORDS.get(key.kind, key.kind)}, but is {shown(value)}")


def _number(where: str, value: Any, key: Key) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise _wrong(where, value, key)
    return number_of(check_range(where, value, key.range))


def _whole(where: str, value: Any, key: Key) -> int:
    if not isinstance(value, int) or isinstance(value, bool):
        raise _wrong(where, value, key)
    if number_of(value) not in key.range:
        low, high = key.range.low, key.range.high
        raise InputError(f"{where} must be a whole number from {low:g} to {high:g}, but is {shown(value)}")
    return value


def _text(where: str, value: Any, key: Key) -> str:
    if not isinstance(value, str):
        raise _wrong(where, value, key)
    if key.choices and value not in key.choices:
        raise InputError(f"{where} must be one of {', '.join(key.choices)}, but is {shown(value)}")
    if not value.strip() or len(value) > _LONGEST_TEXT or not value.isprintable():
        raise InputError(f"{where} must be text of 1 to {_LONGEST_TEXT} printable characters, but is {shown(value)}")
    return value


def _flag(where: str, value: Any, key: Key) -> bool:
    if not isinstance(value, bool):
        raise _wrong(where, value, key)
    return value


def _numbers(where: str, value: Any, key: Key) -> list[float]:
    if not isinstance(value, list):
        raise _wrong(where, value, key)
    return [float(v) for v in check_list(where, value, key.range, key.least)]


def _stations(where: str, value: Any, key: Key) -> float | tuple[list[float], list[float]]:
    if not isinstance(value, dict):
        return _number(where, value, key)
    if set(value) != {"r", "value"}:
        raise _wrong(where, value, key)
    over_radius = Key("numbers", Range(0.0, 1.0, "R"))
    r, values = _numbers(f"{where}.r", value["r"], over_radius), _numbers(f"{where}.value", value["value"], key)
    if len(r) != len(values):
        raise InputError(f"{where} must hold as many values as stations ({len(r)}), but holds {len(values)}")
    return r, values


def _anything(where: str, value: Any, key: Key) -> Any:
    return value


_READERS = {
    "number": _number,
    "whole number": _whole,
    "text": _text,
    "true or false": _flag,
    "numbers": _numbers,
    "stations": _stations,
    "anything": _anything,
}


def _own_key(name: str, schema: Schema, names: Mapping[str, str]) -> str:
    """The file's key for an argument, `[table] key`; parts after a dot stay."""
    head, dot, rest = name.partition(".")
    if name in names:
        return names[name]
    if head in names:
        return names[head] + dot + rest
    for table, keys in schema.items():
        if head == table and rest in keys:
            return f"[{table}] {rest}"
        if head in keys:
            return f"[{table}] {head}{dot}{rest}"
    return name
