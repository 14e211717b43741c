# SPDX-License-Identifier: Apache-2.0
"""`tools/fluxtrue a2l`: the description file for calibration tools."""

from pathlib import Path

import click
import jinja2

from fluxtrue_tools import paths
from fluxtrue_tools.a2l.elf import Description, Word, read

# firmware/calibration/xcp_access.h; a test holds the two together.
COMMAND_ID = 0x650
ANSWER_ID = 0x651
MS, TEN_US = 6, 4  # XCP's codes of time units
ASAP2_TYPES = {"S16": "SWORD", "U32": "ULONG", "F32": "FLOAT32_IEEE", "U8": "UBYTE", "U16": "UWORD"}
FLOAT_SIZE = 4


def _cycle(step_s: float) -> str:
    """Cycle and unit of the raster of each step: 1 ms for a step of 1 ms, otherwise in units of 10 us."""
    ten_us = round(step_s * 1e5)
    return f"1 {MS}" if ten_us == 100 else f"{ten_us} {TEN_US}"


def render(description: Description, source: str) -> str:
    """The description file's text."""
    loader = jinja2.FileSystemLoader(Path(__file__).parent)
    environment = jinja2.Environment(loader=loader, trim_blocks=True, lstrip_blocks=True,
                                     keep_trailing_newline=True,
                                     undefined=jinja2.StrictUndefined)  # fmt: skip
    addresses = [value.address for value in description.values]
    segment = {"address": min(addresses), "size": FLOAT_SIZE * len(addresses)}
    tables: dict[str, list[Word]] = {}
    bits: dict[str, list[Word]] = {}
    for word in description.words:
        (bits if word.is_bit else tables).setdefault(word.base, []).append(word)
    conversions = {base.name: f"per_unit_{base.name}" for base in description.bases}
    conversions |= {name: f"words_{name}" for name in tables}
    return environment.get_template("fluxtrue.a2l.j2").render(
        name=description.machine, source=source, segment=segment, types=ASAP2_TYPES,
        cycle=_cycle(description.step_s), command_id=COMMAND_ID, answer_id=ANSWER_ID, bases=description.bases,
        values=description.values, measurements=description.measurements, frozen=description.frozen,
        conversions=conversions, tables=tables, bits=bits)  # fmt: skip


@click.command(cls=paths.Command)
@click.argument("elf", type=paths.InputFile())
@click.option("--out", type=paths.OutputFile(), default=Path("fluxtrue.a2l"), show_default=True, help="File to write.")
def a2l(elf: Path, out: Path) -> None:
    """Describe the values of the firmware in ELF to calibration tools (ASAP2)."""
    with paths.outputs() as outputs:
        description = read(elf)
        outputs.text(out, render(description, elf.name))
    click.echo(f"{out}: {len(description.values)} values, {len(description.measurements)} measurements")
