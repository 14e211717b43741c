# SPDX-License-Identifier: Apache-2.0
"""The DMA of the S32K144 beside the bench's core, as far as its program can notice it.

What it would copy is not copied: the program of the stages counts instructions and reads no sample of the scope. A copy
ends when the step of the 1 kHz task ends. tests/target/emulator/dma.c models the hardware.
"""

from __future__ import annotations

from unicorn import UC_HOOK_MEM_WRITE, Uc

BASE, SIZE = 0x4000_8000, 0x2000
CHANNELS, CHANNEL_SIZE = 16, 32
CSR = BASE + 0x101C
START, DONE = 1, 1 << 7


class Gather:
    """Channels that are done at the end of a step."""

    def __init__(self, uc: Uc) -> None:
        self.uc = uc
        self.starts = 0
        uc.mem_map(BASE, SIZE)
        for k in range(CHANNELS):
            at = CSR + CHANNEL_SIZE * k
            uc.hook_add(UC_HOOK_MEM_WRITE, self._written, begin=at, end=at + 1)

    def _written(self, _uc: Uc, _kind: int, _address: int, _size: int, value: int, _data: object) -> None:
        self.starts += value & START

    def end_step(self) -> None:
        """What was started is complete."""
        for k in range(CHANNELS):
            at = CSR + CHANNEL_SIZE * k
            status = int.from_bytes(self.uc.mem_read(at, 2), "little")
            self.uc.mem_write(at, (status & ~START | DONE).to_bytes(2, "little"))
