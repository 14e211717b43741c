# SPDX-License-Identifier: Apache-2.0
"""Writes the tables firmware/fx/*_table.c from their formulas.

The formulas are derived in docs/theory/fixed-point.md; a test compares the committed files with
this module's output.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable
from pathlib import Path

INT32_MAX = 2**31 - 1
HALF_Q15 = 1 << 15  # half an LSB of q15, in Q31
TURN_STEP = 411775  # 2 pi / 2^16 in Q32


def rotate(start: int, other: int, delta: int) -> int:
    """start + other * delta / 2^32, rounded as SMMLAR does."""
    return ((start << 32) + other * delta + (1 << 31)) >> 32


def sine_table() -> list[tuple[int, int]]:
    """(sin, cos) of 512 points of a turn, Q31 plus half an LSB of q15 (FX-18)."""
    half_cell = 64 * 2.0 * math.pi / 65536.0
    amplitude = (1.0 - half_cell**2 / 4.0) * 2.0**31
    exact = [round(amplitude * math.sin(2.0 * math.pi * i / 512.0)) for i in range(512)]
    table = []
    for i in range(640):
        other = abs(exact[(i + 128) % 512]) + HALF_Q15
        # Near +1 the value with the half LSB would exceed int32 at the edge of its cell.
        bump = rotate(0, other, 64 * TURN_STEP)
        table.append(min(exact[i % 512] + HALF_Q15, INT32_MAX - bump))
    return [(table[i], table[i + 128]) for i in range(512)]


def rsqrt_table() -> list[tuple[int, int]]:
    """(base Q29, slope * 2^8) of 1/sqrt(m) for 192 cells of m in [1/4, 1) (FX-14)."""
    rows = []
    for i in range(64, 256):
        low, high = i / 256.0, (i + 1) / 256.0
        at_low, at_high = low**-0.5, high**-0.5
        secant = (at_high - at_low) / (high - low)
        touch = (-2.0 * secant) ** (-2.0 / 3.0)  # the point at which the curve is parallel to the chord
        sag = at_low + secant * (touch - low) - touch**-0.5
        rows.append((round((at_low - sag / 2.0) * 2.0**29), round((at_high - at_low) * 2.0**37)))
    return rows


def circle_table() -> list[int]:
    """Other component of a unit vector with one of (i + 1)/256, q15, at least a quarter (FX-27)."""
    return [max(math.floor(math.sqrt(1.0 - ((i + 1) / 256.0) ** 2) * 2.0**15), 2**13) for i in range(256)]


def _rows(items: Iterable[str], per_line: int) -> str:
    cells = list(items)
    lines = [", ".join(cells[i : i + per_line]) for i in range(0, len(cells), per_line)]
    return ",\n".join(f"    {line}" for line in lines)


def _source(header: str, declaration: str, body: str) -> str:
    return (
        "/* SPDX-License-Identifier: Apache-2.0 */\n"
        "/* Written by tools/fluxtrue_tools/bench/fx_tables.py; change the formula there. */\n"
        f'#include "{header}"\n\n'
        f"/* clang-format off */\n{declaration} = {{\n{body}\n}};\n/* clang-format on */\n"
    )


def sources() -> dict[str, str]:
    """The text of each generated file, by its name."""
    sine = _rows((f"{{{s}, {c}}}" for s, c in sine_table()), 4)
    root = _rows((f"{{{b}, {s}}}" for b, s in rsqrt_table()), 3)
    circle = _rows((str(v) for v in circle_table()), 12)
    return {
        "circle_table.c": _source("fx/circle.h", "const uint16_t fx_circle_table[256]", circle),
        "sin_table.c": _source("fx/trig.h", "const fx_point_t fx_sin_table[512]", sine),
        "sqrt_table.c": _source("fx/sqrt.h", "const fx_rsqrt_cell_t fx_rsqrt_table[192]", root),
    }


def main(folder: Path) -> None:
    """Write the tables into the folder."""
    for name, text in sources().items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
