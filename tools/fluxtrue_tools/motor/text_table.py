# SPDX-License-Identifier: Apache-2.0
"""Lines and numbers of a table as text: what flux maps and imported tables have in common."""

import codecs
import csv
import math
import stat
from collections.abc import Callable
from pathlib import Path

from fluxtrue_tools import strict
from fluxtrue_tools.errors import FluxtrueError

ROWS_MAX = 1_000_000
SIZE_MAX = 200_000_000  # bytes
VALUE_MAX = 1e5  # A, V·s
SEPARATORS = {";": "';'", "\t": "tabs"}


def number(path: Path, line: int, column: str, text: str, limit: float = VALUE_MAX) -> float:
    """A cell's value; `column` ends in its unit."""
    try:
        value = float(text.replace("_", "?"))  # Python would read 1_0 as 10
    except ValueError:
        raise FluxtrueError(f"{path}:{line}: {column} = '{text.strip()[:40]}', allowed: a number") from None
    if not math.isfinite(value) or abs(value) > limit:
        unit = strict.unit_of(column)
        raise FluxtrueError(
            f"{path}:{line}: {column} = {text.strip()[:40]}, allowed: a finite number from "
            f"{-limit:g} to {limit:g} {unit}".rstrip()
        )
    return value


def check_size(path: Path) -> None:
    """Refuse a path that is no file, or a file that is too large to be a map."""
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        raise FluxtrueError(f"{path}: cannot be read: not a file")
    if status.st_size > SIZE_MAX:
        raise FluxtrueError(f"{path}: {status.st_size} bytes, allowed: up to {SIZE_MAX}")


def _own(data: bytes) -> str:
    return data.decode("utf-8-sig")


def of_windows(data: bytes) -> str:
    """Text as programs for Windows export it: UTF-8, UTF-16 with its mark, or the Western European code page."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16")
    try:
        return _own(data)
    except UnicodeDecodeError:
        return data.decode("cp1252")


def numbered_lines(path: Path, wanted_by: str = "", decoded: Callable[[bytes], str] = _own) -> list[tuple[int, str]]:
    """Every line of the file with its number; `wanted_by` is the key that names the file."""
    try:
        check_size(path)
        text = decoded(path.read_bytes())
    except FileNotFoundError:
        named = f", named by {wanted_by}" if wanted_by else ""
        raise FluxtrueError(f"{path}: no such file{named}") from None
    except ValueError as error:
        if isinstance(error, UnicodeDecodeError):
            text = "UTF-8 text" if decoded is _own else "text in UTF-8, UTF-16 or Windows-1252"
            raise FluxtrueError(f"{path}: not {text}") from None
        raise FluxtrueError(f"{wanted_by} = {path.name!r}: {error}") from None  # a NUL in the name
    except OSError as error:
        raise FluxtrueError(f"{path}: cannot be read: {error.strerror}") from None
    return list(enumerate(text.splitlines(), start=1))


def data_lines(path: Path, wanted_by: str = "") -> list[tuple[int, str]]:
    """The lines that are neither empty nor comments."""
    return [
        (n, line) for n, line in numbered_lines(path, wanted_by) if line.strip() and not line.lstrip().startswith("#")
    ]


def cells(path: Path, line: int, text: str, separator: str = ",") -> list[str]:
    """The cells of one line, without the blanks around them."""
    try:
        return [cell.strip() for cell in next(csv.reader([text], delimiter=separator))]
    except (csv.Error, StopIteration):
        raise FluxtrueError(f"{path}:{line}: not a line of a table; wanted: cells separated by {separator!r}") from None
