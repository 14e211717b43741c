# SPDX-License-Identifier: Apache-2.0
"""An image's build folder is configured again when something has changed, and only then."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from fluxtrue_tools.target.build import ARM_CC, MOTORS, configure


def build_type(folder: Path) -> str:
    found = re.search(r"^CMAKE_BUILD_TYPE:\w+=(.*)$", (folder / "CMakeCache.txt").read_text(), re.MULTILINE)
    assert found is not None
    return found[1]


def test_a_build_folder_is_configured_again_only_after_a_change(tmp_path: Path) -> None:
    if shutil.which(ARM_CC) is None:
        pytest.skip(f"{ARM_CC} is not installed")
    folder, motors = tmp_path / "template", tmp_path / "motors"
    shutil.copytree(MOTORS, motors)
    rules = folder / "build.ninja"

    def is_configured(options: list[str]) -> bool:
        before = rules.stat().st_mtime_ns if rules.is_file() else 0
        configure("template", folder, options, motors)
        return rules.stat().st_mtime_ns != before

    assert is_configured([])
    assert not is_configured([])
    data = next(motors.rglob("*.toml"))
    data.write_text(data.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
    assert is_configured([])
    kind = build_type(folder)
    subprocess.run(["cmake", "-DCMAKE_BUILD_TYPE=Other", str(folder)], check=True, capture_output=True)
    assert build_type(folder) == "Other"
    assert is_configured([])  # another hand has changed an option of the folder
    assert build_type(folder) == kind
    assert is_configured(["-DFLUXTRUE_WERROR=OFF"])
