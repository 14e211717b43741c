# SPDX-License-Identifier: Apache-2.0
"""fmea.csv: one line per fault and operating range, with what the drive must do. It is the campaign's input."""

import csv
import io
import math
import operator
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from fluxtrue_tools import strict
from fluxtrue_tools.errors import FluxtrueError

COLUMNS: Final = ("id", "element", "failure", "setup", "injection", "points", "reaction", "expected", "detect_ms",
                  "torque_Nm", "torque_ms", "against_cm", "current_share", "vdc_share", "watch_ms", "status", "witness",
                  "result", "reference")  # fmt: skip
RECORDED: Final = ("status", "witness", "result")  # written by --record
SAFE_STATE, BOUNDED, LESS, KEEP, RAMP = "safe_state", "bounded", "less", "keep", "ramp"
REACTIONS: Final = (SAFE_STATE, BOUNDED, LESS, KEEP, RAMP)
MET, PHYSICS, OPEN = "met", "physics", "open"
NO_EFFECT: Final = "no effect"  # verdict of a run, not the status of a line: nothing was there to react to
STATUSES: Final = (MET, PHYSICS, OPEN)  # physics: met, in some runs only as well as the best safe state
_ID: Final = re.compile(r"[a-z0-9]+(?:-[a-z0-9]+)*")
_STEP: Final = re.compile(
    r"(?P<name>[A-Za-z_][\w.\[\]]*)=(?P<how>[x+^]?)(?P<value>point|-?\d+(?:\.\d+)?(?:e-?\d+)?)"
    r"(?:@(?P<at>\d+)(?:\.\.(?P<until>\d+))?)?"
)
_CONDITION: Final = re.compile(r"(rpm|Nm|speed|torque|motor)(>=|<=|==|!=|>|<)([\w.-]+)")
_COMPARE: Final[dict[str, Callable[[object, object], bool]]] = {
    ">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt, "==": operator.eq, "!=": operator.ne,
}  # fmt: skip


@dataclass(frozen=True)
class Step:
    """One change: at a time after the injection, or along a straight line between two times, ms."""

    name: str
    how: str  # "": the value; x: times the present one; +: added to it; ^: these bits inverted
    value: float  # NaN: the operating point's torque
    at_ms: int = 0
    until_ms: int = 0

    def applied(self, present: float, point: float) -> float:
        """The new value."""
        value = point if math.isnan(self.value) else self.value
        if self.how == "^":
            return float(int(present) ^ int(value))
        return present * value if self.how == "x" else present + value if self.how == "+" else value


@dataclass(frozen=True)
class Point:
    """Where a fault meets the drive; rpm and Nm are magnitudes, the shares have their signs."""

    index: int
    sign: float
    motor: str
    speed: float
    torque: float
    speed_rpm: float
    torque_Nm: float

    @property
    def name(self) -> str:
        """The name for commands and messages."""
        return f"{self.motor}/{self.index}/{'+' if self.sign > 0 else '-'}"

    def value(self, name: str) -> float | str:
        """What a condition names."""
        return {"rpm": abs(self.speed_rpm), "Nm": abs(self.torque_Nm), "speed": self.speed, "torque": self.torque,
                "motor": self.motor}[name]  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One line."""

    id: str
    element: str
    failure: str
    setup: tuple[Step, ...]
    injection: tuple[Step, ...]
    points: tuple[tuple[str, str, float | str], ...]
    reaction: str
    expected: tuple[str, ...]
    detect_ms: float
    torque_Nm: float
    torque_ms: float
    against_cm: float
    current_share: float
    vdc_share: float
    watch_ms: int
    status: str
    witness: str
    text: dict[str, str]

    @property
    def must_act(self) -> bool:
        """Whether a run without any effect shows nothing: a change of the memory to which a reaction is demanded."""
        return bool(self.expected) and any(step.name.startswith("memory.") for step in self.injection)

    def holds_at(self, point: Point) -> bool:
        """Whether the line speaks of this operating point."""
        return all(_COMPARE[sign](point.value(name), value) for name, sign, value in self.points)


class _Line:
    """One line while it is read; every complaint names file, line and column."""

    def __init__(self, where: str, cells: dict[str, str]) -> None:
        self.where, self.cells = where, cells

    def wrong(self, column: str, allowed: str) -> FluxtrueError:
        return FluxtrueError(f"{self.where}: {column} = {self.cells[column][:60]!r}, allowed: {allowed}")

    def number(self, column: str, default: float) -> float:
        text = self.cells[column]
        try:
            value = float(text) if text else default
        except ValueError:
            value = math.nan
        if not (0.0 <= value < 1e9) and text:
            raise self.wrong(column, "a number from 0")
        return value

    def steps(self, column: str) -> tuple[Step, ...]:
        found = []
        for part in filter(None, (each.strip() for each in self.cells[column].split(";"))):
            match = _STEP.fullmatch(part)
            if match is None:
                raise self.wrong(column, "name=value, name=xfactor, name=+difference, name=^bits, each perhaps with "
                                         "@ms or @ms..ms, separated by ;")  # fmt: skip
            value = math.nan if match["value"] == "point" else float(match["value"])
            at = int(match["at"] or 0)
            found.append(Step(match["name"], match["how"], value, at, int(match["until"] or at)))
        return tuple(found)

    def conditions(self) -> tuple[tuple[str, str, float | str], ...]:
        found: list[tuple[str, str, float | str]] = []
        for part in filter(None, (each.strip() for each in self.cells["points"].split(";"))):
            match = _CONDITION.fullmatch(part)
            try:
                if match is None:
                    raise ValueError
                found.append((match[1], match[2], match[3] if match[1] == "motor" else float(match[3])))
            except ValueError:
                raise self.wrong("points", "conditions such as rpm>=500, Nm<20, speed>0.8, torque<0, motor==hsm1, "
                                           "separated by ;") from None  # fmt: skip
        return tuple(found)

    def one_of(self, column: str, words: tuple[str, ...]) -> str:
        if self.cells[column] not in words:
            raise self.wrong(column, ", ".join(words))
        return self.cells[column]

    def row(self) -> Row:
        if not _ID.fullmatch(self.cells["id"]):
            raise self.wrong("id", "lower-case words joined by -")
        reaction = self.one_of("reaction", REACTIONS)
        expected = tuple(filter(None, self.cells["expected"].split("|")))
        if (reaction in (SAFE_STATE, BOUNDED, LESS)) != bool(expected):
            raise self.wrong("expected", f"names of faults separated by | with {SAFE_STATE}, {BOUNDED} and {LESS}, "
                                         "else empty")  # fmt: skip
        return Row(
            self.cells["id"], self.cells["element"], self.cells["failure"], self.steps("setup"),
            self.steps("injection"), self.conditions(), reaction, expected, self.number("detect_ms", math.inf),
            self.number("torque_Nm", math.nan), self.number("torque_ms", 0.0), self.number("against_cm", math.nan),
            self.number("current_share", 1.0), self.number("vdc_share", 1.0), int(self.number("watch_ms", 0.0)),
            self.one_of("status", STATUSES), self.cells["witness"], self.cells,
        )  # fmt: skip


def _lines(text: str, name: str) -> Iterator[_Line]:
    reader = csv.DictReader(io.StringIO(text), strict=True)
    try:
        if tuple(reader.fieldnames or ()) != COLUMNS:
            raise FluxtrueError(f"{name}: columns {', '.join(reader.fieldnames or ())[:200]}, allowed: "
                                f"{', '.join(COLUMNS)}")  # fmt: skip
        for cells in reader:
            if None in cells or None in cells.values():
                raise FluxtrueError(f"{name}: line {reader.line_num}: {len(COLUMNS)} columns are wanted")
            yield _Line(f"{name}: line {reader.line_num}", cells)
    except csv.Error as error:
        raise FluxtrueError(f"{name}: line {reader.line_num}: {error}") from None


def parse(text: str, name: str) -> list[Row]:
    """The table; `name` is for messages."""
    rows = [line.row() for line in _lines(text, name)]
    names = [row.id for row in rows]
    for twice in sorted({each for each in names if names.count(each) > 1}):
        raise FluxtrueError(f"{name}: id {twice} twice, allowed: every id once")
    if not rows:
        raise FluxtrueError(f"{name}: no fault, allowed: one line at least")
    return rows


def read(path: Path) -> list[Row]:
    """A table file."""
    return parse(strict.read_text(path), str(path))


def write(rows: list[Row]) -> str:
    """The table as text."""
    out = io.StringIO()
    writer = csv.DictWriter(out, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(row.text for row in rows)
    return out.getvalue()


def recorded(row: Row, status: str, witness: str, result: str) -> Row:
    """The line with what was found."""
    cells = row.text | {"status": status, "witness": witness, "result": result}
    return replace(row, status=status, witness=witness, text=cells)
