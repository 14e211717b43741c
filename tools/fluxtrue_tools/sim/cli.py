# SPDX-License-Identifier: Apache-2.0
"""fluxtrue sim: run a scenario."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fluxtrue_tools import paths

if TYPE_CHECKING:
    from fluxtrue_tools.sim.motor import Motor
    from fluxtrue_tools.sim.scenario import Scenario

EXIT_TRIPPED = 1


@click.command(cls=paths.Command)
@click.argument("scenario", type=paths.InputFile())
@click.option("--out", type=paths.OutputFile(), help="Every recorded quantity over time, CSV.")
@click.option("--json", "json_path", type=paths.OutputFile(), help="Means over the window and errors, JSON.")
@click.option(
    "--plot", type=paths.OutputFile(*paths.PICTURES), help="Torque, currents, flux, resistance: PNG, SVG or PDF."
)
@click.option("--motor", help="Instead of the scenario's: a shipped name or a folder.")
@click.option("--build-dir", type=paths.InputFolder(), help="Take the libraries from this build folder as they are.")
def sim(
    scenario: Path,
    out: Path | None,
    json_path: Path | None,
    plot: Path | None,
    motor: str | None,
    build_dir: Path | None,
) -> int:
    """Run a SCENARIO (TOML): the simulated drive with the firmware, or with its twin."""
    from fluxtrue_tools.sim import build
    from fluxtrue_tools.sim import motor as motors
    from fluxtrue_tools.sim import scenario as scenarios

    read = scenarios.read(scenario)
    named, base = (motor, Path.cwd()) if motor is not None else (read.motor, scenario.parent)
    where = "--motor" if motor is not None else f"{scenario}: motor"
    paths.outputs().reads(*build.sources(named, base, where))
    built = motors.load(named, build_dir, base, where)
    return run_and_report(read, built, scenario, out, json_path, plot, read.controller.kind)


def run_and_report(
    read: "Scenario",
    built: "Motor",
    scenario: Path,
    out: Path | None,
    json_path: Path | None,
    plot: Path | None,
    controller: str,
) -> int:
    """Run it with a progress bar, write the files asked for, print the table."""
    from fluxtrue_tools.sim import output
    from fluxtrue_tools.sim.run import simulate

    with paths.outputs() as files:
        files.reads(built.folder.library, built.folder.data)
        with click.progressbar(
            length=max(1, round(1e3 * read.duration_s)),
            label=scenario.stem,
            file=sys.stderr,
            hidden=not sys.stderr.isatty(),
        ) as bar:
            run = simulate(read, built, where=str(scenario), progress=lambda s: bar.update(round(1e3 * s)))
        data = output.summary(run) | {"controller": controller}
        if out is not None:
            files.text(out, output.csv_text(run))
        if json_path is not None:
            files.text(json_path, output.json_text(data))
        if plot is not None:
            from fluxtrue_tools.sim import plot as plots

            plots.write(run, f"{scenario.stem}: {built.name}, {controller}", files.scratch(plot))
    click.echo(table(data))
    complaint = run.unexpected()
    if complaint is None:
        return 0
    click.echo(f"error: {scenario}: {complaint}", err=True)
    return EXIT_TRIPPED


def _faults(data: dict[str, Any]) -> str:
    told = ", then ".join(f"{', '.join(one['names'])} at {one['t']:g} s" for one in data["faults"]) or "none"
    return f"{told} ({data['motor_check']})" if data["motor_check"] else told


def _line(label: str, values: list[tuple[Any, str]]) -> str:
    shown = [f"{v:.5g} {unit}" for v, unit in values if v is not None]
    return f"{label:<22}{'   '.join(shown) or '-'}"


def table(data: dict[str, Any]) -> str:
    """Summary of the results."""
    mean, window = data["mean"], data["window"]
    reverses = window["request_reverses"]
    return "\n".join(
        [
            f"{data['motor']}, {data['controller']}: {data['duration_s']:g} s simulated, "
            f"{data['realtime_factor']:.3g} times real time",
            f"means from {window['from_s']:g} to {window['to_s']:g} s"
            + (", in which the requested torque reverses: % of its mean; choose a [window]" if reverses else ""),
            _line("  torque requested", [(mean["torque_requested_Nm"], "N·m")]),
            _line(
                "  shaft torque",
                [(mean["true_torque_Nm"], "N·m"), (data["torque_error_percent"], "% of requested")],
            ),
            _line(
                "  torque estimated",
                [(mean["torque_estimated_Nm"], "N·m"), (data["estimate_error_percent"], "% off")],
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
            f"{'  faults':<22}{_faults(data)}",
        ]
    )
