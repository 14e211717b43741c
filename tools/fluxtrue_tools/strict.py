# SPDX-License-Identifier: Apache-2.0
"""Strict TOML files: every error is one line that names file, key, value, unit and what is allowed."""

import math
import re
import sys
import tomllib
import types
import typing
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError
from pydantic_core import PydanticCustomError

from fluxtrue_tools.errors import FluxtrueError

SIZE_MAX = 10_000_000  # bytes; the largest file of the project has two thousand
TOO_LARGE = "too_large"  # kind of error of a number whose magnitude is above the next one
NOT_FINITE = "finite_number"  # pydantic's: NaN or infinity
LARGEST = 1e12  # of a number in any of the units: what is larger is a slip, and its square may overflow
SHOWN_MAX = 60  # characters of a bad value in a message
UNITS = {
    "Nm_per_s": "N·m/s", "rpm_per_s": "rpm/s", "A_per_K": "A/K", "N_per_m2_s2": "N/(m/s)²", "per_K": "1/K",
    "rad_s": "rad/s", "kgm2": "kg·m²", "Nms": "N·m·s", "Nm": "N·m", "rpm": "rpm", "A_rms": "A rms", "Vs": "V·s",
    "ohm_20": "Ω", "ohm": "Ω", "hz": "Hz", "deg": "°", "rad": "rad", "kg": "kg", "V": "V", "A": "A", "H": "H",
    "s": "s", "C": "°C", "K": "K", "m": "m", "N": "N", "W": "W",
}  # fmt: skip
NOT_A_UNIT = {"observer_m"}
OF_KEY = {"iron_loss_hysteresis": "W/(rad/s·(V·s)²)", "iron_loss_eddy": "W/((rad/s)²·(V·s)²)"}
DIGITS_KEPT = 400
DIGITS = re.compile(rf"[0-9](?:_?[0-9]){{{DIGITS_KEPT},}}")
_UNIT = re.compile(rf"_({'|'.join(UNITS)})(?:_[abc])?$")


class Strict(BaseModel):
    """A table in which an unknown key, another type, NaN and infinity are errors."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    def given(self) -> set[str]:
        """Keys that the file contains; all others have their default."""
        return set(self.model_fields_set)


class PartError(ValueError):
    """A value is wrong in one part of it: where below its key, what stands there, and what is allowed there."""

    def __init__(self, at: tuple[int | str, ...], value: Any, allowed_there: str) -> None:
        super().__init__(allowed_there)
        self.at, self.value = at, value


Model = TypeVar("Model", bound=BaseModel)


def any_number(value: Any) -> Any:
    """TOML distinguishes 1 and 1.0, which means the same here. Of any magnitude: its range is checked elsewhere."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return value
    try:
        return float(value)
    except OverflowError:
        return sys.float_info.max if value > 0 else -sys.float_info.max


def number(value: Any) -> Any:
    """The same, of a magnitude that is possible in any of the units."""
    found = any_number(value)
    if isinstance(found, float) and LARGEST < abs(found) < math.inf:
        raise PydanticCustomError(
            TOO_LARGE, "a number of a smaller magnitude"
        )  # explain() says which numbers are allowed
    return found


def flag(value: Any) -> Any:
    """Names of the controller take numbers; true and false are 1 and 0."""
    return float(value) if isinstance(value, bool) else any_number(value)


Number = Annotated[float, BeforeValidator(number)]
AnyNumber = Annotated[float, BeforeValidator(any_number)]  # the simulation knows its range (sim/library.py)
Flag = Annotated[float, BeforeValidator(flag)]


def unit_of(key: str) -> str:
    """The unit of a key, mostly that in which its name ends, as a reader writes it; empty without one."""
    name = key.rsplit(".", maxsplit=1)[-1]
    found = None if name in NOT_A_UNIT else _UNIT.search(key)
    return OF_KEY.get(name, UNITS[found[1]] if found else "")


def down(value: float) -> float:
    """Round a largest value down to four digits, so that the value in a message is accepted."""
    places = 3 - math.floor(math.log10(abs(value))) if value else 0
    step = 10.0**-places
    return round(math.floor(value / step * (1.0 + 1e-12)) * step, places)  # not 304.40000000000003


def quantity(key: str, value: Any) -> str:
    """`key = value unit` as a short text."""
    huge = isinstance(value, float) and abs(value) == sys.float_info.max
    shown = f"{value:.3g}" if huge else repr(value)
    shown = shown if len(shown) <= SHOWN_MAX else f"{shown[: SHOWN_MAX - 3]}..."
    last = [part for part in key.split(".") if not part.isdigit()][-1]
    unit = unit_of(last) if isinstance(value, int | float) and not isinstance(value, bool) else ""
    return f"{key} = {shown} {unit}".rstrip() + (" or beyond" if huge else "")


def _leaf(annotation: Any, location: Iterable[int | str]) -> tuple[Any, list[Any]]:
    """The type at a location below an annotation, and the limits written beside it."""
    metadata: list[Any] = []
    while typing.get_origin(annotation) is Annotated:
        annotation, *more = typing.get_args(annotation)
        metadata += [item for one in more for item in getattr(one, "metadata", [one])]
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin in (types.UnionType, typing.Union):
        kinds = [kind for kind in arguments if kind is not type(None)]
        below, more = _leaf(kinds[0], location)
        return below, metadata + more
    rest = list(location)
    if not rest:
        return annotation, metadata
    head, tail = rest[0], rest[1:]
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        info = annotation.model_fields.get(str(head))
        if info is None:
            return None, []
        below, more = _leaf(info.annotation, tail)
        return below, more + (list(info.metadata) if not tail else [])
    if origin is tuple and arguments:
        index = head if isinstance(head, int) and len(arguments) > head and arguments[-1] is not Ellipsis else 0
        return _leaf(arguments[index], tail)
    if origin is dict:
        return _leaf(arguments[1], tail)
    return None, []


def _range(metadata: list[Any], least: str, most: str) -> str:
    """The limits of a field in words, from the annotations the validation itself uses; without one, as given."""
    found = {name: getattr(item, name) for item in metadata for name in ("ge", "gt", "le", "lt", "min_length",
             "max_length", "pattern") if getattr(item, name, None) is not None}  # fmt: skip
    low = f"from {found['ge']:g}" if "ge" in found else f"above {found['gt']:g}" if "gt" in found else least
    high = f"{found['le']:g}" if "le" in found else f"below {found['lt']:g}" if "lt" in found else most
    if low.startswith("from") and high and not high.startswith("below"):
        return f" {low} to {high}"
    return " " + " up to ".join(part for part in (low, high) if part) if low or high else ""


def _nouns(kind: Any) -> str:
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return "a table with the keys " + ", ".join(kind.model_fields)
    if typing.get_origin(kind) is Literal:
        return " or ".join(repr(value) for value in typing.get_args(kind))
    if typing.get_origin(kind) in (tuple, list):
        return "a list"
    if typing.get_origin(kind) is dict:
        return "a table of names and numbers"
    return {int: "a whole number", float: "a finite number", bool: "true or false", str: "text"}.get(kind, "")


def allowed(model: type[BaseModel], location: tuple[int | str, ...], complete: bool = False) -> str:
    """What the field at a location takes, in words with its unit; complete: with both ends of its range."""
    kind, metadata = _leaf(model, location)
    keys = [str(part) for part in location if isinstance(part, str)]
    unit = unit_of(keys[-1]) if keys and kind in (int, float) else ""
    if kind is str:
        longest = next((item.max_length for item in metadata if getattr(item, "max_length", None)), None)
        return f"text of 1 to {longest} characters" if longest else "text, not empty"
    span = _range(metadata, f"from {-LARGEST:g}", f"{LARGEST:g}") if complete else _range(metadata, "", "")
    return f"{_nouns(kind)}{span}{' ' if span or not unit else ', in '}{unit}".strip()


def _keys(model: type[BaseModel], location: tuple[int | str, ...]) -> str:
    """The keys of the table that a location is in."""
    kind, _ = _leaf(model, location[:-1])
    known = isinstance(kind, type) and issubclass(kind, BaseModel)
    return ", ".join(kind.model_fields) if known else ""


def _cause(errors: list[Any]) -> Any:
    """The error to name: the first one, or an unknown key of the table in which the first one misses a key.

    A misspelt key causes both, and only the unknown key shows the user the slip.
    """
    first = errors[0]
    if first["type"] != "missing":
        return first
    misspelt = (e for e in errors if e["type"] == "extra_forbidden" and e["loc"][:-1] == first["loc"][:-1])
    return next(misspelt, first)


def explain(error: ValidationError, model: type[BaseModel], words: dict[str, str] | None = None) -> str:
    """One error as one line. `words` replaces the description of the values that a key takes."""
    first = _cause(error.errors())
    location = tuple(part for part in first["loc"] if not str(part).startswith("function-"))
    where = ".".join(map(str, location))
    if first["type"] == "extra_forbidden":
        return f"{where}: unknown key, allowed: {_keys(model, location)}"
    what = (words or {}).get(where) or allowed(model, location, first["type"] in (TOO_LARGE, NOT_FINITE))
    if first["type"] == "missing":
        return f"{where}: missing, wanted: {what}"
    if first["type"] == "value_error":
        cause = first.get("ctx", {}).get("error")
        if isinstance(cause, PartError):
            return f"{quantity('.'.join(map(str, (*location, *cause.at))), cause.value)}, allowed: {cause}"
        text = first["msg"].removeprefix("Value error, ")
        own_name = not where or text.startswith(where)
        names_key = isinstance(first["input"], dict) and not text.startswith("allowed: ")
        if own_name or names_key:  # the complaint about a table names a key in it
            return text if own_name else f"{where}.{text}"
        return f"{quantity(where, first['input'])}: {text}"
    if not where:
        return f"not a table of keys, wanted: {', '.join(model.model_fields)}"
    return f"{quantity(where, first['input'])}, allowed: {what or first['msg'][0].lower() + first['msg'][1:]}"


def read_text(path: Path) -> str:
    """Read a text file completely."""
    try:
        if path.stat().st_size > SIZE_MAX:
            raise FluxtrueError(f"{path}: {path.stat().st_size} bytes, allowed: up to {SIZE_MAX}")
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise FluxtrueError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise FluxtrueError(f"{path}: not UTF-8 text") from None
    except ValueError as error:  # a NUL in the name
        raise FluxtrueError(f"{str(path)!r}: cannot be read ({error})") from None


def loads(text: str, name: str) -> dict[str, Any]:
    """A file's text as TOML. Python reads no whole number of more than 4300 digits. Shortened to its first ones it is
    still larger than any that is allowed, and the check of its key refuses it."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FluxtrueError(f"{name}: not valid TOML: {error}") from None
    except (ValueError, RecursionError) as error:
        shorter = DIGITS.sub(lambda match: match[0][:DIGITS_KEPT], text)
        if shorter == text:
            raise FluxtrueError(f"{name}: not valid TOML: {error}") from None
        return loads(shorter, name)


def parse(model: type[Model], text: str, name: str, complain: Callable[[ValidationError], str] | None = None) -> Model:
    """A file's text as its model; `name` is for messages."""
    data = loads(text, name)
    try:
        return model.model_validate(data)
    except ValidationError as error:
        said = complain(error) if complain is not None else explain(error, model)
        raise FluxtrueError(f"{name}: {said}") from None
