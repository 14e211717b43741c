# SPDX-License-Identifier: Apache-2.0
"""fluxtrue sim: run a scenario."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fluxtrue_tools.errors import FluxtrueError

if TYPE_CHECKING:
    from fluxtrue_tools.sim.motor import Motor
    from fluxtrue_tools.sim.scenario import Scenario

_FILE = click.Path(dir_okay=False, path_type=Path)
PLOTS = (".png", ".svg", ".pdf")


@click.command()
@click.argument("scenario", type=_FILE)
@click.option("--out", type=_FILE, help="Every recorded quantity over time, CSV.")
@click.option("--json", "json_path", type=_FILE, help="Means over the window and errors, JSON.")
@click.option("--plot", type=_FILE, help="Torque, currents, flux, resistance: PNG, SVG or PDF.")
@click.option("--motor", help="Instead of the scenario's: a shipped name or a folder.")
@click.option(
    "--build-dir",
    type=click.Path(file_okay=False, path_type=Path),
    help="Take the libraries from this build folder as they are.",
)
def sim(
    scenario: Path,
    out: Path | None,
    json_path: Path | None,
    plot: Path | None,
    motor: str | None,
    build_dir: Path | None,
) -> None:
    """Run a SCENARIO (TOML): the simulated drive with the firmware, or with its twin."""
    from fluxtrue_tools.sim import motor as motors
    from fluxtrue_tools.sim import scenario as scenarios

    check_outputs(out, json_path, plot)
    read = scenarios.read(scenario)
    base = Path.cwd() if motor else scenario.parent
    built = motors.load(motor or read.motor, build_dir, base)
    run_and_report(read, built, scenario, out, json_path, plot, read.controller.kind)


def check_outputs(out: Path | None, json_path: Path | None, plot: Path | None) -> None:
    """Complain before a long run, not after it."""
    from fluxtrue_tools.sim import output

    if plot is not None and plot.suffix.lower() not in PLOTS:
        raise FluxtrueError(f"--plot {plot}: allowed: a file ending in {', '.join(PLOTS)}")
    output.check_writable(out, json_path, plot)


def run_and_report(
    read: "Scenario",
    built: "Motor",
    scenario: Path,
    out: Path | None,
    json_path: Path | None,
    plot: Path | None,
    controller: str,
) -> None:
    """Run it with a progress bar, write the files asked for, print the table."""
    from fluxtrue_tools.sim import output
    from fluxtrue_tools.sim.run import simulate

    with click.progressbar(
        length=max(1, round(1e3 * read.duration_s)),
        label=scenario.stem,
        file=sys.stderr,
        hidden=not sys.stderr.isatty(),
    ) as bar:
        run = simulate(
            read, built, where=str(scenario), progress=lambda s: bar.update(round(1e3 * s))
        )
    data = output.summary(run) | {"controller": controller}
    if out is not None:
        output.write_text(out, output.csv_text(run))
    if json_path is not None:
        output.write_text(json_path, output.json_text(data))
    if plot is not None:
        from fluxtrue_tools.sim import plot as plots

        plots.write(run, f"{scenario.stem}: {built.name}, {controller}", plot)
    click.echo(table(data))


def _line(label: str, values: list[tuple[Any, str]]) -> str:
    shown = [f"{v:.5g} {unit}" for v, unit in values if v is not None]
    return f"{label:<22}{'   '.join(shown) or '-'}"


def table(data: dict[str, Any]) -> str:
    """What a reader wants to know first."""
    mean, window = data["mean"], data["window"]
    return "\n".join(
        [
            f"{data['motor']}, {data['controller']}: {data['duration_s']:g} s simulated, "
            f"{data['realtime_factor']:.3g} times real time",
            f"means from {window['from_s']:g} to {window['to_s']:g} s",
            _line("  torque command", [(mean["torque_command_Nm"], "N·m")]),
            _line(
                "  shaft torque",
                [(mean["true_torque_Nm"], "N·m"), (data["torque_error_percent"], "% of command")],
            ),
            _line(
                "  torque estimate",
                [(mean["torque_estimate_Nm"], "N·m"), (data["estimate_error_percent"], "% off")],
            ),
            _line("  speed", [(mean["true_speed_rpm"], "rpm")]),
            _line(
                "  magnet flux",
                [(1e3 * mean["psi_f_Vs"], "mV·s"), (data["psi_error_percent"], "% off")],
            ),
            _line(
                "  resistance",
                [(1e3 * mean["r_ohm"], "mΩ"), (data["r_error_percent"], "% off")],
            ),
            _line("  faults", [(data["fault_word"], "(bits)")]),
        ]
    )
