# SPDX-License-Identifier: Apache-2.0
"""The shell scripts work from any folder and in a path with spaces, and report a missing network or root clearly."""

import fcntl
import os
import shutil
import subprocess
from pathlib import Path

import pytest

TOOLS = Path(__file__).resolve().parents[2] / "tools"
SCRIPTS = ("setup", "test", "mcdc", "demo", "hil", "format", "fluxtrue", "common.sh")
# What the scripts use besides the programs they look for.
BASICS = (
    "bash", "sh", "env", "dirname", "readlink", "mkdir", "cat", "sha256sum", "flock", "sed", "grep",
    "sort", "head", "tail", "xargs", "mktemp", "rm", "mv", "find", "awk", "printf", "echo", "id",
)  # fmt: skip


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A copy of tools/ below a path with spaces, its Python environment in place."""
    root = tmp_path / "a path" / "with  spaces"
    shutil.copytree(TOOLS, root / "tools", ignore=shutil.ignore_patterns("__pycache__"))
    environment = root / "build" / "venv"
    (environment / "bin").mkdir(parents=True)
    python = environment / "bin" / "python"
    python.write_text('#!/bin/sh\nprintf "%s|" python "$@"\n')
    python.chmod(0o755)
    with (root / "tools" / "requirements.txt").open("rb") as pinned:
        stamp = subprocess.run(["sha256sum"], stdin=pinned, capture_output=True, check=True)
    (environment / "stamp").write_bytes(stamp.stdout)
    return root


def stub(folder: Path, name: str, text: str) -> None:
    """A program that stands in for the real one."""
    folder.mkdir(exist_ok=True)
    path = folder / name
    path.unlink(missing_ok=True)
    path.write_text("#!/bin/sh\n" + text + "\n")
    path.chmod(0o755)


@pytest.fixture
def bare_path(tmp_path: Path) -> Path:
    """A PATH with everything that the demonstration needs except Ninja; apt-get fails as without a network."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name in (*BASICS, "gcc", "cmake"):
        found = shutil.which(name)
        assert found, name
        (folder / name).symlink_to(found)
    stub(folder, "apt-get", 'echo "E: Unable to fetch some archives" >&2; exit 100')
    return folder


def run(root: Path, script: str, *arguments: str, **options) -> subprocess.CompletedProcess[str]:
    """A script of the copy, started from the root of the file system."""
    environment = {key: value for key, value in os.environ.items() if key != "FLUXTRUE_LOCK"}
    environment.update(options.pop("env", {}))
    return subprocess.run([str(root / "tools" / script), *arguments], cwd="/", env=environment,
                          stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False, **options)  # fmt: skip


@pytest.mark.parametrize("script", SCRIPTS)
def test_bash_accepts_the_script(script: str) -> None:
    subprocess.run(["bash", "-n", str(TOOLS / script)], check=True)


def test_a_finished_set_up_is_silent_and_uses_no_package_manager(checkout: Path, bare_path: Path) -> None:
    stub(bare_path, "ninja", "exit 0")
    done = run(checkout, "setup", "demo", env={"PATH": str(bare_path)})
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_an_unknown_part_is_one_line(checkout: Path) -> None:
    done = run(checkout, "setup", "everything")
    assert done.returncode == 2
    assert done.stderr == "error: tools/setup: unknown part 'everything', allowed: demo, test, mcdc\n"


def test_without_network_the_missing_package_is_named(checkout: Path, bare_path: Path) -> None:
    stub(bare_path, "id", "echo 0")
    done = run(checkout, "setup", "demo", env={"PATH": str(bare_path)})
    assert done.returncode == 2
    progress, error = done.stderr.splitlines()
    assert progress == "installing Debian packages: ninja-build"
    assert error.startswith("error: cannot install the Debian packages ninja-build")
    assert "E: Unable to fetch some archives" in error


def install(checkout: Path, bare_path: Path) -> Path:
    """Put all in place that tools/test needs; the list of what apt is asked."""
    asked = checkout / "asked"
    for name in ("ninja", "ruby", "clang", "chromium-headless-shell", "chromedriver", "gcc", "arm-none-eabi-gcc",
                 "qemu-system-arm", "riscv64-unknown-elf-gcc", "x86_64-w64-mingw32-gcc"):  # fmt: skip
        stub(bare_path, name, "cat >/dev/null")  # what is compiled to see whether a compiler has its library
    stub(bare_path, "dpkg", "echo amd64")
    stub(bare_path, "apt-get", f'echo "$@" >> "{asked}"; exit 100')
    for name in ("cmock", "cbmc"):
        (checkout / "build" / name).mkdir()
        stamp = TOOLS.parent / "build" / name / "stamp"
        (checkout / "build" / name / "stamp").write_bytes(stamp.read_bytes())
    return asked


def test_the_gate_does_without_the_clang_that_measures_mcdc(checkout: Path, bare_path: Path) -> None:
    asked = install(checkout, bare_path)
    done = run(checkout, "setup", "test", env={"PATH": str(bare_path)})
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert not asked.exists()


@pytest.mark.parametrize("command", [("setup", "mcdc"), ("mcdc",)])
def test_the_measurement_of_mcdc_names_the_clang_that_it_cannot_get(
    checkout: Path, bare_path: Path, command: tuple[str, ...]
) -> None:
    asked = install(checkout, bare_path)
    done = run(checkout, *command, env={"PATH": str(bare_path)})
    assert done.returncode == 2
    progress, error = done.stderr.splitlines()
    assert progress.startswith("fetching clang 1:19.")
    assert error.startswith("error: cannot get clang-19=1:19.")
    assert asked.exists()


def test_the_measurement_of_mcdc_is_refused_where_its_clang_is_not_pinned(checkout: Path, bare_path: Path) -> None:
    install(checkout, bare_path)
    stub(bare_path, "dpkg", "echo arm64")
    done = run(checkout, "setup", "mcdc", env={"PATH": str(bare_path)})
    assert done.returncode == 2
    assert done.stderr == "error: no clang 19 for this machine: its packages are pinned for amd64 only\n"


def test_without_root_the_missing_package_is_named(checkout: Path, bare_path: Path) -> None:
    stub(bare_path, "id", "echo 1000")
    done = run(checkout, "setup", "demo", env={"PATH": str(bare_path)})
    assert done.returncode == 2
    assert done.stderr == ("error: missing packages, and no root rights to install them: ninja-build\n")


def test_a_failed_python_set_up_leaves_nothing_behind(checkout: Path, bare_path: Path) -> None:
    stub(bare_path, "ninja", "exit 0")
    shutil.rmtree(checkout / "build" / "venv")
    (checkout / "tools" / "requirements.txt").write_text("no_such_package_of_ours==1.0\n")
    offline = {"PATH": str(bare_path), "PIP_NO_INDEX": "1", "PIP_FIND_LINKS": ""}
    done = run(checkout, "setup", "demo", env=offline)
    assert done.returncode == 2
    assert "error: cannot install tools/requirements.txt" in done.stderr
    assert "no_such_package_of_ours" in done.stderr
    assert sorted(path.name for path in (checkout / "build").iterdir()) == [".lock", "setup.log"]


def test_a_second_command_waits_for_the_first(checkout: Path, bare_path: Path) -> None:
    stub(bare_path, "ninja", "exit 0")
    environment = {key: value for key, value in os.environ.items() if key != "FLUXTRUE_LOCK"}
    with (checkout / "build" / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with subprocess.Popen([str(checkout / "tools" / "setup"), "demo"], text=True,
                              env=environment | {"PATH": str(bare_path)},
                              stderr=subprocess.PIPE) as waiting:  # fmt: skip
            assert waiting.stderr is not None
            assert waiting.stderr.readline().startswith("waiting for another tools/ command")
            assert waiting.poll() is None
            fcntl.flock(lock, fcntl.LOCK_UN)
            assert waiting.wait() == 0


def test_the_launcher_passes_its_arguments_on_untouched(checkout: Path) -> None:
    done = run(checkout, "fluxtrue", "motor", "check", "my motor", "*")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "python|-m|fluxtrue_tools|motor|check|my motor|*|"


def test_the_launcher_works_through_a_link(checkout: Path, tmp_path: Path) -> None:
    link = tmp_path / "fluxtrue"
    link.symlink_to(checkout / "tools" / "fluxtrue")
    done = subprocess.run([str(link), "motor"], capture_output=True, text=True, check=False)
    assert done.stdout == "python|-m|fluxtrue_tools|motor|"


def test_the_suite_on_a_bench_builds_nothing_and_passes_its_options_on(checkout: Path) -> None:
    done = run(checkout, "hil", "--can-interface", "pcan", "--junit", "a b.xml", "-k", "boot or states")
    assert (done.returncode, done.stderr) == (0, "")
    words = done.stdout.split("|")
    assert words[-6:] == ["--can-interface", "pcan", "--junitxml=a b.xml", "-k", "boot or states", ""]
    assert str(checkout / "tests" / "hil") in words


def test_a_build_that_fails_is_reported_with_its_log(checkout: Path) -> None:
    done = run(checkout, "demo", "--build-only")
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith("error: the build failed (see ")


def test_a_build_folder_that_cannot_be_made_is_one_line(checkout: Path) -> None:
    shutil.rmtree(checkout / "build")
    (checkout / "build").write_text("in the way")
    done = run(checkout, "setup", "demo")
    assert done.returncode == 2
    assert done.stderr == f"error: cannot create {checkout / 'build'}\n"


def test_the_whole_test_run_explains_itself(checkout: Path) -> None:
    done = run(checkout, "test", "--help")
    assert done.returncode == 0
    assert done.stdout.startswith("Set up, build and test everything:")


@pytest.mark.parametrize("script", ["setup", "test", "demo", "fluxtrue"])
def test_a_link_to_a_script_finds_its_checkout(checkout: Path, tmp_path: Path, script: str) -> None:
    link = tmp_path / "link"
    link.symlink_to(checkout / "tools" / script)
    done = subprocess.run([link, "--help"], capture_output=True, text=True, check=False)
    assert "common.sh" not in done.stderr


def test_what_a_killed_set_up_left_is_removed_by_the_next(checkout: Path, bare_path: Path) -> None:
    stub(bare_path, "ninja", "exit 0")
    (checkout / "build" / ".setup.AbCdEf" / "venv").mkdir(parents=True)
    done = run(checkout, "setup", "demo", env={"PATH": str(bare_path)})
    assert done.returncode == 0, done.stderr
    assert not list((checkout / "build").glob(".setup.*"))


PROJECT = """
cmake_minimum_required(VERSION 3.25)
project(mocks C)
list(APPEND CMAKE_MODULE_PATH "${CMAKE_SOURCE_DIR}/tools/cmake")
include(Unity)
_fluxtrue_mock("hal/adc.h" "${CMAKE_BINARY_DIR}/x.generated" mock)
add_custom_target(mocks ALL DEPENDS "${mock}")
"""


@pytest.mark.parametrize("name", ["plain", "a space", "a päth (2)", "a+b,c@d"])
def test_mocks_are_made_inside_of_the_checkout_whatever_its_path(tmp_path: Path, name: str) -> None:
    root = tmp_path / name / "checkout"
    shutil.copytree(TOOLS / "cmake", root / "tools" / "cmake")
    for file in ("hal/adc.h", "tests/seconds.txt"):
        (root / file).parent.mkdir(parents=True)
        shutil.copy(TOOLS.parent / file, root / file)
    (root / "CMakeLists.txt").write_text(PROJECT)
    cmock = TOOLS.parent / "build" / "cmock" / "usr" / "share" / "cmock"
    generate = [
        "cmake",
        "-G",
        "Ninja",
        "-S",
        root,
        "-B",
        root / "build",
        "-DFLUXTRUE_TESTS=ON",
        f"-DFLUXTRUE_CMOCK={cmock}",
    ]
    environment = {key: value for key, value in os.environ.items() if key != "HOME"} | {"LC_ALL": "C"}
    for command in (generate, ["cmake", "--build", root / "build"]):
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    assert (root / "build" / "x.generated" / "hal" / "mock_adc.h").is_file()
    assert [path.name for path in tmp_path.iterdir()] == [name]
