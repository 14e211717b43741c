# SPDX-License-Identifier: Apache-2.0
"""Words that are not terms of the field, in text and in names, each with the terms to use instead."""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from tree import Violation, files, lines, run

# These are not allowed anywhere: neither as a word of a text nor as a part of a name between underscores.
WORDS = (
    (r"contradictions?", "mismatch"),
    (r"distrust\w*", "low confidence"),
    (r"judg\w+", "check, evaluate, classify"),
    (r"learn(?:s|t|ed|ing)?", "identify, adapt"),
    (r"forg[eo]t\w*", "clear, reset, discard"),
    (r"nobody|whoever", "the part that is meant, or the passive voice"),
    (r"careful(?:ly)?", "checked, or what is checked"),
    (r"unsettled", "not settled"),
    (r"localis\w+", "local flux error, or what is found"),
    (r"calm\w*", "smooth, idle"),
    (r"rooms?", "free space, margin, limit, folder"),
    (r"look(?:s|ed|ing)?[ _](?:at|after|into)", "check, read, evaluate"),
    (r"believ\w+", "use, rely on, count"),
    (r"down there", "the condition, for example: below v_min"),
    (r"numbers? that (?:is|are) none", "NaN or infinity"),
    (r"identify_pair(?:_t)?", "the vector's type with its format, for example dq_q30_t"),
    (r"gates?[ _](?:(?:is|are|was|were|has|have|stays?|may|can)[ _])*(?:opened|closed|opens?|closes?|opening|closing)",
     "switching enabled, disabled"),
    (r"(?:open|opens|opened|opening|close|closes|closed|closing)[ _](?:(?:the|all|its|six)[ _])?gates",
     "switching enabled, disabled"),
)  # fmt: skip
# These are not allowed as a whole name in firmware and ports.
NAMES = {"most": "max", "look": "check, read, sample", "cut": "limit", "note": "record", "guard": "protect, service"}
NAMED = ("firmware", "hal")

WORD = re.compile("|".join(rf"(?P<w{n}>(?<![a-z]){word}(?![a-z]))" for n, (word, _) in enumerate(WORDS)), re.IGNORECASE)
IDENTIFIER = re.compile(r"\b[A-Za-z_]\w*\b")
NO_NAMES = re.compile(r'/\*.*?\*/|/\*.*$|^\s*\* .*$|"(?:\\.|[^"\\])*"')
DATA = {".csv", ".json", ".svg", ".parquet", ".mf4"}

# A gate of the paper's law is a condition of its adaptation, and opens and closes there.
# The other files quote an old name or the words themselves.
ALLOWED = {
    "gates": {"docs/theory/mrai.md"},
    "nobody": {"tests/tools/abuse/test_abuse.py"},  # a user of Unix
    "contradiction": {"CHANGELOG.md", "hal/host/stations.c", "tests/sil/test_abi.py"},
}
EXEMPT = {"LICENSE", "tools/checks/words.py", "tests/tools/test_words.py"}


def is_allowed(path: Path, word: str) -> bool:
    """Whether this page or file is about this very word."""
    return any(key[:4] in word.lower() and str(path) in paths for key, paths in ALLOWED.items())


def word_problems(path: Path, line: str) -> Iterator[str]:
    """Words of texts and parts of names."""
    for match in WORD.finditer(line):
        instead = WORDS[int((match.lastgroup or "w0")[1:])][1]
        if not is_allowed(path, match.group(0)):
            yield f"'{match.group(0)}', use instead: {instead}"


def name_problems(path: Path, line: str) -> Iterator[str]:
    """Whole names in C; comments and strings are texts."""
    if path.suffix in {".c", ".h"} and path.parts[0] in NAMED:
        for name in IDENTIFIER.findall(NO_NAMES.sub(" ", line)):
            if name in NAMES:
                yield f"the name '{name}', use instead: {NAMES[name]}"


def check(root: Path) -> Iterator[Violation]:
    """All files but data."""
    for path in files(root):
        if str(path) in EXEMPT or path.suffix in DATA:
            continue
        for number, line in enumerate(lines(root, path), start=1):
            for problem in (*word_problems(path, line), *name_problems(path, line)):
                yield Violation(path, number, problem)


if __name__ == "__main__":
    sys.exit(run(check, "words"))
