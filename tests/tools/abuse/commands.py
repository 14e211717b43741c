# SPDX-License-Identifier: Apache-2.0
"""A valid call of every command, and the wrong values that each of its parameters can get.

Which commands and parameters there are comes from the command line itself. The wrong values of a number, a choice or a
path follow from its kind; those of a text stand in WRONG_TEXTS.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache

import click
from abused import MAP, MOTOR, Content
from port_samples import SVD
from samples import CAMPAIGN, FAULTS, FMEA, LIST, PORT, SCENARIO, elf, image, motor_json, recording

from fluxtrue_tools import cli, paths

MACHINE: dict[str, Content] = {"m/motor.toml": MOTOR, "m/flux_map.csv": MAP}
IMPORT_OPTIONS = ("--format", "csv", "--motor", "m/motor.toml", "--out", "o")


@dataclass(frozen=True)
class Case:
    """A valid call: what it is given, which files it finds, and what it needs beside some of its options."""

    places: tuple[str, ...] = ()  # values of the arguments without a name
    options: tuple[str, ...] = ()
    files: dict[str, Content] = field(default_factory=dict)
    outputs: tuple[str, ...] = ()  # files that this call writes
    beside: dict[str, tuple[str, ...]] = field(default_factory=dict)  # option: further ones that it needs


BENCH = ("--can-interface", "virtual")
ON_A_BENCH = {"--can-channel": BENCH, "--can-option": BENCH, "--bench": BENCH}


@cache
def cases() -> dict[str, Case]:
    """The cases by the name of the command."""
    motor = ("--motor", "m")
    return {
        "demo": Case(options=("--out", "o")),
        "campaign": Case(("in.toml",), ("--out", "o"), {"in.toml": CAMPAIGN}),
        "faults": Case(("in.toml",), (), {"in.toml": FAULTS, "fmea.csv": FMEA}, beside={"--run": ("--line", "open")}),
        "sim": Case(("in.toml",), ("--out", "o.csv", "--json", "o.json"), {"in.toml": SCENARIO}, ("o.csv", "o.json")),
        "vecu": Case((), motor, MACHINE),
        "emulate": Case((), ("--scenario", "in.toml", "--elf", "image.elf"),
                        {"in.toml": SCENARIO, "image.elf": image()},
                        beside={"--port": ("--serve",), "--bench-port": ("--serve",)}),
        "fuzz": Case(),
        "prove": Case(("arbitration_rate",)),
        "mutate": Case(("firmware/safety/monitor.c",), (), {},
                       beside={"--base": ("--changed",), "--seed": ("--sample=1",)}),
        "motor check": Case(("m",), (), MACHINE),
        "motor build": Case(("m",), ("--out", "o", "--no-report"), MACHINE, ("o/motor_tables.c", "o/motor.json")),
        "motor import": Case(("map.csv",), IMPORT_OPTIONS, {"m/motor.toml": MOTOR, "map.csv": MAP},
                             ("o/motor.toml", "o/flux_map.csv", "o/import.txt"),
                             {"--iron-loss-column": ("--iron-loss", "map.csv"), "--rows": ("--format", "arrays")}),
        "motor start": Case((), ("--out", "o", "--i-max", "200", "--vdc", "350", "--pwm", "10", "--pole-pairs", "4"),
                            {}, ("o/motor.toml",)),
        "commission": Case((), (*motor, "--out", "o"), MACHINE, beside=ON_A_BENCH | {"--elf": BENCH}),
        "live": Case((), motor, MACHINE, beside=ON_A_BENCH | {
            "--elf": BENCH, "--machine": ("--commission",), "--seed": ("--commission",)}),
        "scope": Case((), (), {"image.elf": elf()},
                      beside=ON_A_BENCH | {"--on": ("--trigger", "above"), "--level": ("--trigger", "above")}),
        "log": Case(("drive.mf4",), ("--export", "o.csv"), {"drive.mf4": recording()}, ("o.csv",)),
        "a2l": Case(("image.elf",), ("--out", "o.a2l"), {"image.elf": elf()}, ("o.a2l",)),
        "bench": Case(options=("--json", "o.json")),
        "wcet": Case((), ("--elf", "image.elf"), {"image.elf": image()}),
        "target registers": Case(("chip.svd",), ("--list", "list.toml", "--header", "o.h"),
                                 {"chip.svd": SVD, "list.toml": LIST}, ("o.h",)),
        "target seal": Case(("image.elf",), (), {"image.elf": image()}, ("image.elf",)),
        "target size": Case(("image.elf",), ("--budget", "port/budget.toml"),
                            {"image.elf": image(), "port/budget.toml": PORT}),
        "target fits": Case(("motor.json",), ("--budget", "port/budget.toml"),
                            {"motor.json": motor_json(), "port/budget.toml": PORT}),
        "target version": Case(("image.elf",), (), {"image.elf": elf()}),
        "target sbom": Case((), ("--out", "o.json"), {}, ("o.json",)),
    }  # fmt: skip


NO_MOTOR = ("", "nosuch", "loop", "in.toml", "a;b", "~nosuch/x", "m\nx", "a" * 300, "/dev/null")
NO_OPTION = ("", "x", "=1", "=")
NO_ADDRESS = ("", "x", "host:", ":1", "host:x", "host:-1", "host:99999", "host:1:")
NO_SIGNAL = ("", "x", "*")
# Command and option, or the option of all commands: texts that it cannot take.
WRONG_TEXTS: dict[str, tuple[str, ...]] = {
    "--mode": ("",), "--path": ("",),
    "--motor": NO_MOTOR, "--can-interface": ("", "nonsense"), "--can-channel": ("",), "--can-option": NO_OPTION,
    "--bench": NO_ADDRESS, "--signal": NO_SIGNAL, "--on": NO_SIGNAL, "--step": ("", "x", "map,", "map map"),
    "--machine": ("", "x", "../hsm1", "hsm1\n"), "--column": (*NO_OPTION, "i_d=", "nosuch=id_A", "i_d=nosuch"),
    "--set": (*NO_OPTION, "nothing=1", "machine.nothing=1", "machine.r_ohm=nan", "machine.r_ohm=x", "machine.r_ohm=",
              "machine.r_ohm=-1", "machine.r_ohm"), "--iron-loss-column": (*NO_OPTION, "loss=nosuch"),
    "--iron-loss-point": ("", "x", "1@x", "@3000", "nan@3000", "1@inf", "-1@3000", "1@-1", "1@1@1"),
    "--line": ("", "nosuch"), "--run": ("", "x", "paper/9/+"), "--lines": ("", "nosuch*"), "--group": ("", "nosuch"),
    "prove names": ("", "nosuch"), "mutate names": ("", "nosuch"),
    "--angle": ("", "quadrature"), "--base": ("", "nosuch"),
    "--scheduler": ("", "x", "tcp://", "tcp://host", "tcp://host:x", "tcp://h:99999"),
}  # fmt: skip

NO_NUMBER = ("", "x", "nan", "inf", "-inf", "1,5", "0x10", "1e999", "١x")
NO_FILE = ("", "missing", "folder", "loop", "file/x", "a" * 300, "/dev/null", "~nosuch/x")
NO_PLACE = ("", "-", "loop", "file/x", "a" * 300, "/proc/x", "/dev/null/x")


def leaves(command: click.Command = cli.main, name: tuple[str, ...] = ()) -> Iterator[tuple[str, click.Command]]:
    """Every command that can be called, with its name as on the command line."""
    if not isinstance(command, click.Group):
        yield " ".join(name), command
        return
    context = click.Context(command)
    for part in command.list_commands(context):
        below = command.get_command(context, part)
        assert below is not None
        yield from leaves(below, (*name, part))


COMMANDS = dict(leaves())


def spelled(param: click.Parameter) -> str:
    """The option as it is given, or the name of an argument."""
    return max(param.opts, key=len) if isinstance(param, click.Option) else str(param.name)


def _wrong_numbers(kind: click.ParamType) -> tuple[str, ...]:
    ends: list[str] = []
    if isinstance(kind, click.IntRange | click.FloatRange):
        step = 1 if isinstance(kind, click.IntRange) else 1e-3
        ends += [str(kind.min - step)] if kind.min is not None else []
        ends += [str(kind.max + step)] if kind.max is not None else []
    whole = ("1.5", "1e3") if isinstance(kind, click.types.IntParamType) else ()
    return (*NO_NUMBER, *whole, *ends)


def _wrong_outputs(kind: paths.OutputFile, files: dict[str, Content]) -> tuple[str, ...]:
    suffix = kind.suffixes[0] if kind.suffixes else ""
    taken = [name for name in files if not kind.suffixes or name.endswith(kind.suffixes)]
    wrong = ("folder", "/dev/null", f"missing/x{suffix}", f"{'a' * 300}{suffix}", f"/proc/x{suffix}", *NO_PLACE)
    return (*wrong, *taken, *(("o.xyz", "o") if suffix else ()))


def wrong_values(name: str, param: click.Parameter) -> tuple[str, ...]:
    """Values that must be refused before anything else is done."""
    kind, files = param.type, cases()[name].files
    if isinstance(kind, paths.InputFile):
        return NO_FILE
    if isinstance(kind, paths.OutputFile):
        return _wrong_outputs(kind, files)
    if isinstance(kind, paths.OutputFolder | paths.BuildFolder):
        return (*NO_PLACE, "/dev/null", *files)
    if isinstance(kind, paths.StateFile):
        return ("folder", "/dev/null", "missing/x", *NO_PLACE)
    if isinstance(kind, paths.InputFolder):
        return (*NO_FILE, *files)
    if isinstance(kind, click.Choice):
        return ("", "x", str(kind.choices[0]).upper() + "_")
    if isinstance(kind, click.types.IntParamType | click.types.FloatParamType):
        return _wrong_numbers(kind)
    if isinstance(kind, click.types.BoolParamType):
        return ()
    key = spelled(param) if isinstance(param, click.Option) else f"{name} {param.name}"
    return WRONG_TEXTS.get(key, ())


def call(name: str, param: click.Parameter | None = None, value: str = "") -> list[str]:
    """The command line of the valid call, with this value of one parameter."""
    case, command = cases()[name], COMMANDS[name]
    places = dict(zip((p.name for p in command.params if isinstance(p, click.Argument)), case.places, strict=True))
    added: list[str] = []
    if isinstance(param, click.Argument):
        places[param.name] = value
    elif param is not None:
        added = [*case.beside.get(spelled(param), ()), f"{spelled(param)}={value}"]
    return [*name.split(), *case.options, *added, "--", *places.values()]
