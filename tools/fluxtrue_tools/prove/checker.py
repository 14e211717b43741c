# SPDX-License-Identifier: Apache-2.0
"""One run of CBMC, and its verdict, which is kept by the content that it is about.

The harness is preprocessed for the Cortex-M without DSP instructions: types and sizes are the target's, and fx uses the
portable half of its instructions (tests/target/test_fx.py compares both halves). CBMC ignores instructions by hand;
those of fx/codegen.h change no value and are removed by the preprocessor. So are static assertions, which the compilers
check: CBMC gives an enumeration the size of an int, for which some of them do not hold.
"""

import hashlib
import json
import os
import re
import resource
import shlex
import shutil
import subprocess
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.prove.data import FIRMWARE, Proof

PREPROCESSOR: Final = ("arm-none-eabi-gcc", "-mcpu=cortex-m3", "-std=c11", "-E", "-D__asm__(...)=",
                       "-D_Static_assert(...)=")  # fmt: skip
OPTIONS: Final = ("--arch", "arm", "--slice-formula")
MEMORY_BYTES: Final = 2 << 30
CPU_S: Final = 1200  # of a processor; ends what would never end
LOADER: Final = Path("usr", "lib", "x86_64-linux-gnu", "ld-linux-x86-64.so.2")
LIBRARIES: Final = (Path("usr", "lib", "x86_64-linux-gnu"), Path("usr", "lib"))
_FAILED: Final = re.compile(r"^\[(\S+)\] (?:file \S+ )?(?:line \d+ )?(.*): FAILURE$", re.MULTILINE)
_VIOLATED: Final = re.compile(r"^Violated property:\n +(.*)\n +(.*)$", re.MULTILINE)
_UNWINDING: Final = re.compile("unwinding assertion|recursion unwinding")


class NoVerdict(Exception):
    """CBMC did not come to an end: out of time or memory, or it does not accept the source."""


@dataclass(frozen=True)
class Verdict:
    """What CBMC found."""

    proved: bool
    failed: tuple[str, ...]
    seconds: float
    megabytes: int
    cached: bool = False

    @property
    def refuted(self) -> bool:
        """A property fails, not merely the number of loop iterations."""
        return any(not _UNWINDING.search(text) for text in self.failed)


class Checker:
    """CBMC of a build folder (tools/setup unpacks it there) and its kept verdicts."""

    def __init__(self, root: Path, build: Path, fresh: bool = False, seconds: int = CPU_S) -> None:
        self.root, self.kept, self.fresh, self.seconds = root, build / "proofs", fresh, seconds
        self.home = build / "cbmc"
        stamp = self.home / "stamp"
        if not stamp.is_file():
            raise FluxtrueError(
                f"no CBMC in {self.home}: nothing can be proved; run tools/setup, which unpacks it there"
            )
        self.version = stamp.read_text(encoding="utf-8").strip()

    def preprocess(self, proof: Proof, planted: bool) -> str:
        """The translation unit, with or without the planted error."""
        folders = [self.root / FIRMWARE, self.root / "tests" / "proof", self.root, _generated(self.root)]
        if planted:
            overlay = self.kept / "planted" / proof.name
            shutil.rmtree(overlay, ignore_errors=True)  # of an earlier error, in another file
            copy = overlay / proof.planted.file
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_text(proof.planted.apply(self.root), encoding="utf-8")
            folders.insert(0, overlay)
        command = [*PREPROCESSOR, *(f"-I{folder}" for folder in folders), str(self.root / proof.source)]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if run.returncode != 0:
            raise FluxtrueError(f"{proof.source}: {run.stderr.strip()[-400:]}")
        return run.stdout

    def check(self, proof: Proof, planted: bool = False) -> Verdict:
        """The verdict: the kept one if nothing has changed, else of a run."""
        text = self.preprocess(proof, planted)
        content = "\n".join(line for line in text.splitlines() if line and not line.startswith("# "))
        if planted and content == self._content(proof):
            raise FluxtrueError(f"proof {proof.name}: the planted error is not in what the harness compiles")
        options = [*OPTIONS, "--function", f"proof_{proof.name}", *proof.options]
        options += ["--stop-on-fail"] if planted else []
        key = hashlib.sha256("\0".join([self.version, *options, content]).encode()).hexdigest()
        kept = self.kept / f"{key}.json"
        if kept.is_file() and not self.fresh:
            known = json.loads(kept.read_text(encoding="utf-8"))
            return Verdict(known["proved"], tuple(known["failed"]), known["seconds"], known["megabytes"], cached=True)
        verdict = self._run(proof, text, options)
        kept.parent.mkdir(parents=True, exist_ok=True)
        part = kept.with_suffix(f".{os.getpid()}")
        part.write_text(json.dumps(asdict(verdict)), encoding="utf-8")
        part.replace(kept)
        return verdict

    def _content(self, proof: Proof) -> str:
        lines = self.preprocess(proof, planted=False).splitlines()
        return "\n".join(line for line in lines if line and not line.startswith("# "))

    def _run(self, proof: Proof, text: str, options: list[str]) -> Verdict:
        unit = self.kept / "units" / f"{proof.name}.{os.getpid()}.i"
        unit.parent.mkdir(parents=True, exist_ok=True)
        unit.write_text(text, encoding="utf-8")
        limits = ["prlimit", f"--as={MEMORY_BYTES}", f"--cpu={self.seconds}"]
        command = [*limits, *self._started("cbmc"), *options, str(unit)]
        environment = os.environ | {"PATH": f"{self._solvers()}:{os.environ['PATH']}"}
        with (self.kept / "units" / f"{proof.name}.{os.getpid()}.log").open("w+", encoding="utf-8") as log:
            process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, env=environment)
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            log.seek(0)
            said = log.read()
        Path(log.name).unlink()
        unit.unlink()
        return _evaluate(process.returncode, said, used)

    def _started(self, program: str) -> list[str]:
        """A program of the package, with the libraries beside it."""
        path = ":".join(str(self.home / folder) for folder in LIBRARIES)
        return [str(self.home / LOADER), "--library-path", path, str(self.home / "usr" / "bin" / program)]

    def _solvers(self) -> Path:
        """A folder for PATH in which CBMC finds the other solver."""
        script = self.kept / "bin" / "z3"
        if not script.is_file():
            script.parent.mkdir(parents=True, exist_ok=True)
            part = script.with_suffix(f".{os.getpid()}")
            part.write_text(f'#!/bin/sh\nexec {shlex.join(self._started("z3"))} "$@"\n', encoding="utf-8")
            part.chmod(0o755)
            part.replace(script)
        return script.parent


def _evaluate(code: int, said: str, used: resource.struct_rusage) -> Verdict:
    failed = [f"{name}: {text}" for name, text in _FAILED.findall(said)]
    failed += [f"{place}: {text}" for place, text in _VIOLATED.findall(said)]
    proved = code == 0 and "VERIFICATION SUCCESSFUL" in said and not failed
    if not proved and not (code == 10 and "VERIFICATION FAILED" in said and failed):
        raise NoVerdict(f"CBMC ended with {code} and no verdict: {said.strip()[-300:]}")
    return Verdict(proved, tuple(failed), round(used.ru_utime + used.ru_stime, 2), used.ru_maxrss >> 10)


def _generated(root: Path) -> Path:
    """Sources that the build writes: of the build that the test belongs to, else of build/host."""
    return Path(os.environ.get("FLUXTRUE_BUILD_DIR", root / "build" / "host")) / "generated"
