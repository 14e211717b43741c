# SPDX-License-Identifier: Apache-2.0
"""An image's build folder is configured again when something has changed, and only then."""

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fluxtrue_tools.target.build import ARM_CC, CACHE, MOTORS, RULES, configure


def build_type(folder: Path) -> str:
    found = re.search(r"^CMAKE_BUILD_TYPE:\w+=(.*)$", (folder / CACHE).read_text(), re.MULTILINE)
    assert found is not None
    return found[1]


def test_a_build_folder_is_configured_again_only_after_a_change(tmp_path: Path) -> None:
    if shutil.which(ARM_CC) is None:
        pytest.skip(f"{ARM_CC} is not installed")
    folder, motors = tmp_path / "template", tmp_path / "motors"
    shutil.copytree(MOTORS, motors)
    chosen = f"-DFLUXTRUE_MOTOR={motors / 'hsm1'}"
    rules = folder / RULES

    def is_configured(options: list[str]) -> bool:
        before = rules.stat().st_mtime_ns if rules.is_file() else 0
        configure("template", folder, [chosen, *options], motors)
        return rules.stat().st_mtime_ns != before

    assert is_configured([])
    assert not is_configured([])
    data = motors / "hsm1" / "motor.toml"
    data.write_text(data.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
    assert is_configured([])
    kind = build_type(folder)
    subprocess.run(["cmake", "-DCMAKE_BUILD_TYPE=Other", str(folder)], check=True, capture_output=True)
    assert build_type(folder) == "Other"
    assert is_configured([])  # another hand has changed an option of the folder
    assert build_type(folder) == kind
    assert is_configured(["-DFLUXTRUE_WERROR=OFF"])


class Folder:
    """A build folder, and in place of cmake what writes into it the files that cmake would."""

    def __init__(self, tmp_path: Path) -> None:
        self.folder, self.motors, self.elsewhere = (tmp_path / name for name in ("build", "motors", "elsewhere"))
        self.motor = self.motors / "shipped"
        for motor in (self.motor, self.elsewhere):
            motor.mkdir(parents=True)
            (motor / "motor.toml").write_text('flux_map = "a.csv"\n', encoding="utf-8")
        self.folder.mkdir()
        self.while_configuring: Callable[[], None] = lambda: None
        self._runs = 0

    def cmake(self, *_: object) -> None:
        self._runs += 1
        self.while_configuring()
        (self.folder / CACHE).write_text(f"A:BOOL=ON\nFLUXTRUE_MOTOR:PATH={self.motor}\n", encoding="utf-8")
        (self.folder / RULES).touch()

    def is_configured(self) -> bool:
        before = self._runs
        configure("template", self.folder, [], self.motors)
        return self._runs != before


@pytest.fixture
def build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Folder:
    folder = Folder(tmp_path)
    monkeypatch.setattr("fluxtrue_tools.target.build._run", folder.cmake)
    return folder


def test_what_is_edited_while_cmake_runs_is_configured_the_next_time(build: Folder) -> None:
    data = build.motor / "motor.toml"

    def edit() -> None:
        data.write_text('flux_map = "b.csv"\n', encoding="utf-8")

    build.while_configuring = edit
    assert build.is_configured()
    assert build.is_configured()
    assert not build.is_configured()


def test_the_data_of_a_motor_that_only_the_cache_names_are_noticed(build: Folder) -> None:
    build.motor = build.elsewhere
    assert build.is_configured()
    assert build.is_configured()  # only now it is known which motor's data count
    assert not build.is_configured()
    (build.elsewhere / "motor.toml").write_text('flux_map = "b.csv"\n', encoding="utf-8")
    assert build.is_configured()
    assert not build.is_configured()


@pytest.mark.parametrize("name", [CACHE, RULES])
def test_a_folder_that_lacks_a_file_of_cmake_is_configured_again(build: Folder, name: str) -> None:
    assert build.is_configured()
    assert not build.is_configured()
    (build.folder / name).unlink()
    assert build.is_configured()
    assert not build.is_configured()
