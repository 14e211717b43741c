# SPDX-License-Identifier: Apache-2.0
"""A fault of the core at 9500 rpm: its handler opens the bridge and resets, and the safe state follows.

In the fast ISR, in the task, and in three places of the start after a reset: the short circuit is there again within 2
ms, because the copies of the state outlast a second reset, too. The clock of a converter that is lost is a bus fault;
elsewhere an undefined instruction takes the place of a function's first one until the core has faulted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
import resets
from planting import PlantedError, assert_found

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.bench.image import Stand
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.sim.library import Loop

HARD_FAULT, FAST, TASK, THREAD = 3, 16 + 39, 16 + 48, 0
UNDEFINED = b"\x00\xde"  # udf #0
SOFTWARE, LOCK_UP = resets.KINDS["software"], resets.KINDS["lockup"]
STEP_S = 2e-7
REACHED_S = 0.02  # every place below is reached within this time
OPEN_S = 2e-6  # from the fault to the reset; emulated time
AGAIN_MS = 2.0
SRAMU_RETEN = 20  # SIM_CHIPCTL
COPIES_READ_S = 1e-3  # after a reset
UNKEPT_S = 10e-6  # measured: docs/theory/safe-state.md
SAFE_STATE = 6  # of port C, hal/s32k144/pins.h
LOWER, NO_OUTPUTS = 0b10_1010, 0
VDC_SHARE = 1.2


@dataclass(frozen=True)
class Reaction:
    """Where the core was (vector), what the bridge did until then, the time from the fault to the reset, and what the
    reset says."""

    vector: int
    outputs_before: int
    seconds: float
    cause: int


@pytest.fixture(scope="module")
def parts() -> Parts:
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    return build.prepare("hsm1", flashed=True)


@contextmanager
def at_speed(parts: Parts) -> Iterator[tuple[Loop, Stand]]:
    """A drive with 60 N.m whose core takes its faults."""
    loop, stand = resets.powered_up(parts)
    with loop:
        stand.run(60, TorqueRequested=60.0)
        stand.core.take_faults()
        yield loop, stand


def reaction(stand: Stand) -> Reaction:
    """Run until the core has faulted and reset."""
    core, active, faulted = stand.core, [THREAD], [0.0]
    victim, before, begin_s, count = THREAD, core.outputs, core.now_s, core.resets

    def note(vector: int, entered: bool) -> None:
        nonlocal victim
        if entered and vector == HARD_FAULT:
            victim = active[-1]
            faulted.append(core.now_s)
        if entered:
            active.append(vector)
        elif len(active) > 1:
            active.pop()

    core.on_exception(note)
    while core.resets == count:
        before = core.outputs if len(faulted) == 1 else before
        assert core.now_s < begin_s + REACHED_S, f"no reset; the outputs are {core.outputs:#x}"
        assert len(faulted) == 1 or core.now_s < faulted[1] + OPEN_S, f"no reset {OPEN_S} s after the fault"
        core.run(STEP_S)
    core.on_exception(lambda _vector, _entered: None)
    seconds = core.now_s - faulted[1]
    assert core.outputs == NO_OUTPUTS
    assert core.register("PTC.PDDR") >> SAFE_STATE & 1 == 0, "the line of the safe state is not released"
    return Reaction(victim, before, seconds, core.register("RCM.SRS"))


def gates_afterwards(loop: Loop, stand: Stand) -> list[float]:
    """The gates in each of the next 1000 periods, in which the dc link stays within its bound."""
    loop.record(("truth.vdc_V", "emulator.gates"), 1)
    count = stand.core.resets
    rows = [row for _ in range(100) for row in stand.run_ms()]
    assert max(row[0] for row in rows) <= VDC_SHARE * resets.BATTERY_V
    assert stand.core.resets == count, "it has reset again"
    return [row[1] for row in rows]


def the_short_circuit_comes_back(loop: Loop, stand: Stand) -> None:
    """Within 2 ms of the reset, and stays."""
    gates = gates_afterwards(loop, stand)
    assert 1.0 in gates[: round(10 * AGAIN_MS)]
    assert 0.0 not in gates[gates.index(1.0) :]


def a_fault_in_the_fast_isr_opens_the_bridge(parts: Parts) -> None:
    with at_speed(parts) as (loop, stand):
        stand.core.set_register("PCC.PCC_ADC1", 0)
        seen = reaction(stand)
        print(f"fast ISR: the outputs are off and the processor resets {1e6 * seen.seconds:.2f} us after the fault")
        assert (seen.vector, seen.cause) == (FAST, SOFTWARE)
        assert seen.outputs_before != NO_OUTPUTS
        the_short_circuit_comes_back(loop, stand)


def undefined(stand: Stand, function: str, reset: bool) -> Reaction:
    """The reaction to an undefined instruction at the start of this function."""
    core = stand.core
    at = core.symbol(function) & ~1
    good = core.read(at, 2)
    core.write(at, UNDEFINED)
    if reset:
        core.reset(resets.KINDS["watchdog"])
    seen = reaction(stand)
    core.write(at, good)
    return seen


def a_fault_in_the_task_opens_the_bridge(parts: Parts) -> None:
    with at_speed(parts) as (loop, stand):
        seen = undefined(stand, "tick_handler", reset=False)
        print(f"task: the outputs are off and the processor resets {1e6 * seen.seconds:.2f} us after the fault")
        assert (seen.vector, seen.cause) == (TASK, SOFTWARE)
        assert seen.outputs_before != NO_OUTPUTS
        the_short_circuit_comes_back(loop, stand)


# Function: what the bridge did until then, how the core resets.
PLACES = {
    "start_up": (NO_OUTPUTS, LOCK_UP),  # the timer has no clock yet: the handler faults in turn
    "pins_init": (NO_OUTPUTS, SOFTWARE),
    "image_step": (LOWER, SOFTWARE),  # the short circuit is held already
}


def a_fault_in_the_start_opens_the_bridge(parts: Parts) -> None:
    for function, (before, cause) in PLACES.items():
        with at_speed(parts) as (loop, stand):
            seen = undefined(stand, function, reset=True)
            print(f"{function}: reset {1e6 * seen.seconds:.2f} us after the fault")
            assert (seen.vector, seen.outputs_before, seen.cause) == (THREAD, before, cause), function
            the_short_circuit_comes_back(loop, stand)


def test_for_how_long_in_the_start_a_second_reset_would_find_nothing(parts: Parts) -> None:
    """SIM.CHIPCTL says that the RAM with the copies is not kept before the first instructions, and while it is read."""
    with at_speed(parts) as (_, stand):
        core = stand.core
        core.reset(resets.KINDS["watchdog"])
        begin_s, unkept_s = core.now_s, 0.0
        while core.now_s < begin_s + COPIES_READ_S:
            last_s, was_unkept = core.now_s, core.register("SIM.CHIPCTL") >> SRAMU_RETEN & 1
            core.run(STEP_S)
            unkept_s += (core.now_s - last_s) * was_unkept
        print(f"in the start the copies would not outlast a reset for {1e6 * unkept_s:.1f} us")
        assert 0.0 < unkept_s < UNKEPT_S


CHECKS = (a_fault_in_the_fast_isr_opens_the_bridge, a_fault_in_the_task_opens_the_bridge,
          a_fault_in_the_start_opens_the_bridge)  # fmt: skip


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_a_core_fault_opens_the_bridge(parts: Parts, check: Callable[[Parts], None]) -> None:
    check(parts)


HANDLER = r'"ldr r0, =stack_top\n msr msp, r0\n b panic\n"'
PLANTED_ERRORS: dict[str, tuple[Callable[[Parts], None], PlantedError]] = {
    "the handler returns": (
        a_fault_in_the_fast_isr_opens_the_bridge,
        PlantedError("startup.c", HANDLER, r'"bx lr\n"'),
    ),
    "the handler waits": (
        a_fault_in_the_start_opens_the_bridge,
        PlantedError("startup.c", HANDLER, r'"b .\n"'),
    ),
    "the outputs are opened without a reset": (
        a_fault_in_the_task_opens_the_bridge,
        PlantedError("startup.c", "    SCB_AIRCR = AIRCR_RESET;\n", ""),
    ),
}


@pytest.mark.parametrize("name", PLANTED_ERRORS)
def test_a_planted_error_is_found(parts: Parts, name: str, tmp_path: Path) -> None:
    check, error = PLANTED_ERRORS[name]
    assert_found(check, parts, error, tmp_path)
