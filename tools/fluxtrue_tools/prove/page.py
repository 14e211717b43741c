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
    return "\n".join(text)


def timeless(page: str) -> str:
    """The page without what was measured."""
    return _MEASURED.sub("", page)
