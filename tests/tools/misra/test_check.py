# SPDX-License-Identifier: Apache-2.0
"""The check finds what no entry covers, entries that cover nothing, and data that may not be so."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
CHECK = ROOT / "tools" / "checks" / "misra.py"
CATEGORIES = "".join(
    re.findall(r"^\w+ = \[\n[^]]*\]\n", (ROOT / "docs/safety/misra.toml").read_text(encoding="utf-8"), re.MULTILINE)
)
ENTRY = """
[[entry]]
rule = "15.7"
files = ["firmware/fx/*"]
line = "^    }$"
reason = "There is nothing to do in the other cases."
safe = "Every case is tested, those with nothing to do as well."
"""
LEFT_OUT = '\n[[disapplied]]\nrules = ["15.5"]\nreason = "A function may leave as soon as nothing remains."\n'
HEADER = """#ifndef FX_SIGN_H
#define FX_SIGN_H
#include <stdint.h>
int32_t sign(int32_t x);
#endif
"""
SIGN = """#include "fx/sign.h"

int32_t sign(int32_t x)
{
    if (x > 0) {
        return 1;
    } else if (x < 0) {
        return -1;
    }
    return 0;
}
"""
USER = '#include "fx/sign.h"\n\nint32_t main(void)\n{\n    return sign(1);\n}\n'


def checkout(root: Path) -> Path:
    """A small checkout with one deviation and one rule that is left out."""
    write(root, "firmware/fx/sign.h", HEADER)
    write(root, "firmware/fx/sign.c", SIGN)
    write(root, "firmware/main.c", USER)
    write(root, "build/host/generated/bus/bus.h", "")
    rules(root, ENTRY + LEFT_OUT)
    return root


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A checkout of its own."""
    return checkout(tmp_path / "check out")


@pytest.fixture(scope="module")
def same_code(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkout for tests that change the data only: its code is read once."""
    return checkout(tmp_path_factory.mktemp("same") / "check out")


def write(root: Path, name: str, text: str) -> None:
    """A file of the checkout."""
    (root / name).parent.mkdir(parents=True, exist_ok=True)
    (root / name).write_text(text, encoding="utf-8")


def rules(root: Path, text: str) -> None:
    """The data, and the page made from them."""
    write(root, "docs/safety/misra.toml", CATEGORIES + text)
    assert run(root, "--write") == (0, [])


def run(root: Path, *arguments: object, **environment: str) -> tuple[int, list[str]]:
    """Exit code, and the lines of its messages."""
    command = [sys.executable, CHECK, "--root", root, "--jobs", "1", root / "build" / "host", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | environment)
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr.splitlines()


def test_a_deviation_with_an_entry_passes_and_is_not_read_again(tree: Path) -> None:
    assert run(tree) == (0, [])
    cache = tree / "build" / "misra-cache"
    kept = {path: path.stat().st_mtime_ns for path in cache.iterdir()}
    assert run(tree) == (0, [])
    assert {path: path.stat().st_mtime_ns for path in cache.iterdir()} == kept
    write(tree, "firmware/fx/sign.h", HEADER.replace("int32_t sign", "extern int32_t sign"))
    assert run(tree) == (0, [])
    assert len(list(cache.iterdir())) == 2 * len(kept)


def test_a_finding_without_an_entry_fails_with_what_is_allowed(tree: Path) -> None:
    write(tree, "firmware/safety/sign.c", SIGN.replace("sign(", "other_sign("))
    code, messages = run(tree, tree / "firmware/safety/sign.c")
    assert code == 1
    assert messages == [
        "firmware/safety/sign.c:3: MISRA C:2012 rule 8.4 (required); docs/safety/misra.toml allows it in: nothing",
        "firmware/safety/sign.c:9: MISRA C:2012 rule 15.7 (required); docs/safety/misra.toml allows it in: "
        "firmware/fx/*, lines with ^    }$",
    ]


def test_a_finding_of_a_header_fails(tree: Path) -> None:
    write(tree, "firmware/fx/sign.h", HEADER.replace("#endif", "#define TWICE(x) (x * 2)\n#endif"))
    code, messages = run(tree)
    assert code == 1
    assert [message.split(" (")[0] for message in messages] == [
        "firmware/fx/sign.h:5: MISRA C:2012 rule 2.5",
        "firmware/fx/sign.h:5: MISRA C:2012 rule 20.7",
    ]


def test_a_finding_between_files_fails(tree: Path) -> None:
    write(tree, "firmware/main.c", USER.replace("sign(1)", "0"))
    write(tree, "firmware/fx/sign.c", SIGN + "\nint32_t twice(void);\nint32_t twice(void)\n{\n    return sign(2);\n}\n")
    code, messages = run(tree)
    assert code == 1
    assert [message.split(" (")[0] for message in messages] == ["firmware/fx/sign.c:14: MISRA C:2012 rule 8.7"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ENTRY + ENTRY.replace("15.7", "16.4") + LEFT_OUT, "rule 16.4: no finding needs this entry"),
        (ENTRY + LEFT_OUT.replace('"15.5"', '"15.5", "15.4"'), "rule 15.4 need not be left out: there is no finding"),
        (ENTRY + LEFT_OUT.replace('"15.5"', '"15.5", "15.6"'), "rule 15.6: only an advisory rule may be left out"),
        (ENTRY.replace("There is nothing to do in the other cases.", "") + LEFT_OUT, "rule 15.7: no reason"),
        (ENTRY + ENTRY.replace("15.7", "17.3") + LEFT_OUT, "rule 17.3 is mandatory: nothing may deviate from it"),
        (ENTRY.replace("safe =", 'instead = "gcc"\nsafe =') + LEFT_OUT, "rule 15.7: either `safe` (a deviation) or"),
        (re.sub("(?m)^(files|line) = .*\n", "", ENTRY) + LEFT_OUT, "rule 15.7: an entry names files or text"),
        (ENTRY + ENTRY.replace("15.7", "23.1") + LEFT_OUT, "rule 23.1 is not enabled"),
        (ENTRY + re.sub("reason = .*", 'reason = "-"', LEFT_OUT), "rule 15.5: left out without a reason"),
    ],
)  # fmt: skip
def test_data_that_may_not_be_so_fail(same_code: Path, text: str, message: str) -> None:
    rules(same_code, text)
    code, messages = run(same_code)
    assert code == 1
    assert [line for line in messages if message in line and line.startswith("docs/safety/misra.toml:")]


def test_every_rule_of_the_addon_has_a_category(same_code: Path) -> None:
    write(same_code, "docs/safety/misra.toml", (CATEGORIES + ENTRY + LEFT_OUT).replace('"16.4"', '"16.9"'))
    messages = run(same_code)[1]
    assert "docs/safety/misra.toml:0: rule 16.4 has no category" in messages
    assert "docs/safety/misra.toml:0: rule 16.9 is not a rule of the add-on" in messages


@pytest.mark.parametrize("text", ['unknown = "key"\n', "mandatory = [\n", '[[entry]]\nrule = "15.7"\nwhy = "so"\n'])
def test_broken_data_are_no_pass(same_code: Path, text: str) -> None:
    write(same_code, "docs/safety/misra.toml", text)
    code, messages = run(same_code)
    assert (code, messages[0][:31]) == (1, "error: docs/safety/misra.toml: ")


def test_a_page_that_is_not_made_from_the_data_fails(same_code: Path) -> None:
    rules(same_code, ENTRY + LEFT_OUT)
    write(same_code, "docs/safety/misra.md", "everything is well\n")
    assert run(same_code) == (1, ["docs/safety/misra.md:0: not made from misra.toml: run misra.py BUILD --write"])


@pytest.mark.parametrize("text", ["int x = ;\n", '#include "bus/missing.h"\n', "#error no\n", "void f(void) {\n"])
def test_a_file_that_cannot_be_read_is_no_pass(tree: Path, text: str) -> None:
    write(tree, "firmware/fx/sign.c", text)
    code, messages = run(tree)
    assert code == 1
    assert messages[0].startswith("error: ")
