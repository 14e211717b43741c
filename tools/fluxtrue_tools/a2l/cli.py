# SPDX-License-Identifier: Apache-2.0
"""`tools/fluxtrue a2l`: the description file for calibration tools."""

import tempfile
from pathlib import Path

import click
import jinja2

from fluxtrue_tools.a2l.elf import Description, read

# firmware/app/xcp_access.h; a test holds the two together.
COMMAND_ID = 0x650
ANSWER_ID = 0x651
ASAP2_TYPES = {"S16": "SWORD", "U32": "ULONG", "F32": "FLOAT32_IEEE", "U8": "UBYTE", "U16": "UWORD"}
FLOAT_SIZE = 4


def render(description: Description, source: str) -> str:
    """The description file's text."""
    loader = jinja2.FileSystemLoader(Path(__file__).parent)
    environment = jinja2.Environment(loader=loader, trim_blocks=True, lstrip_blocks=True,
                                     keep_trailing_newline=True,
                                     undefined=jinja2.StrictUndefined)  # fmt: skip
    addresses = [value.address for value in description.values]
    segment = {"address": min(addresses), "size": FLOAT_SIZE * len(addresses)}
    return environment.get_template("fluxtrue.a2l.j2").render(
        name=description.machine, source=source, segment=segment, types=ASAP2_TYPES,
        command_id=COMMAND_ID, answer_id=ANSWER_ID, bases=description.bases,
        values=description.values, measurements=description.measurements, frozen=description.frozen)  # fmt: skip


def write(text: str, path: Path) -> None:
    """All of the file or nothing of it."""
    with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".a2l", delete=False) as stream:
        stream.write(text)
    Path(stream.name).chmod(0o644)
    Path(stream.name).replace(path)


@click.command()
@click.argument("elf", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), default=Path("fluxtrue.a2l"),
              show_default=True, help="File to write.")  # fmt: skip
def a2l(elf: Path, out: Path) -> None:
    """Describe the values of the firmware in ELF to calibration tools (ASAP2)."""
    description = read(elf)
    if not out.parent.is_dir():
        raise click.ClickException(f"--out {out}: {out.parent} is not a folder")
    write(render(description, elf.name), out)
    click.echo(f"{out}: {len(description.values)} values, {len(description.measurements)} measurements")
