# SPDX-License-Identifier: Apache-2.0
"""Every command with mutated files and command lines: it ends with one message and exit code 2, or completely.

No input may cause a traceback, a partial output, or a success or the begin of the work where it cannot be meant. The
commands and their parameters are those of the command line: one that has no valid call here, or a parameter without
wrong values, fails. Work that takes long is replaced by conftest.py: that it was reached is the result.
"""

from typing import Any

import pytest
from abused import ABUSED, ABUSED_LESS, Content, abuse
from commands import COMMANDS, WRONG_TEXTS, call, cases, spelled, wrong_values
from hypothesis import given
from hypothesis import strategies as st
from mutations import FILES, MORE_FILES

# Inputs of the work of these commands do not exist here.
IDLE = {"demo", "fuzz", "prove", "mutate", "bench", "motor start", "target sbom"}
ODD_WORDS = ("", "-", ".", "/", "..", "loop", "folder", "missing/x", "/dev/null", "/dev/zero", "/proc/x", "a" * 300,
             "in.toml", "in.toml/x", "m", "link", "new.csv", "new.png", "new.json", "~", "~nosuch/x", "a;b", "a\nb",
             "🙂.csv", "--out", "--nonsense", "-x", "1", "-1", "x", "1e9", "nan")  # fmt: skip


def test_every_command_is_abused() -> None:
    assert set(cases()) == set(COMMANDS), "commands.py wants a valid call of every command"
    missing = [
        f"{name}: {file}" for name in COMMANDS for file in cases()[name].files
        if file not in FILES.get(name, {}) and (name, file) not in MORE_FILES
    ]  # fmt: skip
    assert not missing, "mutations.py wants mutations of every file"
    assert {name for name in COMMANDS if name not in FILES} == IDLE


def test_every_parameter_has_wrong_values() -> None:
    without = [f"{name} {spelled(param)}" for name, command in COMMANDS.items() for param in command.params
               if not getattr(param, "is_flag", False) and not wrong_values(name, param)]  # fmt: skip
    assert not without, "WRONG_TEXTS of commands.py wants texts that they cannot take"


@pytest.mark.parametrize("name", COMMANDS)
def test_the_valid_call_is_accepted(name: str) -> None:
    text = abuse(cases()[name].files, call(name), cases()[name].outputs)
    assert not text.startswith(("error: ", "Usage: ")), text


@pytest.mark.parametrize("name", COMMANDS)
def test_each_wrong_value_is_refused_by_its_name_before_the_work(name: str) -> None:
    for param in COMMANDS[name].params:
        for value in wrong_values(name, param):
            text = abuse(cases()[name].files, call(name, param, value), must_fail=True)
            named = spelled(param).lower() in text.lower() or (value and value[:40] in text)
            assert named, f"{name} {spelled(param)} {value!r}: {text}"


@pytest.mark.parametrize("name", COMMANDS)
def test_command_lines(name: str) -> None:
    """Wrong values in any company, odd words, and a disk that is soon full."""
    case, params = cases()[name], COMMANDS[name].params
    pairs = [(param, value) for param in params for value in wrong_values(name, param)]
    opts = [opt for param in params if spelled(param).startswith("--") for opt in param.opts]
    words = st.sampled_from((*opts, *ODD_WORDS))
    lists = st.lists(words, min_size=1, max_size=6)
    wrong = st.sampled_from(pairs).map(lambda pair: (call(name, *pair), True, None)) if pairs else st.nothing()
    odd = (st.tuples(st.sampled_from(opts or ["-x"]), words) | lists).map(
        lambda more: ([*name.split(), *case.options, *more, "--", *case.places], False, None))  # fmt: skip
    bare = lists.map(lambda more: ([*name.split(), *more], False, None))
    full = st.integers(0, 20000).map(lambda left: (call(name), False, left))

    @ABUSED
    @given(wrong | odd | bare | full)
    def lines(drawn: tuple[list[str], bool, int | None]) -> None:
        arguments, must_fail, left = drawn
        abuse(case.files, arguments, case.outputs if left is not None else (), must_fail, left=left)

    lines()


SLOW = ("m/motor.toml", "m/flux_map.csv", "map.csv", "loss.csv", "image.elf")
PLACES = [(name, file) for name, files in FILES.items() for file in files]


@pytest.mark.parametrize(("name", "file"), [*PLACES, *((n, f) for n, f in MORE_FILES if (n, f) not in PLACES)])
def test_files(name: str, file: str) -> None:
    case = cases()[name]
    more, strategy = MORE_FILES.get((name, file), ((), None))
    arguments = [*name.split(), *case.options, *more, "--", *case.places]

    @(ABUSED_LESS if file in SLOW else ABUSED)
    @given(strategy if strategy is not None else FILES[name][file])
    def contents(changed: tuple[Content, Any]) -> None:
        abuse(case.files | {file: changed[0]}, arguments, case.outputs, changed[1])

    contents()


def test_every_text_that_no_option_takes_belongs_to_one() -> None:
    known = {spelled(param) for command in COMMANDS.values() for param in command.params}
    known |= {f"{name} {param.name}" for name, command in COMMANDS.items() for param in command.params}
    assert set(WRONG_TEXTS) <= known
