# SPDX-License-Identifier: Apache-2.0
"""docs/safety/proofs.md: what is proved, written from the descriptions of the proofs."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from fluxtrue_tools.prove.checker import Verdict
from fluxtrue_tools.prove.data import Proof

PAGE: Final = Path("docs", "safety", "proofs.md")
_MEASURED: Final = re.compile(r"\| [\d.]+ \| \d+ \|$|^In all .*$", re.MULTILINE)
UNKNOWN: Final = Verdict(False, (), 0.0, 0)
HEAD: Final = """# What is proved

<!-- Written by `tools/fluxtrue prove --page` from tests/proof/*.toml. -->

Each row is one harness of `tests/proof`, checked by the bounded model checker CBMC 6.6 on the source of the firmware,
in the sizes and types of the Cortex-M, with the portable arithmetic of `fx`
([tests/proof](../../tests/proof/README.md)). The property holds for *every* value in the ranges of its row; nothing is
claimed beyond them. In addition each harness shows that what it executes has no signed overflow, no undefined shift, no
division by zero, no access outside of an object, and no loop longer than it unwinds. For each harness an error is
planted in the firmware, which the harness must find: a harness that proves nothing does not pass.

Processor seconds and memory are those of one run of the proof itself, without its planted error.
"""


NOT_PROVED: Final = """## What is not proved

No solver finished within seconds for:

- products of two arbitrary words (proved for powers of two instead), `fx` division, square root, sine and cosine;
- the geometry of the modulation: that three phase voltages of the limited vector do not overflow;
- the whole step of the arbitration: that it does not overshoot (its rate and its target are proved);
- values written by XCP, and the set-up of its lists;
- the torque limits as a whole (each of them is proved).

Not tried: look-ups in the tables, the other monitors of the 1 kHz task, the angle tracker, the identification, records
of more than one piece.

What the properties do not add up to:

- Those of the state machine hold for one step from any content, of the table or of a decision. That they together
  exclude a wrong sequence of states is not proved but tested (`tests/bus`, `tests/hil`).
- The safe state without a valid speed: the last one is kept, then it falls after 20,000 steps (`UNKNOWN_STEPS` of
  `firmware/safety/safe_state.c`), although the rotor may still turn. The proofs hold with that speed, not with the
  rotor's.
- What the compiler and the linker make of the source, the ports in `hal/`, and the time that anything takes.

These parts have tests, closed-loop simulations and planted errors instead
([tests/proof](../../tests/proof/README.md) says what limits a proof).
"""


def write(proofs: Sequence[Proof], verdicts: Mapping[str, Verdict]) -> str:
    """The page."""
    total = sum(verdict.seconds for verdict in verdicts.values())
    text = [HEAD, f"In all {len(proofs)} harnesses, {total:.0f} s.\n"]
    for group in dict.fromkeys(proof.group for proof in proofs):
        text += [
            f"## {group}\n",
            "| harness | property | ranges | planted error in | s | MB |",
            "|---|---|---|---|---|---|",
        ]
        for proof in (one for one in proofs if one.group == group):
            verdict = verdicts.get(proof.name, UNKNOWN)
            cells = [f"`{proof.name}`" + (" (long)" if proof.long else ""), proof.statement, proof.ranges,
                     f"`{proof.planted.file}`", f"{verdict.seconds:.1f}", str(verdict.megabytes)]  # fmt: skip
            text.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
        text.append("")
    return "\n".join([*text, NOT_PROVED])


def timeless(page: str) -> str:
    """The page without what was measured."""
    return _MEASURED.sub("", page)
