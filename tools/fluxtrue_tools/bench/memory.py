# SPDX-License-Identifier: Apache-2.0
"""What the S32K144's memories add to the cycles of the Technical Reference Manual: the least and the most.

No document at hand gives the times of this processor's memories. Each number therefore has its origin: a document of
the processor or of a sister family with the same blocks (Kinetis), or "assumption". The model itself is
tests/target/emulator/memory_time.h; it is applied to each instruction and each access of the emulated drive.
"""

from __future__ import annotations

import ctypes
from typing import Final


class Costs(ctypes.Structure):
    """The C type memory_costs_t."""

    _fields_ = tuple((name, ctypes.c_uint32) for name in (
        "sets", "ways", "line_bytes", "fill", "fill_ahead", "fetch_ahead_bytes", "code_bus", "narrow_store",
        "peripheral", "hidden_at_entry",
    ))  # fmt: skip


CACHE_BYTES, LINE_BYTES, WAYS = 4096, 16, 2
SETS: Final = CACHE_BYTES // LINE_BYTES // WAYS

LEAST: Final = Costs(SETS, WAYS, LINE_BYTES, 3, 0, 0, 0, 0, 1, 12)
# One way: whatever the cache replaces, the line that its set has used last is there.
MOST: Final = Costs(SETS, 1, LINE_BYTES, 12, 12, 12, 1, 1, 8, 0)

BOTH: Final = (LEAST, MOST)

DOCUMENTED, ASSUMED, BOTH_KINDS = "documented", "assumed", "documented in part"

# Subject, least, most, kind, origin: printed in docs/performance.md.
ASSUMPTIONS: Final = (
    (
        "code cache",
        f"{CACHE_BYTES // 1024} KiB, {WAYS} ways, lines of {LINE_BYTES} bytes",
        "the same",
        DOCUMENTED,
        "size: data sheet of the S32K1xx; two ways: INVW0 and INVW1 of LMEM_PCCCR (SVD of the S32K144); line: "
        "LMEM_CACHE_LINE_SIZE of NXP's driver for the same block (KSDK 2, fsl_lmem_cache.h)",
    ),
    (
        "replacement",
        "least recently used",
        "only the line last used is there",
        ASSUMED,
        "no document names the policy. With the most, only the line that a set has used last is taken to be there, "
        "which holds for any policy",
    ),
    (
        "line fill",
        f"{LEAST.fill}",
        f"{MOST.fill}",
        BOTH_KINDS,
        "a read of the flash takes 4 to 7 core cycles at a ratio of 4:1 (K20 Sub-Family Reference Manual, flash memory "
        "controller), of which the first is in the manual's sum. Least, assumed: the core continues with the first "
        "word. Most, assumed: the flash delivers 64 bits, so a line takes 7 + 4, and 1 to hand over",
    ),
    (
        "next line, read ahead by the flash",
        f"{LEAST.fill_ahead}",
        f"{MOST.fill_ahead}",
        BOTH_KINDS,
        "the speculation buffer reads the next word in idle cycles (same manual); how often it is early enough is "
        "assumed: always with the least, never with the most",
    ),
    (
        "bytes that the core fetches ahead",
        f"{LEAST.fetch_ahead_bytes}",
        f"{MOST.fetch_ahead_bytes}",
        BOTH_KINDS,
        "three words: Cortex-M4 Technical Reference Manual, prefetch unit; that the core waits for their line is "
        "assumed",
    ),
    (
        "data in flash or SRAM_L",
        f"{LEAST.code_bus}",
        f"{MOST.code_bus}",
        BOTH_KINDS,
        "both share one bus with the instructions (LMEM, Kinetis SDK); that each access costs a fetch is assumed",
    ),
    (
        "store of less than a word to SRAM",
        f"{LEAST.narrow_store}",
        f"{MOST.narrow_store}",
        ASSUMED,
        "SRAM has no wait states (LMEM); a store of less than a word may read before it writes because of the error "
        "correction",
    ),
    (
        "peripheral",
        f"{LEAST.peripheral}",
        f"{MOST.peripheral}",
        BOTH_KINDS,
        "two data-phase cycles (KL25 Sub-Family Reference Manual, peripheral bridge), the first in the manual's sum. "
        "Most, assumed: the bridge runs at half the core's clock, so 1 to align, 4 for its two cycles, 2 for a wait "
        "state of the peripheral, 2 for the crossbar, less the one in the manual's sum",
    ),
    (
        "of an exception's entry, hidden by the stacking",
        f"up to {LEAST.hidden_at_entry}",
        f"{MOST.hidden_at_entry}",
        ASSUMED,
        "the manual has the read of the vector and the stacking in parallel",
    ),
)
