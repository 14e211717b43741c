# SPDX-License-Identifier: Apache-2.0
"""A commissioning that was interrupted goes on with the steps that it has kept."""

import json
import shutil
from pathlib import Path

import pytest

from fluxtrue_tools.cli import EXIT_INTERRUPTED
from fluxtrue_tools.cli import run as command
from fluxtrue_tools.commission import drag, hidden, levels, spin
from fluxtrue_tools.commission.connection import Followed
from fluxtrue_tools.commission.harmonics import Harmonics
from fluxtrue_tools.commission.steps import Found
from fluxtrue_tools.commission.turning import Connection
from fluxtrue_tools.commission.work import Work
from fluxtrue_tools.errors import FluxtrueError

MACHINE = ["--machine", "saturated", "--seed", "12"]


def interrupted(*_: object, **__: object) -> None:
    raise KeyboardInterrupt


def commission(folder: Path, place: Path, *more: str) -> int:
    """Exit code."""
    options = ["--motor", str(folder), "--out", str(place / "found"), "--work", str(place / "work")]
    return command(["commission", *options, *(more or MACHINE)])


@pytest.fixture
def begun(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A run that has ended after the first step."""
    with monkeypatch.context() as patch:
        patch.setattr(levels, "measure", interrupted)
        assert commission(folder, tmp_path, *MACHINE, "--step", "resistance") == EXIT_INTERRUPTED
    assert json.loads((tmp_path / "work" / "steps.json").read_text())["steps"] == ["offsets"]
    assert not (tmp_path / "found").exists()
    return tmp_path


def test_finished_steps_are_not_repeated(
    folder: Path, begun: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert commission(folder, begun, *MACHINE, "--step", "resistance", "--resume") == 0
    said = capsys.readouterr().out
    assert "offsets: kept from an earlier run" in said and "resistance: direct currents" in said
    shutil.rmtree(begun / "found")
    monkeypatch.setattr(levels, "measure", interrupted)  # is not called any more
    assert commission(folder, begun, *MACHINE, "--step", "resistance", "--resume") == 0
    again = capsys.readouterr().out
    assert "resistance: kept from an earlier run" in again
    assert said.splitlines()[-5:] == again.splitlines()[-5:], "the same report"


@pytest.mark.parametrize(("other", "what"), [
    (["--machine", "hsm1", "--seed", "12"], "--machine"), (["--machine", "saturated", "--seed", "13"], "--seed"),
    ([*MACHINE, "--virtual-ecu"], "bus"),
])  # fmt: skip
def test_steps_of_another_machine_are_refused(
    other: list[str], what: str, folder: Path, begun: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert commission(folder, begun, *other, "--step", "resistance", "--resume") == 2
    said = capsys.readouterr().err
    assert said.count("error: ") == 1 and f"measured with another {what}, allowed: the same" in said
    assert not (begun / "found").exists()


def test_without_resume_it_begins_again(folder: Path, begun: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert commission(folder, begun, *MACHINE, "--step", "resistance") == 0
    assert "kept" not in capsys.readouterr().out


def test_resume_wants_a_work_folder(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["commission", "--motor", str(folder), "--out", str(tmp_path / "o"), "--resume"]) == 2
    assert "--resume: wanted: --work" in capsys.readouterr().err


@pytest.mark.parametrize("there", [None, "notes.txt"])
def test_resume_wants_the_folder_of_an_earlier_run(
    there: str | None, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hidden, "make", interrupted)  # is not called: nothing moves a second time by mistake
    if there is not None:
        (tmp_path / "work").mkdir()
        (tmp_path / "work" / there).write_text("of something else")
    assert commission(folder, tmp_path, *MACHINE, "--step", "resistance", "--resume") == 2
    said = capsys.readouterr().err
    assert said.count("error: ") == 1 and "steps.json: missing, so no step has ended there, allowed: " in said


def test_what_is_kept_is_what_was_found(tmp_path: Path) -> None:
    wiring = Connection(3, True, 0.25)
    uneven = Harmonics([0.01 - 0.02j, -0.003j, 0j, 1e-4j], [1e-4] * 4, [1e-5j] * 4, 0.07, True)
    found = Found(1.5 - 0.5j, 2.0, Followed(7.5, -3.01, 0.1, wiring),
                  spin.Spun(wiring, 0.16, 1e-4, 2e-4, 1e-5, 400.0, uneven),
                  drag.Drag(0.06, 1e-4, 0.1, 2e-3, 3e-6, 10.0, 100.0))  # fmt: skip
    work = Work(tmp_path, {"--motor": "a"})
    work.save(("offsets", "phases", "spin", "drag"), found)
    assert work.load() == (("offsets", "phases", "spin", "drag"), found)
    with pytest.raises(FluxtrueError, match="measured with another --motor"):
        Work(tmp_path, {"--motor": "b"}).load()


@pytest.mark.parametrize("content", ["", "{}", "[1]", '{"belongs": {}, "steps": [], "found": {}}', "{", "[" * 99999])
def test_a_damaged_work_file_is_refused(content: str, tmp_path: Path) -> None:
    (tmp_path / "steps.json").write_text(content)
    with pytest.raises(FluxtrueError, match="not the steps of a commissioning"):
        Work(tmp_path, {}).load()


def test_a_number_that_was_changed_by_hand_is_no_measured_one(tmp_path: Path) -> None:
    work = Work(tmp_path, {})
    work.save(("offsets",), Found(0.5 + 0.25j))
    path = tmp_path / "steps.json"
    path.write_text(path.read_text().replace("0.25", "-0.25"))
    with pytest.raises(FluxtrueError, match="changed after it had been written"):
        work.load()


def test_damaged_steps_are_refused_before_anything_is_started(
    folder: Path, begun: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (begun / "work" / "steps.json").write_text("{}")
    monkeypatch.setattr(hidden, "make", interrupted)  # is not called
    assert commission(folder, begun, *MACHINE, "--step", "resistance", "--resume") == 2
    assert "steps.json: not the steps of a commissioning" in capsys.readouterr().err


def test_an_interrupted_save_leaves_the_steps_before_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    work = Work(tmp_path, {})
    work.save(("offsets",), Found())
    monkeypatch.setattr(Path, "write_text", interrupted)
    with pytest.raises(KeyboardInterrupt):
        work.save(("offsets", "resistance"), Found())
    assert work.load()[0] == ("offsets",)
    assert [path.name for path in tmp_path.iterdir()] == ["steps.json"]
