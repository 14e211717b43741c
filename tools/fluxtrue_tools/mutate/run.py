# SPDX-License-Identifier: Apache-2.0
"""The outcome of each mutant of a source: it is compiled, linked into each unit test that contains the source, and run.

A unit test that compiles the source with other definitions, for example the store's with a port's number of slots, gets
an object of its own.

A mutant whose object equals that of the source, or of an earlier mutant, does not count (trivial compiler equivalence,
with the options of the build, which optimise). The time-out is in processor seconds, so that it does not depend on the
load of the computer. Outcomes are kept by the content of object and tests.
"""

import hashlib
import json
import math
import os
import signal
import subprocess
import tempfile
import threading
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.mutate.mutant import Mutant
from fluxtrue_tools.mutate.programs import Build, Program, with_object

KILLED: Final = "killed"
TIMED_OUT: Final = "timed out"
SURVIVED: Final = "survived"
EQUIVALENT: Final = "equivalent"  # the same object
DUPLICATE: Final = "duplicate"  # the same object as that of another mutant
INVALID: Final = "invalid"  # does not compile
UNTESTED: Final = "untested"  # no unit test contains the source

CPU_FACTOR: Final = 4  # of the test's own time
CPU_LEAST_S: Final = 1
HANG_S: Final = 600  # of a clock: only for a program that waits without computing
MEMORY_BYTES: Final = 2 << 30
BY_LINE: Final = ("stdbuf", "-oL")  # so that a failure is seen before the test ends
FAILURE: Final = b":FAIL"  # Unity, of a function; the others would still run
QUIETLY: Final = ("-w", "-Wno-error", "-g0")


@dataclass(frozen=True)
class Result:
    """A mutant's outcome."""

    mutant: Mutant
    outcome: str
    by: str = ""  # the test that has killed it
    content: str = ""  # hash of the object
    cpu_s: float = 0.0
    cached: bool = False

    @property
    def counts(self) -> bool:
        """Whether it is an error that a test could notice."""
        return self.outcome in (KILLED, TIMED_OUT, SURVIVED, UNTESTED)

    @property
    def found(self) -> bool:
        """Whether a test has noticed it."""
        return self.outcome in (KILLED, TIMED_OUT)


class Kept:
    """Outcomes of earlier runs: one line of JSON each, written as soon as it is known."""

    def __init__(self, path: Path, fresh: bool = False) -> None:
        self.path, self.known = path, {}
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_file() and not fresh:
            for line in path.read_text(encoding="utf-8").splitlines():
                self._read(line)

    def _read(self, line: str) -> None:
        try:
            row = json.loads(line)
            self.known[row["key"]] = row
        except (ValueError, KeyError, TypeError):
            return  # of a run that was ended while it wrote

    def get(self, key: str) -> dict[str, Any] | None:
        """What is known of a mutant."""
        return self.known.get(key)

    def put(self, key: str, **row: Any) -> None:
        """Keep an outcome."""
        self.known[key] = {"key": key, **row}
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(self.known[key]) + "\n")


def _hash(*parts: object) -> str:
    return hashlib.sha256("\0".join(map(str, parts)).encode()).hexdigest()


def _run(command: Sequence[str], folder: Path) -> tuple[bool, str, float]:
    """Whether a compiler succeeds, what it says, and its time of a processor."""
    with tempfile.TemporaryFile("w+") as log:
        process = subprocess.Popen(command, cwd=folder, stdout=log, stderr=subprocess.STDOUT)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        log.seek(0)
        return process.returncode == 0, log.read(), used.ru_utime + used.ru_stime


@dataclass
class Baseline:
    """The tests of the unchanged source: they must pass, and their time limits that of the mutants."""

    kept: Kept
    known: dict[str, float] = field(default_factory=dict)

    def cpu_s(self, program: Program) -> float:
        """Seconds of a processor that an unchanged test takes."""
        if program.key not in self.known:
            row = self.kept.get(program.key)
            if row is None:
                outcome, used = execute(program.command, program.folder, HANG_S)
                if outcome != SURVIVED:
                    raise FluxtrueError(f"{program.name} fails without a mutant: nothing can be measured with it")
                self.kept.put(program.key, name=program.name, cpu_s=round(used, 3))
                row = self.kept.get(program.key)
                assert row is not None
            self.known[program.key] = row["cpu_s"]
        return self.known[program.key]


def execute(command: Sequence[str], folder: Path, cpu_max_s: int) -> tuple[str, float]:
    """Run a test: killed with its first failure, timed out if it needs more time of a processor."""
    limits = ["prlimit", f"--cpu={cpu_max_s}", f"--as={MEMORY_BYTES}", "--core=0", f"--fsize={MEMORY_BYTES >> 4}"]
    with subprocess.Popen([*limits, *BY_LINE, *command], cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL) as process:  # fmt: skip
        hang = threading.Timer(HANG_S, os.kill, (process.pid, signal.SIGKILL))
        hang.start()
        try:
            assert process.stdout is not None
            failed = any(FAILURE in line for line in process.stdout)
            if failed:
                os.kill(process.pid, signal.SIGKILL)  # Popen.kill() might reap it
            _, status, usage = os.wait4(process.pid, 0)
        finally:
            hang.cancel()
        code = process.returncode = os.waitstatus_to_exitcode(status)
    used = usage.ru_utime + usage.ru_stime
    if code in (-signal.SIGXCPU, -signal.SIGKILL) and not failed:
        return TIMED_OUT, used
    return (SURVIVED if code == 0 else KILLED), used


class Source:
    """One source, the object that the build would make of it, and the tests that contain it."""

    def __init__(self, build: Build, file: str, work: Path, baseline: Baseline) -> None:
        self.build, self.file, self.work, self.baseline = build, file, work, baseline
        self.text = (build.root / file).read_bytes()
        self.variants = build.variants(file)
        self.tests = [program for variant in self.variants for program in variant.tests]
        made = self.compile(self.text, work / "unchanged")
        if made is None:
            raise FluxtrueError(f"{file}: does not compile")
        self.object = made[1]
        self.kills: Counter[str] = Counter()

    def compile(self, text: bytes, folder: Path) -> tuple[Path, str, float] | None:
        """The folder of a text's objects, their hash and the time of a processor; None if one does not compile."""
        folder.mkdir(parents=True, exist_ok=True)
        source = folder / Path(self.file).name
        source.write_bytes(text)
        hashes, used = [], 0.0
        for number, variant in enumerate(self.variants):
            made = folder / f"mutant{number}.o"
            # The folder's name must not be in the object, nor in its hash.
            command = [*variant.compiler, *QUIETLY, "-iquote", str((self.build.root / self.file).parent),
                       f"-ffile-prefix-map={folder}=", "-c", str(source), "-o", str(made)]  # fmt: skip
            good, _, more = _run(command, self.build.folder)
            used += more
            if not good:
                return None
            hashes.append(hashlib.sha256(made.read_bytes()).hexdigest())
        return folder, hashes[0] if len(hashes) == 1 else _hash(*hashes), used

    def ordered(self) -> list[Program]:
        """The tests, those first that have killed most so far, then by name and time."""
        return sorted(self.tests, key=lambda one: (-self.kills[one.name], self.tests.index(one)))

    def link(self, program: Program, folder: Path) -> tuple[Path, float]:
        """A test with the mutant."""
        target = folder / "program"
        number = next(n for n, variant in enumerate(self.variants) if program in variant.tests)
        objects = with_object(self.build.linker(program), folder / f"mutant{number}.o", self.variants[number].own)
        command = [*objects, "-Wl,-s", "-o", str(target)]
        good, said, used = _run(command, self.build.folder)
        if not good:
            raise FluxtrueError(f"{program.name} cannot be linked with a mutant of {self.file}: {said.strip()[-300:]}")
        return target, used

    def execute(self, program: Program, folder: Path) -> tuple[str, float]:
        """The outcome of one test."""
        target, linked_s = self.link(program, folder)
        cpu_max_s = max(CPU_LEAST_S, math.ceil(CPU_FACTOR * self.baseline.cpu_s(program)))
        outcome, used = execute([str(target), *program.command[1:]], program.folder, cpu_max_s)
        return outcome, used + linked_s


class Measurement:
    """The mutants of one source."""

    def __init__(self, source: Source, kept: Kept) -> None:
        self.source, self.kept = source, kept
        self.objects: dict[str, tuple[str, ...]] = {}  # hash: the name of the mutant that was the first to have it

    def _key(self, mutant: Mutant) -> str:
        return _hash(self.source.object, *mutant.name)

    def _known(self, mutant: Mutant) -> Result | None:
        row = self.kept.get(self._key(mutant))
        if row is None:
            return None
        tests = {one.key for one in self.source.tests}
        if row["outcome"] in (KILLED, TIMED_OUT) and row["test"] not in tests:
            return None
        if row["outcome"] in (SURVIVED, UNTESTED) and not tests <= set(row["passed"]):
            return None
        self.source.kills[row["by"]] += 1
        if row["outcome"] in (KILLED, TIMED_OUT, SURVIVED, UNTESTED):
            self.objects.setdefault(row["content"], mutant.name)
        return Result(mutant, row["outcome"], row["by"], row["content"], row["cpu_s"], cached=True)

    def one(self, mutant: Mutant) -> Result:
        """The outcome of one mutant."""
        if known := self._known(mutant):
            return known
        folder = self.source.work / _hash(*mutant.name)[:16]
        made = self.source.compile(mutant.edit.apply(self.source.text), folder)
        result, row = self._outcome(mutant, made)
        self.kept.put(self._key(mutant), outcome=result.outcome, by=result.by, content=result.content,
                      cpu_s=round(result.cpu_s, 3), **row)  # fmt: skip
        for path in folder.iterdir():
            path.unlink()
        folder.rmdir()
        return result

    def _outcome(self, mutant: Mutant, made: tuple[Path, str, float] | None) -> tuple[Result, dict[str, Any]]:
        if made is None:
            return Result(mutant, INVALID), {}
        path, content, used = made
        if content == self.source.object:
            return Result(mutant, EQUIVALENT, "", content, used), {}
        first = self.objects.setdefault(content, mutant.name)
        if first != mutant.name:
            return Result(mutant, DUPLICATE, "", content, used), {}
        passed: list[str] = []
        for program in self.source.ordered():
            outcome, more = self.source.execute(program, path)
            used += more
            if outcome != SURVIVED:
                self.source.kills[program.name] += 1
                return Result(mutant, outcome, program.name, content, used), {"test": program.key}
            passed.append(program.key)
        return Result(mutant, SURVIVED if passed else UNTESTED, "", content, used), {"passed": passed}

    def known(self, mutants: Sequence[Mutant]) -> list[Result]:
        """The outcomes that are kept."""
        return [result for mutant in mutants if (result := self._known(mutant)) is not None]

    def all(self, mutants: Sequence[Mutant], jobs: int) -> Iterator[Result]:
        """All outcomes, in the order of the mutants."""
        pool = ThreadPoolExecutor(jobs)
        try:
            yield from pool.map(self.one, mutants)
        finally:
            pool.shutdown(cancel_futures=True)  # after an error or an interruption the rest is not begun
