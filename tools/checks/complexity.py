# SPDX-License-Identifier: Apache-2.0
"""Length and cyclomatic complexity of every function, counted by lizard."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import lizard

from tree import Violation, files, run


@dataclass(frozen=True)
class Limit:
    """Largest numbers of lines (comments included) and of paths of a function below a folder."""

    folder: str
    suffix: str
    lines: int
    complexity: int


LIMITS = (
    Limit("firmware", ".c", 40, 10),
    Limit("firmware", ".h", 40, 10),
    Limit("hal", ".c", 40, 20),
    Limit("tests/plant", ".c", 40, 20),
    Limit("tools", ".py", 60, 20),
    Limit("tests", ".py", 60, 20),
)
# The check of a configuration is one chain of comparisons: it has many paths and is easy to read nevertheless.
VALIDATOR, VALIDATOR_COMPLEXITY = "_check", 30


def limit_for(path: Path) -> Limit | None:
    """The limit of the first folder that holds the file."""
    for limit in LIMITS:
        if path.suffix == limit.suffix and path.is_relative_to(limit.folder):
            return limit
    return None


def check(root: Path) -> Iterator[Violation]:
    """Every function of every file with a limit."""
    for path in files(root, ".c", ".h", ".py"):
        limit = limit_for(path)
        if limit is None:
            continue
        for function in lizard.analyze_file(str(root / path)).function_list:
            if function.length > limit.lines:
                yield Violation(path, function.start_line,
                                f"{function.name}: {function.length} lines, at most {limit.lines}")  # fmt: skip
            is_validator = function.name.endswith(VALIDATOR)
            limit_here = VALIDATOR_COMPLEXITY if is_validator else limit.complexity
            if function.cyclomatic_complexity > limit_here:
                yield Violation(path, function.start_line,
                                f"{function.name}: complexity {function.cyclomatic_complexity}, "
                                f"at most {limit_here}")  # fmt: skip


if __name__ == "__main__":
    sys.exit(run(check, "function length and complexity"))
