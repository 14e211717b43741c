# SPDX-License-Identifier: Apache-2.0
"""The DMA controller: a program that copies with it, and its descriptors accessed from outside while a program idles."""

import ctypes
import struct
from collections.abc import Iterator

import pytest
from conftest import Program

from fluxtrue_tools.emulate.core import Core, EmulationStoppedError

CYCLE_S = 1 / 48e6  # after reset the system clock is the fast internal one
START, LINK, ACTIVE, DONE = 1, 1 << 5, 1 << 6, 1 << 7
SOURCE, DESTINATION = 0x1FFF_9000, 0x1FFF_A000
COUNT = 10
COPY_S = (16 + 8 * COUNT) * CYCLE_S  # as dma.c assumes
VALUES = tuple(range(100, 100 + COUNT))
FIELDS = {
    "SADDR": SOURCE, "SOFF": 2, "ATTR": 0x0101, "NBYTES_MLNO": 2 * COUNT, "SLAST": 0, "DADDR": DESTINATION, "DOFF": 2,
    "CITER_ELINKNO": 1, "DLASTSGA": 0, "CSR": 0, "BITER_ELINKNO": 1,
}  # fmt: skip


@pytest.fixture
def core(library: ctypes.CDLL, program: Program) -> Iterator[Core]:
    with Core.of_program(library, program("idle")) as core:
        core.run(1e-4)
        core.write(SOURCE, struct.pack(f"<{COUNT}H", *VALUES))
        core.write(DESTINATION, bytes(2 * COUNT))
        yield core


def prepare(core: Core, channel: int = 0, **changes: int) -> None:
    """Write the whole descriptor of a channel."""
    for name, value in (FIELDS | changes).items():
        core.store(f"DMA.TCD{channel}_{name}", value)


def start(core: Core, channel: int = 0, link: int = 0) -> None:
    core.store(f"DMA.TCD{channel}_CSR", START | link)


def link_to(channel: int) -> int:
    return LINK | channel << 8


def csr(core: Core, channel: int = 0) -> int:
    return core.load(f"DMA.TCD{channel}_CSR")


def half_words(core: Core, address: int = DESTINATION, count: int = COUNT) -> tuple[int, ...]:
    return struct.unpack(f"<{count}H", core.read(address, 2 * count))


# ---- a copy


def test_a_program_starts_a_copy_and_waits_for_it(library: ctypes.CDLL, program: Program) -> None:
    count = 40
    with Core.of_program(library, program("dma")) as core:
        core.run(1e-3)
        assert core.word("finished") == 2
        for run in range(2):
            for channel, step in enumerate((2, 3)):
                at = core.symbol("copied") + 2 * count * (2 * run + channel)
                assert half_words(core, at, count) == tuple(1000 * run + step * k for k in range(count))
