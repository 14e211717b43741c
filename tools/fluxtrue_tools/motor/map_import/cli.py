# SPDX-License-Identifier: Apache-2.0
"""fluxtrue motor import."""

from pathlib import Path

import click

from fluxtrue_tools import kinds, paths

FORMATS = ("csv", "arrays", "syre", "motulator", "pyleecan")
IMPORTED = ("motor.toml", "flux_map.csv", "import.txt", "import.png")
_FILE = paths.InputFile()
NODES = click.IntRange(8, 200)


@click.command("import", cls=paths.Command)
@click.argument("file", type=_FILE)
@click.option("--format", "kind", required=True, type=click.Choice(FORMATS), help="What wrote FILE.")
@click.option("--out", required=True, type=paths.OutputFolder(*IMPORTED), metavar="DIR", help="The motor's folder.")
@click.option("--motor", type=_FILE, metavar="TOML", help="A motor.toml with the values that FILE does not have.")
@click.option("--set", "given", multiple=True, metavar="KEY=VALUE", help="A value of motor.toml.")
@click.option("--column", "columns", multiple=True, metavar="NAME=HEADER", help="Where FILE has i_d, i_q, i_s, gamma, "
              "psi_d, psi_q, torque.")  # fmt: skip
@click.option("--rows", type=click.Choice(["i_d", "i_q", "i_s", "gamma"]), help="The current that changes from row to "
              "row of square matrices.")  # fmt: skip
@click.option(
    "--current", type=click.Choice(["peak", "rms", "power"]), help="Currents of FILE; power: power-invariant."
)
@click.option("--flux", type=click.Choice(["peak", "rms", "power"]), help="Flux linkages of FILE.")
@click.option("--flux-unit", type=click.Choice(["Vs", "mVs"]), help="Their unit, Vs = Wb.")
@click.option("--convention", "counting", type=click.Choice(["motor", "generator"]), help="Currents into or out of the "
              "machine.")  # fmt: skip
@click.option("--axes", type=click.Choice(["pm", "synrm"]), help="d along the magnet, or along the larger inductance.")
@click.option("--angle-from", type=click.Choice(["d", "q"]), help="The axis where gamma is 0.")
@click.option("--angle-unit", type=click.Choice(["deg", "rad"]), help="Unit of gamma.")
@click.option("--nodes", type=NODES, default=31, show_default=True, help="Nodes of the map along each axis.")
@click.option("--iron-loss", type=_FILE, metavar="CSV", help="Iron losses, to fit k_h and k_e.")
@click.option("--iron-loss-column", "iron_loss_columns", multiple=True, metavar="NAME=HEADER", help="Where the losses "
              "have i_d, i_q, i_s, gamma, speed, frequency, loss.")  # fmt: skip
@click.option("--iron-loss-point", "iron_loss_points", type=kinds.LossPoint(), multiple=True, metavar="W@RPM",
              help="Instead: a loss without current.")  # fmt: skip
def import_(
    file: Path, kind: str, out: Path, motor: Path | None, given: tuple[str, ...], columns: tuple[str, ...],
    rows: str | None, nodes: int, iron_loss: Path | None, iron_loss_columns: tuple[str, ...],
    iron_loss_points: tuple[tuple[float, float], ...], **convention: str | None,
) -> None:  # fmt: skip
    """Make a motor folder from the flux map in FILE."""
    from fluxtrue_tools.motor import doubts
    from fluxtrue_tools.motor.map_import import plot, report
    from fluxtrue_tools.motor.map_import.run import Request, run

    if iron_loss is None:
        paths.refuse_given("without --iron-loss", "iron_loss_columns")
    else:
        paths.refuse_given("with --iron-loss", "iron_loss_points")
    if kind != "arrays":
        paths.refuse_given(f"with --format {kind}", "rows")
    if kind not in ("csv", "arrays"):
        paths.refuse_given(f"with --format {kind}, which knows its arrays", "columns")
    chosen = {name: value for name, value in convention.items() if value is not None}
    request = Request(file, kind, columns, chosen, given, motor, nodes, rows, iron_loss,
                      iron_loss_columns, iron_loss_points)  # fmt: skip
    with paths.outputs() as outputs:
        staging = outputs.scratch(out)
        done, resolved = run(request, staging, out)
        text = report.text(done)
        (staging / "import.txt").write_text(text, encoding="utf-8")
        plot.write(done, staging / "import.png")
    for warning in (*report.warnings(done), *doubts.of_motor(resolved)):
        click.echo(f"warning: {warning}", err=True)
    click.echo(text, nl=False)
    click.echo(f"motor {resolved.config.machine.name}: written to {out}")
