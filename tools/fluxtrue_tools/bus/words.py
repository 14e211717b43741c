# SPDX-License-Identifier: Apache-2.0
"""Names and explanations of everything that is transmitted as a number: faults, states, reasons, results.

Each is written down once, in a list of the firmware: X(NAME, value or bit, "explanation"). From these lists come the C
enumerations, the words of the library and of the description file (by the compiler), and, by this program, the value
tables and comments of the DBC and the tables of the pages.

python -m fluxtrue_tools.bus.words          write DBC and pages
python -m fluxtrue_tools.bus.words --check  fail if one of them says something else
"""

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import click

from fluxtrue_tools.bus import DBC
from fluxtrue_tools.bus.scales import with_hash
from fluxtrue_tools.cli import run_module
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.outputs import write_text

ROOT: Final = Path(__file__).resolve().parents[3]
PAGES: Final = ("docs/architecture.md", "docs/howto/can.md", "docs/howto/commission.md")

SOURCES: Final = {
    "FAULT_LIST": "firmware/types/faults.h",
    "MOTOR_CHECK_LIST": "firmware/types/motor_check.h",
    "DERATING_LIST": "firmware/control/torque/limit.h",
    "COMMISSION_PHASE_LIST": "firmware/control/commission/commission.h",
    "COMMISSION_FAILURE_LIST": "firmware/control/commission/commission.h",
    "RUN_STATE_LIST": "firmware/drive/drive.h",
    "PULSES_PHASE_LIST": "firmware/drive/pulses.h",
    "PULSES_FAILURE_LIST": "firmware/drive/pulses.h",
    "MOVEMENT_LIST": "firmware/drive/movement.h",
    "MOVEMENT_DIRECTION_LIST": "firmware/drive/movement.h",
    "MOVEMENT_PHASE_LIST": "firmware/drive/movement.h",
    "MOVEMENT_FAILURE_LIST": "firmware/drive/movement.h",
    "SPIN_FAILURE_LIST": "hal/host/spin_limit.h",
    "COMMAND_MODE_LIST": "firmware/comm/can_rx.h",
    "DERATING_REASON_LIST": "firmware/comm/messages.h",
    "REQUEST_LIMIT_LIST": "firmware/comm/messages.h",
    "ECU_STATE_LIST": "firmware/ecu/supervisor.h",
    "ECU_FAULT_LIST": "firmware/ecu/supervisor.h",
    "REFUSED_LIST": "firmware/ecu/supervisor.h",
    "RESET_CAUSE_LIST": "hal/system.h",
}
"""Where each list stands."""

BITS: Final = ("FAULT_LIST", "DERATING_LIST", "ECU_FAULT_LIST")
"""Lists of bits; the others are lists of values."""

PREFIX: Final = {"ECU_FAULT_LIST": "ecu_"}
"""What sets names of a list apart from those of another that is told by the same signal."""

CHOICES: Final = {
    "VCU_Commission.Movement": (("MOVEMENT_LIST", 0),),
    "VCU_Commission.Direction": (("MOVEMENT_DIRECTION_LIST", 0),),
    "VCU_TorqueRequest.Mode": (("COMMAND_MODE_LIST", 0),),
    "INV_Status.State": (("ECU_STATE_LIST", 0),),
    "INV_DcLink.DeratingReason": (("DERATING_REASON_LIST", 0),),
    "INV_DcLink.RefusedReason": (("REFUSED_LIST", 0),),
    "INV_Limits.RequestLimit": (("REQUEST_LIMIT_LIST", 0),),
    "INV_Faults.FirstFault": (("FAULT_LIST", 1), ("ECU_FAULT_LIST", 33)),
    "INV_Configuration.MotorCheck": (("MOTOR_CHECK_LIST", 0),),
    "INV_DiagTask.ResetCause": (("RESET_CAUSE_LIST", 0),),
}
"""Signals with a value table, and what is added to the values of each list."""

EXPLAINED: Final = {
    "VCU_Commission.Movement": "MOVEMENT_LIST",
    "VCU_Commission.Direction": "MOVEMENT_DIRECTION_LIST",
    "VCU_TorqueRequest.Mode": "COMMAND_MODE_LIST",
    "INV_Status.State": "ECU_STATE_LIST",
    "INV_DcLink.DeratingReason": "DERATING_REASON_LIST",
    "INV_DcLink.RefusedReason": "REFUSED_LIST",
    "INV_Limits.RequestLimit": "REQUEST_LIMIT_LIST",
    "INV_Faults.DriveFaults": "FAULT_LIST",
    "INV_Faults.EcuFaults": "ECU_FAULT_LIST",
    "INV_Configuration.MotorCheck": "MOTOR_CHECK_LIST",
    "INV_DiagTask.ResetCause": "RESET_CAUSE_LIST",
}
"""Signals whose comment explains every value or bit, behind its first sentence."""

LIST: Final = re.compile(r"^#define (\w+_LIST)\(X\) \\\n((?:.*\\\n)*.*)$", re.MULTILINE)
ROW: Final = re.compile(r'X\((\w+), (\d+), "([^"\\]+)"\)')
MARK: Final = re.compile(r"<!-- words: (\w+) -->\n(?:\|.*\n)*\n?<!-- words: end -->\n")
LEAD: Final = re.compile(r"(.*?\.)(?: .*)?", re.DOTALL)


@dataclass(frozen=True)
class Word:
    """The name and explanation of one value or bit."""

    name: str
    value: int
    text: str


def parse(source: str, wanted: str, where: str) -> list[Word]:
    """A list in a header; every row must be understood."""
    lists = dict(LIST.findall(source))
    if wanted not in lists:
        raise FluxtrueError(f"{where}: no {wanted}")
    prefix = PREFIX.get(wanted, "")
    words = [Word(prefix + name.lower(), int(value), text) for name, value, text in ROW.findall(lists[wanted])]
    if not words or len(words) != lists[wanted].count("X("):
        raise FluxtrueError(f"{where}: {wanted}: {len(words)} rows understood of {lists[wanted].count('X(')}")
    if len({word.value for word in words}) != len(words) or len({word.name for word in words}) != len(words):
        raise FluxtrueError(f"{where}: {wanted}: a name or value comes twice")
    return words


def read(root: Path = ROOT) -> dict[str, list[Word]]:
    """Every list of the firmware."""
    return {name: parse((root / path).read_text(encoding="utf-8"), name, path) for name, path in SOURCES.items()}


def choices(lists: dict[str, list[Word]], signal: str) -> dict[int, str]:
    """The value table of a signal."""
    found = {first + word.value: word.name for name, first in CHOICES[signal] for word in lists[name]}
    return found if 0 in found else {0: "none", **found}


def explained(lists: dict[str, list[Word]], signal: str) -> str:
    """The part of the comment behind its first sentence."""
    name = EXPLAINED[signal]
    kind = "Bit " if name in BITS else ""
    return " ".join(f"{kind}{word.value} {word.name}: {word.text}" for word in lists[name])


def with_dbc(dbc: str, lists: dict[str, list[Word]]) -> str:
    """The DBC with value tables and comments of the lists, and its own hash."""
    numbers = {name: number for number, name in re.findall(r"^BO_ (\d+) (\w+):", dbc, re.MULTILINE)}
    for path in CHOICES | EXPLAINED:
        message, signal = path.split(".")
        if message not in numbers:
            raise FluxtrueError(f"{DBC.name}: no message {message}")
        place = f"{numbers[message]} {signal}"
        if path in CHOICES:
            table = " ".join(f'{value} "{name}"' for value, name in sorted(choices(lists, path).items()))
            dbc = _replaced(dbc, rf"^VAL_ {place} .*$", f"VAL_ {place} {table} ;")
        if path in EXPLAINED:
            found = re.search(rf'^CM_ SG_ {place} "(.*)";$', dbc, re.MULTILINE)
            lead = LEAD.fullmatch(found.group(1)) if found else None
            if lead is None:
                raise FluxtrueError(f"{DBC.name}: {path} has no comment that begins with a sentence")
            comment = f'CM_ SG_ {place} "{lead.group(1)} {explained(lists, path)}";'
            dbc = _replaced(dbc, rf"^CM_ SG_ {place} .*$", comment)
    return with_hash(dbc)


def _replaced(text: str, pattern: str, line: str) -> str:
    """The one line that matches, replaced."""
    text, count = re.subn(pattern, lambda _: line, text, flags=re.MULTILINE)
    if count != 1:
        raise FluxtrueError(f"{DBC.name}: {count} lines match {pattern}, wanted one")
    return text


def table(lists: dict[str, list[Word]], name: str) -> str:
    """A list as a table of a page."""
    rows = [f"| {'bit' if name in BITS else 'value'} | name | meaning |", "|---|---|---|"]
    rows += [f"| {word.value} | `{word.name}` | {_spelt(word.text)} |" for word in lists[name]]
    return "\n".join(rows) + "\n"


def _spelt(text: str) -> str:
    """The text as the pages write it: no full stop in a cell, and a middle dot in a product of units."""
    return re.sub(r"\bNm\b", "N·m", text).removesuffix(".")


def with_tables(page: str, lists: dict[str, list[Word]]) -> str:
    """The page with each table between its marks."""

    def fill(match: re.Match[str]) -> str:
        name = match.group(1)
        if name not in lists:
            raise FluxtrueError(f"no list {name}, known: {', '.join(lists)}")
        return f"<!-- words: {name} -->\n{table(lists, name)}\n<!-- words: end -->\n"

    if page.count("<!-- words: ") != 2 * len(MARK.findall(page)):
        raise FluxtrueError("a mark 'words' without its end, or with something else than a table before it")
    return MARK.sub(fill, page)


def wanted(root: Path = ROOT) -> Iterator[tuple[Path, str, str]]:
    """Every file that follows from the lists: its path, its present text and the required one."""
    lists = read(root)
    files = {root / DBC.relative_to(ROOT): with_dbc, **{root / page: with_tables for page in PAGES}}
    for path, make in files.items():
        text = path.read_text(encoding="utf-8")
        yield path, text, make(text, lists)


@click.command()
@click.option("--check", is_flag=True, help="Write nothing; fail if a file says something else than the lists.")
def main(check: bool) -> None:
    """Write the words of the firmware into DBC and pages."""
    differing = [(path, text) for path, before, text in wanted() if before != text]
    for path, text in differing:
        if check:
            print(f"{path.relative_to(ROOT)} differs from the firmware's lists: run python -m fluxtrue_tools.bus.words")
        else:
            write_text(path, text)
    sys.exit(1 if check and differing else 0)


if __name__ == "__main__":
    run_module(main)
