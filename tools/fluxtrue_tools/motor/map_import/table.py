# SPDX-License-Identifier: Apache-2.0
"""A list of points as text: any separator, decimal point or comma, lines above the header and below it with units."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.map_import.source import FLUXES, PLACES, QUANTITIES, Raw, known_as, mapping, place_of, stated
from fluxtrue_tools.motor.text_table import ROWS_MAX, cells, number, numbered_lines, of_windows

SEPARATORS = (";", "\t", ",")
HEADER_LINES = 200  # in which the header is looked for
DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
LIMIT = 1e9  # of a number in the file's own unit
OPTION = "--column"
Lines = list[tuple[int, str]]


def _found(header: list[str], chosen: dict[str, str], quantities: tuple[str, ...]) -> dict[str, int]:
    """Columns of the quantities; those that are named on the command line must be there."""
    places: dict[str, int] = {}
    for quantity in quantities:
        wanted = chosen.get(quantity)
        at = [k for k, name in enumerate(header)
              if (name == wanted if wanted is not None else known_as(quantity, name))]  # fmt: skip
        if len(at) == 1:
            places[quantity] = at[0]
    return places


def _is_header(places: dict[str, int], chosen: dict[str, str], wanted: tuple[str, ...]) -> bool:
    here = any({*pair} <= {*places} for pair in PLACES) or "loss" in wanted
    return here and {*wanted} <= {*places} and {*chosen} <= {*places}


def _header(
    path: Path, lines: Lines, chosen: dict[str, str], quantities: tuple[str, ...], wanted: tuple[str, ...], option: str
) -> tuple[int, str, dict[str, int], list[str]]:
    """Index of the header line, separator, columns, all of its cells."""
    for index, (line, text) in enumerate(lines[:HEADER_LINES]):
        for separator in SEPARATORS:
            if separator not in text:
                continue
            header = cells(path, line, text.lstrip("#% "), separator)
            places = _found(header, chosen, quantities)
            if _is_header(places, chosen, wanted):
                return index, separator, places, header
    first = lines[0][1].strip()[:100] if lines else ""
    named = "".join(f", {name} = {header!r}" for name, header in chosen.items())
    place = "" if "loss" in wanted else "i_d and i_q (or i_s and gamma), "
    raise FluxtrueError(
        f"{path}: no header line with columns for {place}{', '.join(wanted)}{named}; "
        f"the first line is {first!r}; name columns with {option} NAME=HEADER"
    )


def _value(path: Path, line: int, column: str, text: str, comma: bool) -> float:
    if comma and "," in text and "." not in text:
        text = text.replace(",", ".", 1)
    return number(path, line, column, text, LIMIT)


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True


def _rows(path: Path, lines: Lines, separator: str, places: dict[str, int], width: int) -> Iterator[list[float]]:
    """The numbers below the header, in the order of the places."""
    units_possible = True
    for line, text in lines:
        if text.lstrip().startswith(("#", "%")):
            continue
        row = cells(path, line, text, separator)
        if len(row) != width and not (len(row) == width + 1 and not row[-1]):
            raise FluxtrueError(f"{path}:{line}: {len(row)} columns, wanted: {width} as in the header")
        units, units_possible = units_possible and not any(_is_number(row[k]) for k in places.values()), False
        if units:
            continue
        comma = separator != "," and any(DECIMAL_COMMA.fullmatch(row[k]) for k in places.values())
        yield [_value(path, line, name, row[k], comma) for name, k in places.items()]


def read(
    path: Path, given: tuple[str, ...], quantities: tuple[str, ...], wanted: tuple[str, ...], option: str = OPTION
) -> tuple[dict[str, Array], dict[str, str]]:
    """The quantities that the table has, and what the units in its header say."""
    lines = [(n, text) for n, text in numbered_lines(path, decoded=of_windows) if text.strip()]
    if len(lines) > ROWS_MAX:
        raise FluxtrueError(f"{path}: {len(lines)} rows, allowed: up to {ROWS_MAX}")
    chosen = mapping(given, option, quantities)
    top, separator, places, header = _header(path, lines, chosen, quantities, wanted, option)
    if any({*pair} <= {*places} for pair in PLACES):
        pair = place_of(set(places), chosen, path, option)
        spare = {name for other in PLACES for name in other} - {*pair}
        places = {name: place for name, place in places.items() if name not in spare}
    rows = list(_rows(path, lines[top + 1 :], separator, places, len(header)))
    values = np.array(rows, dtype=float).reshape(len(rows), len(places)).T
    said = stated(path, {name: header[place] for name, place in places.items()})
    return dict(zip(places, values, strict=True)), said


def read_map(path: Path, given: tuple[str, ...]) -> Raw:
    """A flux map as a list of points."""
    found, said = read(path, given, QUANTITIES, FLUXES)
    return Raw(path, found, stated=said)
