# SPDX-License-Identifier: Apache-2.0
"""The command line: one group whose commands are imported only when they are used."""

import importlib
import os
import sys
from collections.abc import Callable, Sequence
from typing import NoReturn

import click

from fluxtrue_tools.errors import FluxtrueError, of_system
from fluxtrue_tools.version import in_checkout, version

# Name: (module, command in it, one line for --help). Importing them all would cost a second.
COMMANDS = {
    "demo": ("fluxtrue_tools.demo.cli", "demo", "The paper's experiments and ours, with a report."),
    "campaign": ("fluxtrue_tools.campaign.cli", "campaign", "Many random plants: how true is the torque?"),
    "faults": (
        "fluxtrue_tools.fault_campaign.cli",
        "faults",
        "Inject faults at every operating point, evaluate the reaction.",
    ),
    "sim": ("fluxtrue_tools.sim.cli", "sim", "Run a scenario: plant, firmware, faults."),
    "vecu": ("fluxtrue_tools.vecu.cli", "vecu", "The virtual ECU: a CAN bus to talk to."),
    "emulate": ("fluxtrue_tools.emulate.cli", "emulate", "Run a scenario on the emulated microcontroller."),
    "fuzz": ("fluxtrue_tools.fuzz.cli", "fuzz", "Random and mutated frames through the receive path."),
    "prove": ("fluxtrue_tools.prove.cli", "prove", "Prove properties of the firmware with a model checker."),
    "mutate": ("fluxtrue_tools.mutate.cli", "mutate", "Make small errors in the firmware: do the unit tests notice?"),
    "motor": ("fluxtrue_tools.motor.cli", "motor", "Check machine data, generate its tables."),
    "commission": (
        "fluxtrue_tools.commission.cli",
        "commission",
        "Measure an unknown motor, make its folder (simulated).",
    ),
    "live": ("fluxtrue_tools.live.cli", "live", "Draw the drive live in a browser; command, tune, record."),
    "scope": ("fluxtrue_tools.scope.cli", "scope", "Capture signals of the drive at PWM rate around a trigger."),
    "log": ("fluxtrue_tools.log.cli", "log", "Decode, plot and export a recorded drive."),
    "a2l": ("fluxtrue_tools.a2l.cli", "a2l", "Describe a firmware image to calibration tools."),
    "bench": ("fluxtrue_tools.bench.cli", "bench", "Accuracy and cost of the building blocks."),
    "wcet": ("fluxtrue_tools.wcet.cli", "wcet", "Worst-case execution time of each interrupt handler."),
    "target": ("fluxtrue_tools.target.cli", "target", "Registers and images of microcontrollers."),
}
# Commands that need no other file of the repository: an installed wheel has only these.
STANDALONE = ("motor", "a2l", "target")
# Done by tools/fluxtrue itself, before Python; listed here for --help.
SHELL_COMMANDS = {"test": "Set up, build and test everything: tools/test."}

EXIT_ERROR = 2
EXIT_INTERRUPTED = 130
EXIT_BROKEN_PIPE = 1  # the same message as click's


class LazyGroup(click.Group):
    """A group that has its commands by name and imports one when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        if cmd_name not in STANDALONE and not in_checkout():
            raise FluxtrueError(
                f"command '{cmd_name}' needs the firmware's sources: run tools/fluxtrue in a checkout; "
                f"allowed in the installed package: {', '.join(STANDALONE)}"
            )
        module, name, _ = COMMANDS[cmd_name]
        command = getattr(importlib.import_module(module), name)
        assert isinstance(command, click.Command)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            allowed = ", ".join([*COMMANDS, *SHELL_COMMANDS])
            raise FluxtrueError(f"unknown command '{args[0]}', allowed: {allowed}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        rows = [(name, text) for name, (_, _, text) in COMMANDS.items()]
        with formatter.section("Commands"):
            formatter.write_dl(rows + list(SHELL_COMMANDS.items()))


HELP_OPTIONS = {"help_option_names": ["-h", "--help"]}


def _print_version(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        click.echo(f"fluxtrue {version()}")
        ctx.exit()


@click.command(cls=LazyGroup, name="fluxtrue", context_settings=HELP_OPTIONS)
@click.option("--version", is_flag=True, is_eager=True, expose_value=False, callback=_print_version,
              help="Print the version and exit.")  # fmt: skip
def main() -> None:
    """Fluxtrue: torque control that stays accurate when the machine changes."""


def _usage(error: click.ClickException) -> str:
    text = " ".join(error.format_message().split()).rstrip(".")
    context = getattr(error, "ctx", None)
    return f"{text} (see '{context.command_path} --help')" if context else text


def _broken_pipe() -> int:
    # The reader has closed the pipe: nothing more may be written to this stream, not even at exit.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return EXIT_BROKEN_PIPE


def run(arguments: Sequence[str]) -> int:
    """Run one command and turn its outcome into an exit code."""
    return _outcome(lambda: main.main(args=list(arguments), prog_name="fluxtrue", standalone_mode=False))


def run_module(command: click.Command) -> NoReturn:
    """The same for a command that is a module of its own: python -m fluxtrue_tools.<module>."""
    sys.exit(_outcome(lambda: command.main(standalone_mode=False)))


def _outcome(call: Callable[[], object]) -> int:
    """The exit code of a command, with one line for what a user can correct."""
    try:
        result = call()
        sys.stdout.flush()
        return result if isinstance(result, int) else 0
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return EXIT_ERROR
    except click.ClickException as error:
        click.echo(f"error: {_usage(error)}", err=True)
        return EXIT_ERROR
    except FluxtrueError as error:
        click.echo(f"error: {error}", err=True)
        return EXIT_ERROR
    except (click.Abort, KeyboardInterrupt):
        return EXIT_INTERRUPTED
    except BrokenPipeError:
        return _broken_pipe()
    except OSError as error:  # the system's word on a path that no command has foreseen
        if error.filename is None:
            raise
        click.echo(f"error: {of_system(error)}", err=True)
        return EXIT_ERROR
