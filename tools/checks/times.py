# SPDX-License-Identifier: Apache-2.0
"""Time-outs of the tests: every one follows from tests/seconds.txt, by tools/cmake/TestTime.cmake.

    times.py BUILD                       check what ctest was told
    times.py BUILD --whole               the same in a build that has all tests: no time is recorded of any other
    times.py BUILD --record LOG          write down what the tests took in a whole run on an idle computer: ctest's log,
                                         which tools/test leaves in build/host-ctest.log
    times.py BUILD --record TEST ...     run these tests one by one and write down how long they take

Of a test that is run alone the processor's seconds are written down, its child processes included. They say how long it
takes on an idle computer, and can be measured on a busy one.
"""

import argparse
import json
import re
import resource
import subprocess
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from tree import PROJECT, Violation, report

SECONDS = Path("tests/seconds.txt")
FACTOR = 5  # smallest time-out as a multiple of the idle time; TestTime.cmake takes twice as much
NOTEWORTHY_S = 10
HEAD = f"""# SPDX-License-Identifier: Apache-2.0
# Seconds of the tests that take more than {NOTEWORTHY_S} s, longest first, after a whole run on an idle computer by:
# python tools/checks/times.py build/host --record build/host-ctest.log
"""
PASSED = re.compile(r"^ *\d+/\d+ Test +#\d+: (\S+) \.* *Passed +([\d.]+) sec$", re.MULTILINE)


def recorded(root: Path) -> dict[str, int]:
    """Seconds by test."""
    lines = (root / SECONDS).read_text(encoding="utf-8").splitlines()
    return {name: int(seconds) for name, seconds in (line.split() for line in lines if line and line[0] != "#")}


def described(build: Path) -> dict[str, dict[str, Any]]:
    """ctest's properties by test."""
    told = subprocess.run(["ctest", "--test-dir", str(build), "--show-only=json-v1"], capture_output=True, text=True,
                          check=True)  # fmt: skip
    tests = json.loads(told.stdout)["tests"]
    return {test["name"]: {one["name"]: one["value"] for one in test.get("properties", [])} for test in tests}


def check(root: Path, tests: dict[str, dict[str, Any]]) -> Iterator[Violation]:
    """Every test's time-out and rank."""
    seconds = recorded(root)
    for name, properties in tests.items():
        idle_s = seconds.get(name, 1)
        timeout_s = float(properties.get("TIMEOUT", 0.0))
        if timeout_s < FACTOR * max(idle_s, NOTEWORTHY_S):
            yield Violation(SECONDS, 1, f"{name}: time-out {timeout_s:g} s, wanted fluxtrue_test_time({name})")
        if float(properties.get("COST", 0.0)) != idle_s:
            yield Violation(SECONDS, 1, f"{name}: COST is not the recorded {idle_s} s, wanted fluxtrue_test_time")
        if properties.get("RUN_SERIAL"):
            yield Violation(SECONDS, 1, f"{name}: RUN_SERIAL, but no test depends on what else the computer does")


def gone(root: Path, tests: Iterable[str]) -> Iterator[Violation]:
    """Recorded times of tests that no longer exist: a test that was renamed would begin last."""
    for name in sorted(recorded(root).keys() - set(tests)):
        yield Violation(SECONDS, 1, f"{name}: no test has this name; delete its line, or write the new name")


def spent(build: Path, name: str) -> float:
    """Seconds of processor time that one test takes."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = ["ctest", "--test-dir", str(build), "--output-on-failure", "-R", f"^{name}$"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def write(root: Path, seconds: dict[str, int]) -> None:
    """The file, the longest test first."""
    rows = [
        f"{test} {s}\n" for test, s in sorted(seconds.items(), key=lambda row: (-row[1], row[0])) if s >= NOTEWORTHY_S
    ]
    (root / SECONDS).write_text(HEAD + "".join(rows), encoding="utf-8")


def record_log(root: Path, log: Path, tests: Iterable[str]) -> int:
    """Record the times in ctest's log. A time that it does not contain stays, as long as the test exists."""
    text = log.read_text(encoding="utf-8", errors="replace")
    measured = {name: round(float(seconds)) for name, seconds in PASSED.findall(text)}
    if not measured or not re.search("^100% tests passed", text, re.MULTILINE):
        sys.exit(f"error: {log} is not ctest's log of a run in which every test passed")
    known = set(tests)
    write(root, {name: s for name, s in (recorded(root) | measured).items() if name in known})
    print(f"{SECONDS}: {len(measured)} tests of {log}")
    return 0


def record(root: Path, build: Path, names: list[str]) -> int:
    """Measure the tests one by one and rewrite the file."""
    for name in names:
        measured = round(spent(build, name))
        write(root, recorded(root) | {name: measured})
        print(f"{name}: {measured} s", flush=True)
    return 0


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("build", type=Path)
    parser.add_argument("--root", type=Path, default=PROJECT)
    parser.add_argument("--whole", action="store_true", help="this build has all tests")
    parser.add_argument("--record", nargs="+", metavar="LOG|TEST")
    given = parser.parse_args()
    if given.record and Path(given.record[0]).is_file():
        return record_log(given.root, Path(given.record[0]), described(given.build))
    if given.record:
        return record(given.root, given.build, given.record)
    tests = described(given.build)
    found = list(check(given.root, tests)) + (list(gone(given.root, tests)) if given.whole else [])
    return report(found, "time-outs")


if __name__ == "__main__":
    sys.exit(main())
