# SPDX-License-Identifier: Apache-2.0
"""``fluxtrue target``."""

from __future__ import annotations

from pathlib import Path

import click

from fluxtrue_tools import paths
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.foreign import reading

ELF = paths.InputFile()


@click.group()
def target() -> None:
    """Register headers and images of microcontroller ports."""


@target.command(cls=paths.Command)
@click.argument("svd", type=paths.InputFile())
@click.option("--list", "wanted", type=paths.InputFile(), required=True, help="The registers the port uses (TOML).")
@click.option("--header", "header_path", type=paths.OutputFile(), required=True, help="C header to write.")
def registers(svd: Path, wanted: Path, header_path: Path) -> None:
    """Write the header with the registers a port uses, from the maker's SVD file."""
    from fluxtrue_tools.target import registers as generator
    from fluxtrue_tools.target.svd import Device

    with paths.outputs() as outputs:
        device = Device(svd)
        names = generator.load(wanted)
        with reading(svd, "an SVD file"):  # its numbers and names are read where they are needed
            chosen = generator.choose(names, device, wanted)
            text = generator.header(names, device, chosen, wanted)
        outputs.text(header_path, text)


@target.command(cls=paths.Command)
@click.argument("elf", type=paths.StateFile())
def seal(elf: Path) -> None:
    """Write the CRC-32 of the protected data into a linked image, in place."""
    from fluxtrue_tools.target import image

    click.echo(image.seal(elf))


@target.command(cls=paths.Command)
@click.argument("elf", type=ELF)
@click.option("--budget", type=paths.InputFile(), required=True, help="The port's limits (budget.toml).")
def size(elf: Path, budget: Path) -> None:
    """Print what the image occupies; fails beyond the bounds."""
    from fluxtrue_tools.target import budget as budgets
    from fluxtrue_tools.target import image

    bounds = budgets.read(budget)
    most = image.Size(bounds.flash_bytes, bounds.ram_bytes, bounds.ram_code_bytes)
    click.echo(image.size(elf, most))


@target.command(cls=paths.Command)
@click.argument("motor", type=paths.InputFile())
@click.option("--budget", type=paths.InputFile(), required=True, help="The port's limits (budget.toml).")
@click.option(
    "--angle", default="encoder", show_default=True, help="The image's angle sensor, as docs/performance.json names it."
)
def fits(motor: Path, budget: Path, angle: str) -> None:
    """Refuse a machine (motor.json of a build) whose PWM the port cannot carry; print how busy it makes the port."""
    from fluxtrue_tools.target import fits as limits

    click.echo(limits.check(motor, budget, angle=angle))


@target.command(cls=paths.Command)
@click.argument("file", type=paths.InputFile())
def version(file: Path) -> None:
    """Print the version of an image: an ELF file, a .bin or a dump of the flash."""
    from fluxtrue_tools.target import image

    click.echo(image.version(file).text)


@target.command(cls=paths.Command)
@click.option(
    "--out", type=paths.OutputFile(".json"), required=True, help="File to write, for example fluxtrue.spdx.json."
)
def sbom(out: Path) -> None:
    """Write the software bill of materials (SPDX 2.3); its time is SOURCE_DATE_EPOCH if that is set."""
    import json
    import os
    import time

    from fluxtrue_tools.target import sbom as bill
    from fluxtrue_tools.version import HEADER, in_checkout

    given = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not in_checkout():
        raise FluxtrueError("sbom needs the firmware's sources: run tools/fluxtrue in a checkout")
    if given and not given.isdecimal():
        raise FluxtrueError(f"SOURCE_DATE_EPOCH = {given!r}, allowed: whole seconds since 1970")
    with paths.outputs() as outputs:
        document = bill.document(HEADER.parents[2], int(given or time.time()))
        outputs.text(out, json.dumps(document, indent=1) + "\n")
