# SPDX-License-Identifier: Apache-2.0
"""The coverage gate finds code that no test reaches, and refuses an exclusion without a reason."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

CHECKER = Path(__file__).resolve().parents[2] / "tools" / "checks" / "coverage.py"
REASON = "the compiler needs a value here"


def check(root: Path, *arguments: str | Path) -> tuple[int, str, str]:
    """Exit code, standard output, error output."""
    done = subprocess.run([sys.executable, CHECKER, "--root", root, *arguments], capture_output=True, text=True,
                          check=False)  # fmt: skip
    assert "Traceback" not in done.stderr
    return done.returncode, done.stdout, done.stderr


def write(root: Path, name: str, *text: str) -> None:
    """A source file."""
    (root / name).parent.mkdir(parents=True, exist_ok=True)
    (root / name).write_text("\n".join(text) + "\n")


def test_an_exclusion_with_its_reason_is_listed(tmp_path: Path) -> None:
    write(tmp_path, "firmware/fx/a.c", "int x;", f"int y; /* GCOVR_EXCL_LINE: {REASON} */")
    write(tmp_path, "firmware/ecu/b.h", f"int z; /* GCOVR_EXCL_BR_LINE: {REASON} */",
          f"/* GCOVR_EXCL_START: {REASON} */", "int u;", "/* GCOVR_EXCL_STOP */")  # fmt: skip
    code, printed, _ = check(tmp_path)
    assert code == 0
    assert "3 exclusions" in printed
    for place in ("firmware/fx/a.c:2", "firmware/ecu/b.h:1", "firmware/ecu/b.h:2-4"):
        assert f"{place}: {REASON}" in printed


@pytest.mark.parametrize(
    "marker",
    [
        "/* GCOVR_EXCL_LINE */",
        "/* GCOVR_EXCL_LINE: */",
        "/* GCOVR_EXCL_LINE: cannot be reached */",
        f"// GCOVR_EXCL_LINE: {REASON}",
        f"/* LCOV_EXCL_LINE: {REASON} */",
        f"/* GCOV_EXCL_BR_LINE: {REASON} */",
        "/* GCOVR_EXCL_BR_WITHOUT_HIT: 1/2 */",
        f"/* GCOVR_EXCL_FUNCTION: {REASON} */",
        f"/* GCOVR_EXCL_START: {REASON} */",
        "/* GCOVR_EXCL_STOP */",
    ],
)
def test_an_exclusion_without_a_reason_or_in_another_form_is_refused(tmp_path: Path, marker: str) -> None:
    write(tmp_path, "firmware/safety/a.c", f"int x; {marker}")
    code, printed, complaint = check(tmp_path)
    assert code == 1
    assert "0 exclusions" in printed
    assert complaint.startswith("firmware/safety/a.c:1: ")


def test_an_exclusion_where_nothing_is_measured_is_refused(tmp_path: Path) -> None:
    write(tmp_path, "firmware/drive/a.c", f"int x; /* GCOVR_EXCL_LINE: {REASON} */")
    assert check(tmp_path)[0] == 1


SOURCE = ["int both(int a, int b)", "{", "    return a > 0 && b > 0;", "}"]


def report_of(root: Path, lines: list[dict]) -> Path:
    """Write a report as gcovr would write it for SOURCE."""
    write(root, "firmware/fx/a.c", *SOURCE)
    path = root / "coverage.json"
    path.write_text(json.dumps({"files": [{"file": "firmware/fx/a.c", "lines": lines}]}))
    return path


def line(number: int, count: int, *branches: int, excluded: bool = False) -> dict:
    """One line of a report."""
    return {"line_number": number, "count": count, "gcovr/excluded": excluded,
            "branches": [{"count": taken} for taken in branches]}  # fmt: skip


def test_a_report_without_gaps_passes(tmp_path: Path) -> None:
    report = report_of(tmp_path, [line(1, 9), line(3, 9, 5, 4, 3, 2), line(4, 9)])
    code, printed, _ = check(tmp_path, "--report", report)
    assert code == 0
    assert "3 of     3 lines" in printed
    assert "4 of     4 branches" in printed


@pytest.mark.parametrize(
    ("gap", "complaint"),
    [
        (line(3, 0), "firmware/fx/a.c:3: never reached: return a > 0 && b > 0;"),
        (line(3, 9, 5, 4, 5, 0), "firmware/fx/a.c:3: branches taken 3 of 4: return a > 0 && b > 0;"),
    ],
)
def test_one_line_or_one_branch_less_than_all_fails(tmp_path: Path, gap: dict, complaint: str) -> None:
    report = report_of(tmp_path, [line(1, 9), gap, line(4, 9)])
    assert check(tmp_path, "--report", report)[::2] == (1, complaint + "\n")


def test_an_excluded_line_needs_no_test(tmp_path: Path) -> None:
    report = report_of(tmp_path, [line(1, 9), line(3, 0, 0, excluded=True), line(4, 9)])
    assert check(tmp_path, "--report", report)[0] == 0


def test_a_function_that_no_test_has_is_missed_although_the_report_has_no_gap(tmp_path: Path) -> None:
    report = report_of(tmp_path, [line(1, 9), line(3, 9), line(4, 9)])
    write(tmp_path, "firmware/signal/unused.h", "static inline int one(void)", "{", "    return 1;", "}")
    code, _, complaint = check(tmp_path, "--report", report)
    assert code == 1
    assert complaint.startswith("firmware/signal/unused.h:1: one: no test has it")
    write(tmp_path, "firmware/signal/unused.h", f"/* GCOVR_EXCL_START: {REASON} */", "static inline int one(void)", "{",
          "    return 1;", "}", "/* GCOVR_EXCL_STOP */")  # fmt: skip
    assert check(tmp_path, "--report", report)[0] == 0


PROGRAM = [
    "static inline int outside(unsigned n)",
    "{",
    "    if (n == 0U || n > 31U) {",
    "        return 1;",
    "    }",
    "    return 0;",
    "}",
]


def built(root: Path, *optimised: str) -> Path:
    """Compile two objects with the same inline function, run them, and return gcovr's report.

    n > 31 is never true, so that one of the four branches is not taken.
    """
    build = root / "build"
    build.mkdir(exist_ok=True)
    write(root, "firmware/fx/range.h", *PROGRAM)
    for name, calls in (("one", "outside(0) + outside(n)"), ("two", "outside(n)")):
        write(root, f"firmware/fx/{name}.c", '#include "range.h"', "static volatile unsigned n = 1;",
              f"int {name}(void);", f"int {name}(void)", "{", f"    return {calls};", "}")  # fmt: skip
    write(
        root, "main.c", "int one(void);", "int two(void);", "int main(void)", "{", "    return one() + two() - 1;", "}"
    )
    for name in ("one", "two"):
        flags = optimised if name == "two" else ()
        command = ["gcc", "--coverage", "-O0", *flags, "-c", f"../firmware/fx/{name}.c", "-o", f"{name}.o"]
        subprocess.run(command, cwd=build, check=True)
    subprocess.run(["gcc", "--coverage", "../main.c", "one.o", "two.o", "-o", "main"], cwd=build, check=True)
    subprocess.run([build / "main"], cwd=build, check=True)
    report = root / "coverage.json"
    counts = [str(path) for path in build.glob("*.gcda")]
    subprocess.run([sys.executable, "-m", "gcovr", "--root", ".", "--object-directory", "build", "--json", report,
                    "--filter", "firmware/", *counts], cwd=root, capture_output=True, check=True)  # fmt: skip
    return report


def test_the_gate_reads_what_compiler_and_gcovr_write(tmp_path: Path) -> None:
    report = built(tmp_path)
    code, _, complaint = check(tmp_path, "--report", report, "--build", tmp_path / "build")
    assert code == 1
    assert complaint == "firmware/fx/range.h:3: branches taken 3 of 4: if (n == 0U || n > 31U) {\n"


def test_an_inline_function_with_other_branches_in_another_object_is_refused(tmp_path: Path) -> None:
    """An optimised object has two branches where the other one has four: the sum of their counts means nothing."""
    report = built(tmp_path, "-O3")
    code, _, complaint = check(tmp_path, "--report", report, "--build", tmp_path / "build")
    assert code == 1
    assert "firmware/fx/range.h:3: not the same branches in all objects" in complaint
