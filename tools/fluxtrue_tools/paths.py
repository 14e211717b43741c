# SPDX-License-Identifier: Apache-2.0
"""The kinds of path a command line takes, and the command that checks them all before it begins.

No command uses click's own Path: an input declared here is protected from every output of the same command.
"""

import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.kinds import label
from fluxtrue_tools.outputs import Outputs

_KEY = "fluxtrue.outputs"
PICTURES = (".png", ".svg", ".pdf")


class GivenPath(click.ParamType):
    """Any path; refuses text that is not a name."""

    name = "path"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Text to a path."""
        text = os.fspath(value)
        if not text:
            raise FluxtrueError(f"{label(param)} '': empty, allowed: the name of a {self.name}")
        if "\0" in text:
            raise FluxtrueError(f"{label(param)} {text!r}: allowed: a name without NUL")
        return Path(text)


class _Existing(GivenPath):
    """What is only read, and must be there before the command begins."""

    is_kind: Callable[[int], bool]

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Text to a path that can be read."""
        path = super().convert(value, param, ctx)
        try:
            status = path.stat()
        except OSError as error:
            raise FluxtrueError(f"{path}: cannot be read ({error.strerror})") from None
        if not type(self).is_kind(status.st_mode):
            raise FluxtrueError(f"{path}: cannot be read (not a {self.name})")
        if not os.access(path, os.R_OK):
            raise FluxtrueError(f"{path}: cannot be read (Permission denied)")
        return path


class InputFile(_Existing):
    """An existing file that is only read."""

    name = "file"
    is_kind = stat.S_ISREG


class InputFolder(_Existing):
    """An existing folder that is only read; the command itself checks its content."""

    name = "folder"
    is_kind = stat.S_ISDIR


class OutputFile(GivenPath):
    """A file to write, with the endings it may have."""

    name = "file"

    def __init__(self, *suffixes: str) -> None:
        self.suffixes = suffixes


class OutputFolder(GivenPath):
    """A folder to write files of these names to."""

    name = "folder"

    def __init__(self, *names: str) -> None:
        self.names = names


class BuildFolder(GivenPath):
    """A folder for intermediate results, kept for the next call."""

    name = "folder"


class StateFile(GivenPath):
    """A file that is read when it is there and written when the command ends."""

    name = "file"


def refuse_given(why: str, *names: str) -> None:
    """Refuse an option that the running command would ignore."""
    context = click.get_current_context()
    for option in context.command.params:
        given = context.get_parameter_source(str(option.name)) is ParameterSource.COMMANDLINE
        if given and option.name in names:
            raise FluxtrueError(f"{'/'.join([*option.opts, *option.secondary_opts])}: has no effect {why}")


class Command(click.Command):
    """Declares every path among its parameters before its body runs."""

    def invoke(self, ctx: click.Context) -> Any:
        """Check, then run."""
        ctx.meta[_KEY] = declared(ctx)
        return super().invoke(ctx)


def _values(ctx: click.Context) -> list[tuple[click.Parameter, Path]]:
    pairs = [(param, ctx.params.get(str(param.name))) for param in ctx.command.params]
    return [(param, value) for param, value in pairs if isinstance(value, Path)]


def declared(ctx: click.Context) -> Outputs:
    """The outputs among the parameters of a call, with its inputs protected."""
    outputs = Outputs()
    for param, path in _values(ctx):
        if isinstance(param.type, InputFile | InputFolder):
            outputs.reads(path)
    for param, path in _values(ctx):
        if isinstance(param.type, OutputFolder):
            outputs.folder(label(param), path, param.type.names)
        elif isinstance(param.type, BuildFolder):
            outputs.folder(label(param), path)
    for param, path in _values(ctx):
        if isinstance(param.type, OutputFile):
            outputs.file(label(param), path, param.type.suffixes)
        elif isinstance(param.type, StateFile):
            outputs.file(label(param), path)
    return outputs


def outputs() -> Outputs:
    """The outputs of the running command."""
    found = click.get_current_context().meta[_KEY]
    assert isinstance(found, Outputs)
    return found
