# SPDX-License-Identifier: Apache-2.0
"""Lines and numbers of a table as text: what flux maps and imported tables have in common."""

import csv
import math
import stat
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
    """Refuse what is no file, or a file that is too large to be a map."""
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        raise FluxtrueError(f"{path}: cannot be read: not a file")
    if status.st_size > SIZE_MAX:
        raise FluxtrueError(f"{path}: {status.st_size} bytes, allowed: up to {SIZE_MAX}")


def numbered_lines(path: Path, wanted_by: str = "") -> list[tuple[int, str]]:
    """Every line of the file with its number; `wanted_by` is the key that names the file."""
    try:
        check_size(path)
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        named = f", named by {wanted_by}" if wanted_by else ""
        raise FluxtrueError(f"{path}: no such file{named}") from None
    except ValueError as error:
        if isinstance(error, UnicodeDecodeError):
            raise FluxtrueError(f"{path}: not UTF-8 text") from None
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
