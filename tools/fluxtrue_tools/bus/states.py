# SPDX-License-Identifier: Apache-2.0
"""Draws the state machine of docs/howto/can.md from the table the firmware runs on.

python -m fluxtrue_tools.bus.states          write the drawing into the page
python -m fluxtrue_tools.bus.states --check  fail if the page shows another table
"""

import re
import sys
from dataclasses import dataclass
from pathlib import Path

import click

from fluxtrue_tools.cli import run_module
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.outputs import write_text

ROOT = Path(__file__).resolve().parents[3]
TABLE = ROOT / "firmware" / "ecu" / "supervisor_table.c"
PAGE = ROOT / "docs" / "howto" / "can.md"
BEGIN, END = "<!-- states: begin -->\n", "<!-- states: end -->\n"

ROW = re.compile(r"^\s*\{STATE_(\w+), ([^,{}]*), STATE_(\w+)\},$", re.MULTILINE)


@dataclass(frozen=True)
class Transition:
    """A transition: one row of the table."""

    source: str
    conditions: tuple[str, ...]
    target: str


def state_name(raw: str) -> str:
    """The name that the bus uses for the state."""
    return raw.lower()


def read_table(path: Path) -> list[Transition]:
    """All rows, in the order in which they are tried."""
    text = path.read_text(encoding="utf-8")
    rows = [Transition(state_name(source), tuple(part.strip().removeprefix("WHEN_").lower().replace("_", " ")
                                                 for part in when.split("|")), state_name(target))
            for source, when, target in ROW.findall(text)]  # fmt: skip
    if not rows or len(rows) != text.count("{STATE_"):
        raise FluxtrueError(f"{path}: {len(rows)} rows understood of {text.count('{STATE_')}")
    return rows


def draw(rows: list[Transition]) -> str:
    """The drawing in Mermaid; the numbers give the order in which the rows of a state are tested."""
    lines = ["```mermaid", "stateDiagram-v2", f"    [*] --> {rows[0].source}"]
    tried: dict[str, int] = {}
    for row in rows:
        tried[row.source] = tried.get(row.source, 0) + 1
        lines.append(f"    {row.source} --> {row.target}: {tried[row.source]} {' and '.join(row.conditions)}")
    return "\n".join([*lines, "```"]) + "\n"


def with_drawing(page: str, drawing: str) -> str:
    """The text of the page with this drawing between the two marks."""
    if page.count(BEGIN) != 1 or page.count(END) != 1:
        raise FluxtrueError(f"{PAGE}: wanted one '{BEGIN.strip()}' and one '{END.strip()}'")
    head, rest = page.split(BEGIN)
    return head + BEGIN + drawing + END + rest.split(END)[1]


@click.command()
@click.option("--check", is_flag=True, help="Write nothing; fail if the page shows another table.")
def main(check: bool) -> None:
    """Draw the state machine."""
    page = PAGE.read_text(encoding="utf-8")
    wanted = with_drawing(page, draw(read_table(TABLE)))
    if not check:
        write_text(PAGE, wanted)
    elif page != wanted:
        print(f"{PAGE} does not show the table of {TABLE.name}: run python -m fluxtrue_tools.bus.states")
        sys.exit(1)


if __name__ == "__main__":
    run_module(main)
