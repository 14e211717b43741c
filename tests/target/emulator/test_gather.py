# SPDX-License-Identifier: Apache-2.0
"""The scope's copies: the driver hal/s32k144/gather.c and the model of the DMA controller, against plain loops."""

import ctypes
import random
import struct
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest
from conftest import Program

from fluxtrue_tools.emulate.build import ROOT
from fluxtrue_tools.emulate.core import Core, EmulationStoppedError

DRIVER = ROOT / "hal" / "s32k144" / "gather.c"
CYCLE_S = 1 / 48e6  # after reset the system clock is the fast internal one
CHANNEL_CYCLES, HALF_WORD_CYCLES = 16, 8  # as dma.c assumes
CALL_CYCLES = 3000  # more than the calls before a start take
LATEST_CYCLES = 100  # 63 of them measured: the start's own instructions, the last round of the loop that waits
RAM, RAM_SIZE = 0x1FFF_8000, 0xF000
USED = ((0x1FFF_8000, 0x1FFF_9000), (0x2000_0800, 0x2000_1000))  # by the program: variables, stack
SOURCE, DESTINATION = 0x1FFF_9000, 0x1FFF_C000
COLUMNS, CHANNELS = 8, 16
DESCRIPTOR = {"SOFF": 2, "ATTR": 0x0101, "NBYTES_MLNO": 4, "SLAST": 0, "DOFF": 2, "CITER_ELINKNO": 1, "DLASTSGA": 0,
              "CSR": 0, "BITER_ELINKNO": 1}  # fmt: skip
END, SET_UP, MOVE, ADD = range(4)
Place = tuple[int, int]  # addresses of a column's next half word and of its destination


class Gather:
    """The driver's functions: each notes the call for the program, and start() compares what both have copied."""

    def __init__(self, core: Core, seed: int = 1) -> None:
        self.core, self.script, self.is_further = core, list[tuple[int, ...]](), False
        self.stride, self.row_size, self.place = [0], 0, [(0, 0)] * COLUMNS
        self.cycles, self.starts = 0, 0
        core.run(100e-6)
        content = random.Random(seed).randbytes(RAM_SIZE)
        at = RAM
        for first, end in (*USED, (RAM + RAM_SIZE, 0)):
            if first > at:
                core.write(at, content[at - RAM : first - RAM])
            at = end
        self.memory = bytearray(core.read(RAM, RAM_SIZE))

    def set_up(self, stride: Sequence[int], row_size: int) -> None:
        self.stride, self.row_size = list(stride), row_size
        self.script.append((SET_UP, len(stride), row_size, 0))
        self.core.write(self.core.symbol("stride"), struct.pack(f"<{len(stride)}I", *stride))

    def move(self, places: Iterable[Place]) -> None:
        """More places than columns: the others are not copied."""
        for k, place in enumerate(places):
            self.place[k] = place
            self.script.append((MOVE, k, *place))

    def add(self, count: int) -> None:
        self.script.append((ADD, count, int(self.is_further), 0))
        self.is_further = True
        for k, stride in enumerate(self.stride):
            source, destination = self.place[k]
            for _ in range(count):
                half_word = self.memory[source - RAM : source - RAM + 2]
                self.memory[destination - RAM : destination - RAM + 2] = half_word
                source, destination = source + stride, destination + self.row_size
            self.place[k] = source, destination
            self.cycles += CHANNEL_CYCLES + HALF_WORD_CYCLES * count

    def start(self) -> None:
        core, script, expected = self.core, [*self.script, (END, 0, 0, 0)], self.cycles
        self.starts += 1
        core.write(core.symbol("script"), b"".join(struct.pack("<4I", *step) for step in script))
        core.write(core.symbol("asked"), struct.pack("<I", self.starts))
        core.run((CALL_CYCLES + expected) * CYCLE_S)
        assert core.word("started") == self.starts, "the calls take longer"
        assert core.word("idle_before"), "not idle before the first call"
        assert core.word("idle_after_set_up"), "not idle after the set-up"
        assert not core.word("idle_after_start"), "idle immediately after the start"
        assert core.word("ended") == self.starts, "never idle again"
        assert self.differences() == [], "the memory differs from the plain loops'"
        assert core.word("cycles") >= expected, "idle too early"
        assert core.word("cycles") <= expected + LATEST_CYCLES, "idle too late"
        self.script, self.is_further, self.cycles = [], False, 0

    def differences(self) -> list[str]:
        """Addresses of bytes that the plain loops have not left so."""
        content = bytearray(self.core.read(RAM, RAM_SIZE))
        for first, end in USED:
            content[first - RAM : end - RAM] = self.memory[first - RAM : end - RAM]
        if content == self.memory:
            return []
        return [hex(RAM + k) for k in range(RAM_SIZE) if content[k] != self.memory[k]]


def adjacent(source: Sequence[int], destination: int) -> list[Place]:
    """Columns of a row."""
    return [(at, destination + 2 * k) for k, at in enumerate(source)]


# ---- what is copied


def columns(gather: Gather, number: int) -> None:
    """Of different strides; one value, then several, then one again, which continue."""
    gather.set_up([2 + 4 * k for k in range(number)], 2 * number)
    gather.move(adjacent([SOURCE + 0x200 * k for k in range(number)], DESTINATION))
    for count in (1, 7, 1, 12):
        gather.add(count)
        gather.start()


def one_column(gather: Gather) -> None:
    columns(gather, 1)


def two_columns(gather: Gather) -> None:
    columns(gather, 2)


def five_columns(gather: Gather) -> None:
    columns(gather, 5)


def eight_columns(gather: Gather) -> None:
    columns(gather, 8)


def constant_columns(gather: Gather) -> None:
    """Between others, last and alone; rows that are further apart than they are long."""
    for stride in ([0], [16, 0], [0, 16, 0, 0, 16], [16] * 7 + [0]):
        gather.set_up(stride, 2 * len(stride) + 6)
        gather.move(adjacent([SOURCE + 2 * k for k in range(len(stride))], DESTINATION))
        for count in (5, 3):
            gather.add(count)
            gather.start()


def ring(gather: Gather) -> None:
    """Where it ends within a copy, a second part begins at its beginning; where it ends with a copy, the next one's
    columns are moved. All eight columns are moved, as the scope does, but five are copied."""
    slots, size, used = 12, 16, 5
    gather.set_up([size] * used, 2 * used)
    at, row, wraps, ends = 0, 0, 0, 0
    for k in range(30):
        left = 1 + (5 * k) % 9
        if k == 0 or at == slots:
            ends += at == slots
            at = 0
            gather.move(adjacent([SOURCE + 2 * c for c in range(COLUMNS)], DESTINATION + 2 * used * row))
        first = min(left, slots - at)
        gather.add(first)
        at, row, left = at + first, row + first, left - first
        if left > 0:
            wraps += 1
            gather.move(adjacent([SOURCE + 2 * c for c in range(COLUMNS)], DESTINATION + 2 * used * row))
            gather.add(left)
            at, row = left, row + left
        gather.start()
    assert wraps >= 8 and ends >= 1


def banks(gather: Gather) -> None:
    """Columns moved before none, one or both parts of a start, in every order of two."""
    gather.set_up([8, 0, 6], 6)
    kinds = ("moved", "both moved", "continues", "second moved")
    order = [kind for a in kinds for b in kinds for kind in (a, b)]
    places = iter([adjacent([SOURCE + 64 * k + 2 * c for c in range(3)], DESTINATION + 48 * k) for k in range(64)])
    gather.move(next(places))
    for k, kind in enumerate(order):
        if kind in {"moved", "both moved"} and k > 0:
            gather.move(next(places))
        gather.add(1 + k % 4)
        if kind in {"both moved", "second moved"}:
            gather.move(next(places))
            gather.add(1 + k % 3)
        gather.start()


def other_set_ups(gather: Gather) -> None:
    """Fewer columns, more again, and the same; after starts that ended in either bank, of one part and of two."""
    for k, number in enumerate((5, 2, 8, 1, 8, 3, 3, 4)):
        gather.set_up([4 * (k + 1)] * number, 2 * number)
        for part in range(1 + k % 3):
            gather.move(adjacent([SOURCE + 16 * c for c in range(number)], DESTINATION + 0x200 * k + 0x80 * part))
            gather.add(2 + part)
            if k % 2 == 0:
                gather.move(adjacent([SOURCE + 32 * c for c in range(number)], DESTINATION + 0x2000 + 0x80 * k))
                gather.add(3)
            gather.start()


def long_distances(gather: Gather) -> None:
    """The longest of several values, and longer ones of single values."""
    first, second = SOURCE + 0x100, SOURCE + 0x200
    gather.set_up([32766, 2], 32766)
    gather.move([(first, second), (first + 2, second + 2)])
    gather.add(2)
    gather.start()
    gather.set_up([40000, 70000], 50000)
    for k in range(3):
        gather.move([(first + 8 * k, second + 8 * k), (first + 8 * k + 2, second + 8 * k + 2)])
        gather.add(1)
        gather.start()


SCENARIOS: tuple[Callable[[Gather], None], ...] = (
    one_column, two_columns, five_columns, eight_columns, constant_columns, ring, banks, other_set_ups, long_distances,
)  # fmt: skip


def compiled(program: Program, driver: Path) -> Path:
    return program("gather", f"-I{ROOT}", f"-I{ROOT / 'firmware'}", also=driver)


@pytest.fixture(scope="module")
def driven(program: Program) -> Path:
    return compiled(program, DRIVER)


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda scenario: scenario.__name__)
def test_the_driver_copies_what_plain_loops_copy(
    library: ctypes.CDLL, driven: Path, scenario: Callable[[Gather], None]
) -> None:
    """After a reset, when the descriptors are undefined."""
    with Core.of_program(library, driven) as core:
        scenario(Gather(core))


def test_all_copies_follow_one_another(library: ctypes.CDLL, driven: Path) -> None:
    """Each set-up finds the channels as the copies before have left them."""
    with Core.of_program(library, driven) as core:
        gather = Gather(core)
        for scenario in (*SCENARIOS, *reversed(SCENARIOS)):
            scenario(gather)


# ---- planted errors


@dataclass(frozen=True)
class PlantedError:
    """A text of the driver, which must occur exactly once, what replaces it, and how the error shows first."""

    name: str
    text: str
    replacement: str
    found: str

    def driver(self, folder: Path) -> Path:
        source = DRIVER.read_text(encoding="utf-8")
        assert source.count(self.text) == 1, f"{DRIVER.name} must contain this text once: {self.text}"
        path = folder / f"{self.name.replace(' ', '_')}.c"
        path.write_text(source.replace(self.text, self.replacement), encoding="utf-8")
        return path


IDLE_AT_ONCE, NEVER_IDLE, DIFFERS = "idle immediately after", "never idle again", "the memory differs"
TOO_EARLY, REFUSED = "idle too early", "DMA channel 8 starts: NBYTES"
START = "set_status(first, (first->CSR & LINK) | DMA_TCD0_CSR_START)"
STATUS = "set_status(channel, link)"
CLEARED = "bank[state.last].CSR = 0;"
FURTHER = "link_to((state.bank == 0U) ? 0U : OTHER_BANK)"
SECOND_BANK = """
        set_up_channel(OTHER_BANK + k, is_last ? 0U : link_to(OTHER_BANK + k + 1U), stride[k], row_size);"""
FIRST = "(parts > 1U) ? state.bank ^ BANK_SIZE : state.bank"
LAST = "bank_at(state.bank)[state.last].CSR & DMA"
PLANTED = (
    PlantedError("DONE not cleared in start", START,
                 "first->CSR = (uint16_t)((first->CSR & LINK) | DMA_TCD0_CSR_START)", NEVER_IDLE),
    PlantedError("DONE not cleared in the set-up", STATUS,
                 "channel->CSR = (uint16_t)link", NEVER_IDLE),
    PlantedError("DONE never cleared", "    channel->CSR = 0;\n", "", NEVER_IDLE),
    PlantedError("last status not cleared", CLEARED, "", IDLE_AT_ONCE),
    PlantedError("last status cleared only of a link", CLEARED,
                 "if ((bank[state.last].CSR & DMA_TCD0_CSR_DONE) == 0U) {\n        bank[state.last].CSR = 0;\n    }",
                 IDLE_AT_ONCE),
    PlantedError("no link to the further part", FURTHER, "0U", NEVER_IDLE),
    PlantedError("a link to the first part again", FURTHER, "link_to((state.bank == 0U) ? OTHER_BANK : 0U)",
                 NEVER_IDLE),
    PlantedError("starts the other bank", FIRST, "(parts > 1U) ? state.bank : state.bank ^ BANK_SIZE", NEVER_IDLE),
    PlantedError("adds to the other bank", "channel_t *bank = bank_at(state.bank);",
                 "channel_t *bank = bank_at(state.bank ^ BANK_SIZE);", DIFFERS),
    PlantedError("links from the bank itself", "bank_at(state.bank ^ BANK_SIZE)[state.last]",
                 "bank_at(state.bank)[state.last]", NEVER_IDLE),
    PlantedError("moves without another bank", "state.bank = (uint16_t)(state.bank ^ BANK_SIZE);", "", DIFFERS),
    PlantedError("starts the first bank always", FIRST, "0U", NEVER_IDLE),
    PlantedError("starts the last part only", FIRST, "state.bank", DIFFERS),
    PlantedError("values instead of bytes", "count * VALUE_SIZE", "count", REFUSED),
    PlantedError("bytes of one value too many", "count * VALUE_SIZE", "(count + 1U) * VALUE_SIZE", DIFFERS),
    PlantedError("no offset of the source", "    channel->SOFF = (uint16_t)stride;\n", "", DIFFERS),
    PlantedError("constant offset of the source", "(uint16_t)stride", "VALUE_SIZE", DIFFERS),
    PlantedError("constant offset of the destination", "(uint16_t)row_size", "VALUE_SIZE", DIFFERS),
    PlantedError("never started", "state.started = true;", "", IDLE_AT_ONCE),
    PlantedError("started before the set-up", "    state.started = false;\n", "", "not idle after the set-up"),
    PlantedError("idle after the first column", LAST, "bank_at(state.bank)[0].CSR & DMA", TOO_EARLY),
    PlantedError("reads the first bank only", LAST, "channels()[state.last].CSR & DMA", NEVER_IDLE),
    PlantedError("last column left out", "(columns - 1U)", "(columns - 2U + (columns < 2U))", DIFFERS),
    PlantedError("second bank not set up", SECOND_BANK, "", NEVER_IDLE),
)  # fmt: skip


def define_descriptors(core: Core) -> None:
    """Valid copies of two half words within the destinations, so that the model refuses no channel as undefined."""
    for channel in range(CHANNELS):
        at = DESTINATION + 0x3000 + 8 * channel
        for name, value in (DESCRIPTOR | {"SADDR": at, "DADDR": at + 4}).items():
            core.store(f"DMA.TCD{channel}_{name}", value)


@pytest.mark.parametrize("error", PLANTED, ids=lambda error: error.name.replace(" ", "-"))
def test_a_planted_error_is_found(library: ctypes.CDLL, program: Program, tmp_path: Path, error: PlantedError) -> None:
    elf = compiled(program, error.driver(tmp_path))
    with pytest.raises((AssertionError, EmulationStoppedError), match=error.found):
        for scenario in SCENARIOS:
            with Core.of_program(library, elf) as core:
                gather = Gather(core)
                define_descriptors(core)
                scenario(gather)
