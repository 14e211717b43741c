# SPDX-License-Identifier: Apache-2.0
"""What the compiled layers contain: no mutable state; on the target no float and no division.

Two drives can run in one process only if no layer below drive/ owns a variable; a float or a
division in an interrupt is an unintended cost. The compiler's output shows both exactly.
The library for the target must need nothing from outside but the port.
"""

import argparse
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tree import Violation, report

LAYERS = ("fx", "signal", "control", "safety", "second_level")
# Number of divide instructions that a file may contain. Each is bounded and tested; another one is an error.
DIVISIONS = {
    "div.c": 2,  # all at 1 kHz
    "current_reference.c": 1,
    "launch_power.c": 1,  # 1 kHz, when a reference that moves slowly has moved by i_0
    "identify.c": 1,
    "schedule.c": 1,
    "capture.c": 2,  # 1 kHz, armed: rows of a step, and the place of the first
    "trigger.c": 1,  # 1 kHz, when the trigger is found
    "turning_modulate.c": 1,  # the knee, where the field turns far
    "current_control.c": 2,  # reciprocal of the measured dc voltage; 1 kHz: share of the turn left to the setpoint
    "e2e.c": 2,  # 1 kHz: the counter's turn
    "frames.c": 1,  # the same in the second level
    "own_torque.c": 1,  # 1 kHz, second level: a fifth of the torque
    "kalman.c": 1,  # 100 Hz and axis
    "model.c": 2,  # 1 kHz: torque of the period
    "torque_estimate.c": 1,  # 1 kHz: the mean over the periods since
    "dead_time_trim.c": 1,  # 1 kHz: by the measured dc voltage
}
# Layers of the 1 kHz task: single precision is allowed but in these files.
NO_FILE = re.compile(r"(?!)")
TASK_LAYERS = {
    "comm": re.compile(r"^e2e\.c"),
    "drive": re.compile(r"(_isr|acquire|publish|mailbox)\.c"),
    "storage": NO_FILE,
    "scope": re.compile(r""),
    "calibration": NO_FILE,
    "ecu": NO_FILE,
}

MUTABLE = re.compile(r"^(\.data(?!\.rel\.ro)|\.bss|\.tdata|\.tbss|\*COM\*)")
SYMBOL = re.compile(r"^[0-9a-f]+ .{7} (\S+)\t([0-9a-f]+)\s+(\S+)$")
MEMBER = re.compile(r"^(\S+):\s+file format ")
INSTRUCTION = re.compile(r"^\s*[0-9a-f]+:\s+(?:[0-9a-f]{4,8} ?)+\s+(\S+)")
RELOCATION = re.compile(r"^\s*[0-9a-f]+:\s+R_ARM_\S+\s+(\S+)")
FUNCTION = re.compile(r"^[0-9a-f]+ <(\S+)>:")
DIVIDES = re.compile(r"[su]div")
DIVISION_CALL = re.compile(r"__aeabi_u?[il]div|__u?(div|mod)[ds]i")
FLOATS = re.compile(r"v[a-z]")
FLOAT_CALL = re.compile(r"__aeabi_(f|d|i2|ui2|l2|ul2)|(sqrt|sin|cos|tan|atan2?|pow|exp|log|floor|ceil|fabs)f?$")
# The port's functions, what gcc emits calls to on its own, and the rounding of the bus's encoders (1 kHz task).
FROM_OUTSIDE = re.compile(r"hal_\w+$|mem(cpy|set|move|cmp)$|__aeabi_\w+$|roundf$")


def output(*command: str) -> list[str]:
    """Lines printed by a binary utility."""
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()


def member_name(raw: str) -> str:
    """The source file of an object: div.c for div.c.obj and for div.c.o."""
    return re.sub(r"\.o(bj)?$", "", raw)


def mutable_state(archive: Path, prefix: str) -> Iterator[Violation]:
    """Variables in writable sections."""
    member = ""
    for line in output(prefix + "objdump", "-t", str(archive)):
        if match := MEMBER.match(line):
            member = member_name(match.group(1))
        elif match := SYMBOL.match(line):
            section, size, name = match.groups()
            is_marker = name.startswith("$") or name == section
            if MUTABLE.match(section) and int(size, 16) > 0 and not is_marker:
                yield Violation(Path(archive.name, member), 0,
                                f"'{name}' is a variable; state belongs to the caller")  # fmt: skip


def cost(line: str) -> tuple[bool, str]:
    """Whether a line of the listing divides, and the floating-point name in it if there is one."""
    if match := INSTRUCTION.match(line):
        name = match.group(1)
        return bool(DIVIDES.match(name)), name if FLOATS.match(name) else ""
    if match := RELOCATION.match(line):
        name = match.group(1)
        return bool(DIVISION_CALL.match(name)), name if FLOAT_CALL.match(name) else ""
    return False, ""


def costly_code(archive: Path, prefix: str, members: re.Pattern[str]) -> Iterator[Violation]:
    """Divisions and floating point, in the code and among the functions it calls."""
    member = function = ""
    divisions: Counter[str] = Counter()
    for line in output(prefix + "objdump", "-dr", str(archive)):
        if match := MEMBER.match(line):
            member = member_name(match.group(1))
        elif match := FUNCTION.match(line):
            function = match.group(1)
        elif members.search(member):
            divides, name = cost(line)
            divisions[member] += divides
            if name:
                yield Violation(Path(archive.name, member), 0,
                                f"floating point in {function}: {name}")  # fmt: skip
    for member, count in divisions.items():
        if count > DIVISIONS.get(member, 0):
            yield Violation(Path(archive.name, member), 0,
                            f"{count} divisions, at most {DIVISIONS.get(member, 0)}")  # fmt: skip


def unresolved(archive: Path, prefix: str) -> Iterator[Violation]:
    """Symbols the whole library needs from outside, other than the port's and the compiler's."""
    needed: dict[str, str] = {}
    defined: set[str] = set()
    member = ""
    for line in output(prefix + "nm", "-f", "posix", str(archive)):
        if line.endswith("]:"):
            member = member_name(line.rpartition("[")[2].rstrip("]:"))
            continue
        name, kind, *_ = line.split()
        if kind == "U":
            needed.setdefault(name, member)
        else:
            defined.add(name)
    for name in sorted(needed.keys() - defined):
        if not FROM_OUTSIDE.match(name):
            yield Violation(Path(archive.name, needed[name]), 0, f"no definition of '{name}'")


def check(build: Path, target: bool) -> Iterator[Violation]:
    """All layers of one build folder."""
    prefix = "arm-none-eabi-" if target else ""
    found = 0
    for layer in (*LAYERS, *TASK_LAYERS):
        archive = build / "firmware" / f"libfluxtrue_{layer}.a"
        if not archive.exists():
            continue
        found += 1
        if layer in (*LAYERS, "comm"):
            yield from mutable_state(archive, prefix)
        if target:
            yield from costly_code(archive, prefix, TASK_LAYERS.get(layer, re.compile("")))
    whole = build / "libfluxtrue.a"
    if target and whole.exists():
        yield from unresolved(whole, prefix)
    if found == 0:
        yield Violation(build, 0, "no compiled layer here: build it first")


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description="contents of the compiled layers")
    parser.add_argument("build", type=Path)
    parser.add_argument("--target", action="store_true", help="an Arm build: no float, no division")
    arguments = parser.parse_args()
    return report(check(arguments.build, arguments.target), "compiled layers")


if __name__ == "__main__":
    sys.exit(main())
