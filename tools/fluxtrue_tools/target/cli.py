# SPDX-License-Identifier: Apache-2.0
"""``fluxtrue target``."""

from __future__ import annotations

from pathlib import Path

import click

PATH = click.Path(path_type=Path, dir_okay=False)


@click.group()
def target() -> None:
    """Register headers and images of microcontroller ports."""


@target.command()
@click.argument("svd", type=PATH)
@click.option("--list", "wanted", type=PATH, required=True, help="The registers the port uses (TOML).")
@click.option("--header", "header_path", type=PATH, required=True, help="C header to write.")
def registers(svd: Path, wanted: Path, header_path: Path) -> None:
    """Write the header with the registers a port uses, from the maker's SVD file."""
    from fluxtrue_tools.target import registers as generator
    from fluxtrue_tools.target.svd import Device

    device = Device(svd)
    names = generator.load(wanted)
    chosen = generator.choose(names, device, wanted)
    header_path.write_text(generator.header(names, device, chosen, wanted), encoding="utf-8")


@target.command()
@click.argument("elf", type=PATH)
def seal(elf: Path) -> None:
    """Write the CRC-32 of the protected data into a linked image, in place."""
    from fluxtrue_tools.target import image

    click.echo(image.seal(elf))


@target.command()
@click.argument("elf", type=PATH)
@click.option("--flash", type=int, required=True, help="Most bytes of flash.")
@click.option("--ram", type=int, required=True, help="Most bytes of RAM, stack included.")
def size(elf: Path, flash: int, ram: int) -> None:
    """Print what the image occupies; fails beyond the bounds."""
    from fluxtrue_tools.target import image

    click.echo(image.size(elf, flash, ram))
