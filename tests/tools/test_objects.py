# SPDX-License-Identifier: Apache-2.0
"""The checker of compiled layers finds planted variables, divisions and floats."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

CHECK = Path(__file__).resolve().parents[2] / "tools" / "checks" / "objects.py"
ARM = ("arm-none-eabi-gcc", "-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16")
needs_arm = pytest.mark.skipif(not shutil.which(ARM[0]), reason="no Arm compiler")


def check(folder: Path, source: str, compiler: tuple[str, ...], name: str = "fx/bad.c") -> str:
    """The messages of the checker for a layer with this one file; empty if it finds nothing."""
    layer, file_name = name.split("/")
    code = folder / file_name
    code.write_text(source)
    (folder / "firmware").mkdir()
    library = folder / "firmware" / f"libfluxtrue_{layer}.a"
    subprocess.run([*compiler, "-O2", "-c", str(code), "-o", str(code) + ".o"], check=True)
    subprocess.run(["ar", "rcs", str(library), str(code) + ".o"], check=True)
    target = ["--target"] if compiler is ARM else []
    done = subprocess.run(
        [sys.executable, str(CHECK), *target, str(folder)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "Traceback" not in done.stderr
    assert (done.returncode == 0) == (done.stderr == "")
    return done.stderr


@pytest.mark.parametrize(
    "source",
    [
        "int counter;\n",
        "static int counter;\nint next(void) { return ++counter; }\n",
        "int next(void) { static int counter = 3; return ++counter; }\n",
        "_Thread_local int counter;\n",
    ],
)
def test_a_variable_in_a_layer_is_found(tmp_path: Path, source: str) -> None:
    assert "counter" in check(tmp_path, source, ("gcc", "-fPIC"))


def test_constants_are_no_variables_even_with_pointers(tmp_path: Path) -> None:
    source = "static const int a[2] = {1, 2};\nconst int *const table[2] = {a, a + 1};\n"
    assert check(tmp_path, source, ("gcc", "-fPIC")) == ""


def test_the_drive_may_own_state(tmp_path: Path) -> None:
    assert check(tmp_path, "int counter;\n", ("gcc",), "drive/tasks.c") == ""


def test_a_folder_without_layers_is_an_error(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, str(CHECK), str(tmp_path)],
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 1
    assert "build it first" in done.stderr


@needs_arm
@pytest.mark.parametrize(
    ("source", "word"),
    [
        ("int f(int a, int b) { return a / b; }", "1 divisions, at most 0"),
        ("unsigned f(unsigned a, unsigned b) { return a % b; }", "1 divisions"),
        ("long long f(long long a, long long b) { return a / b; }", "1 divisions"),
        ("float f(float a) { return a * 3.0F; }", "floating point in f: vmul.f32"),
        ("int f(int a) { return (int)(a * 0.5F); }", "floating point in f"),
        ("double f(double a, double b) { return a + b; }", "__aeabi_dadd"),
        ("float sinf(float);\nfloat f(float a) { return sinf(a); }", "sinf"),
    ],
)
def test_a_division_or_a_float_on_the_target_is_found(tmp_path: Path, source: str, word: str) -> None:
    assert word in check(tmp_path, source + "\n", ARM)


@needs_arm
def test_an_interrupt_of_the_drive_is_held_to_the_rule_and_a_task_is_not(tmp_path: Path) -> None:
    source = "float f(float a) { return a * 3.0F; }\n"
    for folder in ("isr", "task"):
        (tmp_path / folder).mkdir()
    assert "vmul" in check(tmp_path / "isr", source, ARM, "drive/fast_isr.c")
    assert check(tmp_path / "task", source, ARM, "drive/task_1khz.c") == ""


@needs_arm
def test_fixed_point_code_and_names_like_instructions_pass(tmp_path: Path) -> None:
    source = "int valid(int);\nint f(int a, short b) { return valid((int)(((long long)a * b + 0x4000) >> 15)) / 8; }\n"
    assert check(tmp_path, source, ARM) == ""


@needs_arm
def test_a_library_that_needs_more_than_the_port_is_found(tmp_path: Path) -> None:
    source = "int hal_read(void);\nint other(void);\nint f(void) { return hal_read() + other(); }\n"
    assert check(tmp_path, source, ARM) == ""
    shutil.copy(tmp_path / "firmware" / "libfluxtrue_fx.a", tmp_path / "libfluxtrue.a")
    done = subprocess.run([sys.executable, str(CHECK), "--target", str(tmp_path)],
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 1
    assert done.stderr == "libfluxtrue.a/bad.c:0: no definition of 'other'\n"
