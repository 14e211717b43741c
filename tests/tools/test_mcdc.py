# SPDX-License-Identifier: Apache-2.0
"""The report of MC/DC finds a condition whose effect no test shows, and refuses an exclusion without a reason.

The programs are compiled with the clang that measures the firmware, and run. Without that clang, which tools/test does
not install, the checker reads recordings of what it printed. With it, recording and output must be the same;
FLUXTRUE_RECORD_MCDC=1 adds the recording of sources that have none.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parents[2]
CHECKER = PROJECT / "tools" / "checks" / "mcdc.py"
sys.path.insert(0, str(CHECKER.parent))
from mcdc import LLVM, MAPPING, PARTS, page_rows, reports  # noqa: E402

RECORDED = Path(__file__).with_name("mcdc_recorded.json")
RECORD = "FLUXTRUE_RECORD_MCDC"
ANY_ROOT = "@root@"
SOURCES = ("firmware/safety/both.c",)
REASON = "the caller has checked this already"
BOTH = ["int both(int a, int b);", "int both(int a, int b)", "{", "    return a > 0 && b > 0;", "}"]
Run = Callable[..., Path]
GAP = "firmware/safety/both.c:4: C2 not shown: b > 0"


def check(root: Path, *arguments: str | Path) -> tuple[int, str, list[str]]:
    """Exit code, standard output, lines of the error output."""
    done = subprocess.run([sys.executable, CHECKER, "--root", root, *arguments], capture_output=True, text=True,
                          check=False)  # fmt: skip
    assert "Traceback" not in done.stderr
    return done.returncode, done.stdout, done.stderr.splitlines()


def write(root: Path, name: str, *text: str) -> None:
    """A source file."""
    (root / name).parent.mkdir(parents=True, exist_ok=True)
    (root / name).write_text("\n".join(text) + "\n")


def sources_of(root: Path) -> dict[str, str]:
    """All C sources and headers of the checkout, by name."""
    names = [path.relative_to(root) for path in sorted(root.rglob("*.[ch]"))]
    return {name.as_posix(): (root / name).read_text() for name in names if name.parts[0] != "build"}


def recording(sources: dict[str, str]) -> list[str] | None:
    """What llvm-cov has printed of the programs of these sources."""
    recorded = json.loads(RECORDED.read_text()) if RECORDED.exists() else []
    found = [one["printed"] for one in recorded if one["sources"] == {k: t.splitlines() for k, t in sources.items()}]
    return ["\n".join(printed) + "\n" for printed in found[0]] if found else None


def record(sources: dict[str, str], printed: list[str]) -> None:
    """Add a recording."""
    recorded = json.loads(RECORDED.read_text()) if RECORDED.exists() else []
    recorded.append({"sources": {name: text.splitlines() for name, text in sources.items()},
                     "printed": [text.splitlines() for text in printed]})  # fmt: skip
    RECORDED.write_text(json.dumps(recorded, indent=1) + "\n")


def write_mains(root: Path, bodies: tuple[str, ...]) -> list[Path]:
    """A program's main for each body, and the build folder's list of tests; the programs."""
    build = root / "build"
    (build / "mcdc").mkdir(parents=True)
    programs = [build / f"program{number}" for number in range(len(bodies))]
    for number, body in enumerate(bodies):
        write(root, f"main{number}.c", '#include "main.h"', "int main(void)", "{", f"    {body}", "    return 0;", "}")
    write(build, "CTestTestfile.cmake",
          *[f'add_test({program.name} "{program}")\nset_tests_properties({program.name} PROPERTIES LABELS coverage)'
            for program in programs])  # fmt: skip
    return programs


def run_recorded(root: Path, *bodies: str, sources: tuple[str, ...] = SOURCES) -> Path:
    """A build folder in which llvm-cov prints its recording."""
    del sources  # they are in the recording
    programs, folder = write_mains(root, bodies), root / "build" / LLVM.relative_to("build")
    printed = recording(sources_of(root)) if bodies else []
    assert printed is not None, f"no recording of these sources: {RECORD}=1 and clang 19 (tools/setup mcdc) make it"
    folder.mkdir(parents=True)
    for name, text in (("llvm-profdata", "exit 0"), ("llvm-cov", 'for last; do :; done; cat "$last.printed"')):
        (folder / name).write_text(f"#!/bin/sh\n{text}\n")
        (folder / name).chmod(0o755)
    for program, text in zip(programs, printed, strict=True):
        program.write_bytes(MAPPING)
        Path(f"{program}.printed").write_text(text.replace(ANY_ROOT, str(root)))
        write(root / "build", f"mcdc/{program.name}.profraw")
    return root / "build"


def run_real(root: Path, *bodies: str, sources: tuple[str, ...] = SOURCES) -> Path:
    """Build programs with these bodies of main as the preset host-mcdc does, run them, and return the build folder."""
    programs, build = write_mains(root, bodies), root / "build"
    (build / "clang").symlink_to(PROJECT / "build" / "clang")
    flags = ["-fprofile-instr-generate", "-fcoverage-mapping", "-fcoverage-mcdc", f"-I{root}"]
    for number, program in enumerate(programs):
        command = [root / LLVM / "clang", *flags, f"main{number}.c", *sources, "-o", program]
        subprocess.run(command, cwd=root, check=True)
        subprocess.run([program], check=True, env={**os.environ, "LLVM_PROFILE_FILE": f"{build}/mcdc/%p.profraw"})
    if bodies:
        with tempfile.TemporaryDirectory() as scratch:
            counts = sorted((build / "mcdc").glob("*.profraw"))
            printed = [text.replace(str(root), ANY_ROOT) for text in reports(root, counts, programs, Path(scratch))]
        if RECORD in os.environ and recording(sources_of(root)) is None:
            record(sources_of(root), printed)
        assert recording(sources_of(root)) == printed, "the recording is not what this clang prints"
    return build


@pytest.fixture(params=["recorded", "real"])
def run(request: pytest.FixtureRequest) -> Run:
    """Run programs with these bodies of main: as recorded, or by the clang that measures the firmware."""
    if request.param == "recorded":
        return run_recorded
    if not (PROJECT / LLVM / "clang").exists():
        pytest.skip("no clang 19, which tools/setup mcdc unpacks; tools/mcdc runs this test")
    return run_real


@pytest.fixture
def both(tmp_path: Path) -> Path:
    """A checkout with one function of safety, in which one decision has two conditions."""
    write(tmp_path, "firmware/safety/both.c", *BOTH)
    write(tmp_path, "main.h", "int both(int a, int b);")
    return tmp_path


def test_a_condition_without_a_test_is_found_although_each_outcome_was_executed(both: Path, run: Run) -> None:
    code, printed, complaints = check(both, "--build", run(both, "both(1, 1); both(0, 1);"))
    assert (code, complaints) == (1, [GAP])
    assert "safety             1 of          2     50.0     100" in printed


def test_three_combinations_show_two_conditions(both: Path, run: Run) -> None:
    code, printed, complaints = check(both, "--build", run(both, "both(1, 1); both(0, 1); both(1, 0);"))
    assert (code, complaints) == (0, [])
    assert "safety             2 of          2    100.0     100" in printed


def test_the_combinations_of_several_programs_count_together(both: Path, run: Run) -> None:
    assert check(both, "--build", run(both, "both(1, 1);", "both(0, 1); both(1, 0);"))[0] == 0


def test_the_combinations_of_an_inline_function_count_over_all_objects(tmp_path: Path, run: Run) -> None:
    write(tmp_path, "firmware/fx/both.h", "static inline int both(int a, int b)", *BOTH[2:])
    write(tmp_path, "main.h", '#include "firmware/fx/both.h"')
    build = run(tmp_path, "both(1, 1);", "both(0, 1); both(1, 0);", sources=())
    assert check(tmp_path, "--build", build)[0] == 0


def test_the_report_of_a_part_says_what_was_executed(both: Path, run: Run) -> None:
    build = run(both, "both(1, 1); both(0, 1);")
    assert check(both, "--build", build, "--part", "safety")[2] == [f"{GAP}; executed: F-=F, TT=T"]
    assert check(both, "--build", build, "--part", "ecu")[2] == []


@pytest.mark.parametrize("alone", [False, True])
def test_an_exclusion_takes_its_condition_out_of_the_count_and_is_listed(both: Path, alone: bool, run: Run) -> None:
    marker = f"/* MCDC_EXCL C2: {REASON} */"
    changed = [marker, BOTH[3]] if alone else [f"{BOTH[3]} {marker}"]
    write(both, "firmware/safety/both.c", *BOTH[:3], *changed, BOTH[4])
    code, printed, _ = check(both, "--build", run(both, "both(1, 1); both(0, 1);"))
    assert code == 0
    assert f"C2 {REASON}" in printed
    assert "safety             1 of          1    100.0     100         1" in printed


@pytest.mark.parametrize(
    ("condition", "complaint"), [("C1", "C1 is excluded, but a test shows it"), ("C3", "C3 is excluded, but there is")]
)
def test_an_exclusion_that_is_not_needed_is_refused(both: Path, condition: str, complaint: str, run: Run) -> None:
    write(both, "firmware/safety/both.c", *BOTH[:3], f"{BOTH[3]} /* MCDC_EXCL {condition}: {REASON} */", BOTH[4])
    code, _, complaints = check(both, "--build", run(both, "both(1, 1); both(0, 1); both(1, 0);"))
    assert code == 1
    assert complaint in complaints[0]


def test_a_decision_that_clang_does_not_measure_is_found(both: Path, run: Run) -> None:
    write(both, "firmware/safety/both.c", *BOTH[:3], "    return a > 0 && both(-1, a > 1 || b > 1);", BOTH[4])
    code, _, complaints = check(both, "--build", run(both, "both(1, 1);"))
    assert code == 1
    assert complaints == ["firmware/safety/both.c:4: &&: no decision that clang measures has it",
                          "firmware/safety/both.c:4: ||: no decision that clang measures has it"]  # fmt: skip


def test_a_file_that_no_program_is_built_from_is_found(both: Path, run: Run) -> None:
    write(both, "firmware/ecu/other.c", "#if A && B /* a && b */", "#endif", "int c(int a)", "{",
          "    return a < 0 || a > 3; // a || b", "}")  # fmt: skip
    code, _, complaints = check(both, "--build", run(both, "both(1, 1); both(0, 1); both(1, 0);"))
    assert (code, complaints) == (1, ["firmware/ecu/other.c:5: ||: no decision that clang measures has it"])


@pytest.mark.parametrize(
    "marker",
    ["/* MCDC_EXCL */", "/* MCDC_EXCL C1: */", "/* MCDC_EXCL C1: cannot be shown */", f"/* MCDC_EXCL 1: {REASON} */",
     f"// MCDC_EXCL C1: {REASON}"],
)  # fmt: skip
def test_an_exclusion_without_a_reason_or_in_another_form_is_refused(tmp_path: Path, marker: str) -> None:
    write(tmp_path, "firmware/safety/a.c", f"int x; {marker}")
    code, printed, complaints = check(tmp_path)
    assert code == 1
    assert "0 exclusions" in printed
    assert complaints[0].startswith("firmware/safety/a.c:1: ")


def test_a_file_that_no_part_has_is_named_once(both: Path, run: Run) -> None:
    """An exclusion or a decision in a new folder, for which PARTS does not say what must be shown."""
    (both / "firmware/safety/both.c").unlink()
    write(both, "firmware/new/both.c", *BOTH[:3], f"{BOTH[3]} /* MCDC_EXCL C2: {REASON} */", BOTH[4])
    write(both, "docs/safety/mcdc.md", "| safety | 0 | 0 |")
    complaint = "firmware/new/both.c:1: no part has this file: name its folder in PARTS of tools/checks/mcdc.py"
    assert check(both)[::2] == (1, [complaint])
    (both / "docs/safety/mcdc.md").unlink()
    build = run(both, "both(1, 1); both(0, 1);", sources=("firmware/new/both.c",))
    assert check(both, "--build", build)[::2] == (1, [complaint])


def test_a_count_of_the_page_that_was_not_measured_is_found(both: Path, run: Run) -> None:
    build = run(both, "both(1, 1); both(0, 1); both(1, 0);")
    page = "\n".join(page_rows({name: [0, 0, 0] for name, _, _ in PARTS} | {"safety": [2, 2, 0]}, 1))
    write(both, "docs/safety/mcdc.md", page)
    assert check(both, "--build", build)[0] == 0
    write(both, "docs/safety/mcdc.md", page.replace("safety | 2", "safety | 3").replace("in 1 ", "in 4 "))
    assert check(both, "--build", build)[2] == [
        "docs/safety/mcdc.md:1: no row '| safety | 2 | 0 |', which was measured",
        "docs/safety/mcdc.md:1: no row '| all, in 1 decisions | 2 | 0 |', which was measured",
    ]


def test_a_number_of_exclusions_of_the_page_is_compared_without_the_measurement(both: Path) -> None:
    write(both, "firmware/safety/both.c", *BOTH[:3], f"{BOTH[3]} /* MCDC_EXCL C1,C2: {REASON} */", BOTH[4])
    write(both, "docs/safety/mcdc.md", "| safety | 0 | 2 |", "| all, in 1 decisions | 0 | 2 |")
    assert check(both)[0] == 0
    write(both, "docs/safety/mcdc.md", "| safety | 1 | 1 |")
    assert check(both)[2] == ["docs/safety/mcdc.md:1: safety: 1 excluded, the sources exclude 2"]


def test_without_counts_the_report_says_what_writes_them(both: Path, run: Run) -> None:
    build = run(both)
    code, _, complaints = check(both, "--build", build)
    assert code == 1
    assert "tools/mcdc runs the tests that write them" in complaints[0]
