# SPDX-License-Identifier: Apache-2.0
"""Outputs of every command are checked before its work begins, and appear complete or not at all."""

import os
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from fluxtrue_tools import cli, paths
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.outputs import Outputs, write_text


def declare(path: object, **options: object) -> Outputs:
    outputs = Outputs()
    outputs.file("--out", Path(str(path)) if path else Path(), **options)  # type: ignore[arg-type]
    return outputs


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


BAD = [
    ("-", "is no name of a file"),
    (".", "is a folder, allowed: a file name"),
    ("folder", "is a folder, allowed: a file name"),
    ("missing/x.csv", "cannot be written (no folder "),
    ("file/x.csv", "cannot be written (Not a directory)"),
    ("a" * 300 + ".csv", "cannot be written (File name too long)"),
    ("loop", "cannot be written (Too many levels of symbolic links)"),
    ("/dev/null", "is a device or a pipe"),
    ("/proc/x.csv", "cannot be written ("),
    ("a\0b", "cannot be written (embedded null byte)"),
    ("\udcff\ud800", "not a name in this system's encoding"),
]


@pytest.mark.parametrize(("name", "message"), BAD, ids=[ascii(name)[:20] for name, _ in BAD])
def test_a_path_that_cannot_be_written_is_refused_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("x")
    (tmp_path / "loop").symlink_to("loop")
    before = names(tmp_path)
    with pytest.raises(FluxtrueError) as refusal:
        declare(name)
    assert str(refusal.value).startswith("--out ")
    assert message in str(refusal.value)
    assert names(tmp_path) == before


def test_a_write_protected_file_is_not_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "x.csv"
    path.write_text("old")
    # Root may write every file: this is the system's answer for another user.
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(FluxtrueError, match="write-protected"):
        declare(path)


@pytest.mark.parametrize("link", ["same", "symbolic", "hard", "dots"])
def test_an_output_is_never_an_input_under_any_name(tmp_path: Path, link: str) -> None:
    source, output = tmp_path / "in.toml", tmp_path / "out.toml"
    source.write_text("precious")
    if link == "symbolic":
        output.symlink_to(source)
    elif link == "hard":
        output.hardlink_to(source)
    else:
        output = source if link == "same" else tmp_path / ".." / tmp_path.name / "in.toml"
    outputs = Outputs()
    outputs.reads(source)
    with pytest.raises(FluxtrueError, match="would overwrite input"):
        outputs.file("--out", output)
    later = declare(output)
    with pytest.raises(FluxtrueError, match="would overwrite input"):
        later.reads(source)
    assert source.read_text() == "precious"


def test_a_folder_may_not_hold_an_input_under_a_name_that_is_written(tmp_path: Path) -> None:
    (tmp_path / "report.txt").write_text("a flux map of that name")
    outputs = Outputs()
    outputs.reads(tmp_path / "report.txt")
    with pytest.raises(FluxtrueError, match="would overwrite input"):
        outputs.folder("--out", tmp_path, ["report.txt"])
    outputs.folder("--out", tmp_path, ["another.txt"])


def test_two_outputs_may_not_be_one_file(tmp_path: Path) -> None:
    outputs = declare(tmp_path / "a.csv")
    with pytest.raises(FluxtrueError, match="given twice"):
        outputs.file("--json", tmp_path / "." / "a.csv")
    outputs.folder("--dir", tmp_path / "new", ["report.html"])
    with pytest.raises(FluxtrueError, match="given twice"):
        outputs.file("--plot", tmp_path / "new" / ".." / "new" / "report.html")


def test_all_files_appear_together_at_the_end(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("old")
    outputs = declare(tmp_path / "a")
    outputs.file("--json", tmp_path / "b")
    with outputs:
        outputs.text(tmp_path / "a", "new")
        outputs.text(tmp_path / "b", "new")
        assert (tmp_path / "a").read_text() == "old" and not (tmp_path / "b").exists()
    assert [(tmp_path / name).read_text() for name in names(tmp_path)] == ["new", "new"]


@pytest.mark.parametrize("error", [FluxtrueError("no"), KeyboardInterrupt(), ZeroDivisionError(), OSError(28, "full")])
def test_whatever_goes_wrong_leaves_everything_as_it_was(tmp_path: Path, error: BaseException) -> None:
    (tmp_path / "a").write_text("old")
    outputs = declare(tmp_path / "a")
    outputs.folder("--dir", tmp_path / "deep" / "er", ["x"])
    wanted = FluxtrueError if isinstance(error, OSError) else type(error)
    with pytest.raises(wanted), outputs:
        outputs.text(tmp_path / "a", "new")
        (outputs.scratch(tmp_path / "deep" / "er") / "x").write_text("new")
        raise error
    assert names(tmp_path) == ["a"] and (tmp_path / "a").read_text() == "old"


def test_a_folder_appears_whole_and_one_that_was_there_keeps_its_other_files(tmp_path: Path) -> None:
    for folder in (tmp_path / "deep" / "new", tmp_path):
        outputs = Outputs()
        outputs.folder("--out", folder, ["x"])
        with outputs:
            (outputs.scratch(folder) / "x").write_text("made")
            assert not (folder / "x").exists()
    assert names(tmp_path) == ["deep", "x"] and names(tmp_path / "deep" / "new") == ["x"]


def test_a_folder_in_the_place_of_a_file_is_found_before_anything_is_moved(tmp_path: Path) -> None:
    (tmp_path / "b").mkdir()
    outputs = Outputs()
    outputs.folder("--out", tmp_path)  # the names are not known beforehand
    with pytest.raises(FluxtrueError, match="b is a folder"), outputs:
        made = outputs.scratch(tmp_path)
        (made / "a").write_text("")
        (made / "b").write_text("")
    assert names(tmp_path) == ["b"]


def test_a_link_leads_to_the_file_that_is_written_and_stays(tmp_path: Path) -> None:
    (tmp_path / "real").write_text("old")
    (tmp_path / "real").chmod(0o640)
    (tmp_path / "link").symlink_to("real")
    write_text(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "real").read_text() == "new"
    assert (tmp_path / "real").stat().st_mode & 0o777 == 0o640


def test_a_name_of_the_greatest_length_can_be_written(tmp_path: Path) -> None:
    write_text(tmp_path / ("a" * 251 + ".csv"), "x")


def commands(group: click.Group, above: str = "") -> Iterator[tuple[str, click.Command]]:
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        if isinstance(command, click.Group):
            yield from commands(command, f"{above}{name} ")
        else:
            yield f"{above}{name}", command


ALL = dict(commands(cli.main))


@pytest.mark.parametrize("name", ALL)
def test_every_command_declares_its_paths(name: str) -> None:
    assert isinstance(ALL[name], paths.Command)
    for param in ALL[name].params:
        assert not isinstance(param.type, click.Path | click.File), f"{param.name}: click's own type checks too little"


@pytest.mark.parametrize(
    ("name", "option"),
    [(name, param) for name, command in ALL.items() for param in command.params
     if isinstance(param.type, paths.OutputFile | paths.OutputFolder | paths.StateFile)
     and isinstance(param, click.Option)],
    ids=lambda value: value if isinstance(value, str) else str(value.name),
)  # fmt: skip
@pytest.mark.parametrize("value", ["", "-", "loop"])
def test_every_output_of_every_command_is_refused_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str,
    option: click.Option, value: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "input").write_text("not what any command reads")
    (tmp_path / "folder").mkdir()
    arguments = [*name.split(), max(option.opts, key=len), value]
    for param in ALL[name].params:
        if param.required and param is not option:
            is_folder = isinstance(param.type, paths.InputFolder)
            needed = "1" if isinstance(param.type, click.IntRange) else "folder" if is_folder else "input"
            needed = str(param.type.min) if isinstance(param.type, click.FloatRange) else needed
            needed = str(param.type.choices[0]) if isinstance(param.type, click.Choice) else needed
            arguments += [needed] if isinstance(param, click.Argument) else [param.opts[-1], needed]
    assert cli.run(arguments) == 2
    message = capsys.readouterr().err
    assert message.startswith(f"error: {max(option.opts, key=len)} ") and message.count("\n") == 1, message
    assert names(tmp_path) == ["folder", "input", "loop"]
