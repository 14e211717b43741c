# SPDX-License-Identifier: Apache-2.0
"""The command line turns every outcome into the right exit code and at most one line."""

import os
import subprocess
import sys
import types
from collections.abc import Callable
from pathlib import Path

import click
import pytest

from fluxtrue_tools import cli
from fluxtrue_tools.errors import FluxtrueError


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[], object]], None]:
    """Puts a command `probe` with the given body in place of the real ones."""

    def install(body: Callable[[], object]) -> None:
        module = types.ModuleType("probe_module")

        @click.command()
        @click.option("--count", type=int)
        def probe(count: int | None) -> object:
            return body()

        module.probe = probe
        monkeypatch.setitem(sys.modules, "probe_module", module)
        monkeypatch.setattr(cli, "COMMANDS", {"probe": ("probe_module", "probe", "A probe.")})

    return install


def raising(error: BaseException) -> Callable[[], object]:
    """A body that raises."""

    def body() -> object:
        raise error

    return body


def test_a_command_that_returns_nothing_exits_with_0(command) -> None:
    command(lambda: None)
    assert cli.run(["probe"]) == 0


def test_a_command_chooses_its_exit_code(command) -> None:
    command(lambda: 3)
    assert cli.run(["probe"]) == 3


@pytest.mark.parametrize("wrong", [("--machine", "nope"), ("--step", "nope"), ("--nonsense", "1")])
def test_a_module_with_a_command_line_of_its_own_ends_with_one_line(wrong: tuple[str, str]) -> None:
    module = [sys.executable, "-m", "fluxtrue_tools.commission.over_can", *wrong]
    done = subprocess.run(module, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("error: ") and wrong[0] in done.stderr and done.stderr.count("\n") == 1


def test_every_module_with_a_command_line_of_its_own_ends_like_the_commands() -> None:
    """Modules whose main() is a click command; __main__ and programs of the build have another main()."""
    texts = {path: path.read_text(encoding="utf-8") for path in Path(cli.__file__).parent.rglob("*.py")}
    own = {path for path, text in texts.items() if "@click.command()" in text and '__name__ == "__main__"' in text}
    assert len(own) >= 9
    assert [path for path in own if not texts[path].endswith("    run_module(main)\n")] == []


def test_a_missing_program_is_named_with_its_remedy(command, capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "/nonexistent")
    command(lambda: subprocess.run(["cmake", "--version"], check=False))
    assert cli.run(["probe"]) == 2
    assert capsys.readouterr().err == "error: cmake not found: install it or run tools/setup\n"


def test_a_file_that_the_system_refuses_is_named_with_the_reason(command, capsys) -> None:
    command(lambda: Path("missing.csv").read_text(encoding="utf-8"))
    assert cli.run(["probe"]) == 2
    assert capsys.readouterr().err == "error: missing.csv: No such file or directory\n"


def test_our_error_is_one_line_even_if_its_text_is_not(command, capsys) -> None:
    command(raising(FluxtrueError("motor.toml: r_ohm = -1:\n  must be > 0")))
    assert cli.run(["probe"]) == 2
    assert capsys.readouterr().err == "error: motor.toml: r_ohm = -1: must be > 0\n"


def test_an_interrupt_exits_with_130(command) -> None:
    command(raising(KeyboardInterrupt()))
    assert cli.run(["probe"]) == 130


def test_a_bug_shows_itself(command) -> None:
    command(raising(ZeroDivisionError("bug")))
    with pytest.raises(ZeroDivisionError):
        cli.run(["probe"])


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["prob"], "unknown command 'prob', allowed: probe, test"),
        (["--wrong"], "--wrong"),
        (["probe", "--wrong"], "fluxtrue probe --help"),
        (["probe", "--count", "three"], "three"),
        (["probe", "surplus"], "surplus"),
    ],
)
def test_wrong_arguments_are_one_line(command, capsys, arguments: list[str], word: str) -> None:
    command(lambda: None)
    assert cli.run(arguments) == 2
    message = capsys.readouterr().err
    assert message.startswith("error: ")
    assert word in message
    assert message.count("\n") == 1


def run_python(*arguments: str, **options) -> subprocess.CompletedProcess[str]:
    """The command line as a process."""
    return subprocess.run([sys.executable, "-m", "fluxtrue_tools", *arguments],
                          capture_output=True, text=True, check=False, **options)  # fmt: skip


def test_help_lists_every_command_without_importing_any() -> None:
    done = run_python("--help")
    assert done.returncode == 0
    for name in ("demo", "sim", "vecu", "motor", "bench", "test"):
        assert f"\n  {name} " in done.stdout
    probe = "import sys, fluxtrue_tools.cli; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", probe], check=False).returncode == 0


@pytest.mark.parametrize("name", ["demo", "sim", "vecu", "motor", "bench"])
def test_every_command_has_help(name: str) -> None:
    done = run_python(name, "--help")
    assert (done.returncode, done.stderr) == (0, "")


def test_nothing_to_do_shows_the_help_and_is_an_error() -> None:
    done = run_python()
    assert done.returncode == 2
    assert "Commands:" in done.stderr


def test_a_reader_that_has_gone_is_no_traceback() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as pipe:
        done = subprocess.run([sys.executable, "-m", "fluxtrue_tools", "--help"],
                              stdout=pipe, stderr=subprocess.PIPE, text=True,
                              check=False)  # fmt: skip
    assert (done.returncode, done.stderr) == (1, "")
