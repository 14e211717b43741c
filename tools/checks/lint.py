#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Errors in Python files, by the pinned ruff: .ruff.toml says which rules apply and why others do not.

Checks every Python file of the checkout, or those named.
"""

import argparse
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from format import chosen, complaints, tool
from tree import PROJECT, Violation, report

COMPLAINT = re.compile(r"^(.+?):(\d+):\d+: (.+)")


def check(root: Path, paths: Sequence[Path]) -> Iterator[Violation]:
    """Every message of ruff."""
    command = [tool("ruff"), "check", "--output-format", "concise"]
    for name, number, text in sorted(complaints(root, command, paths, COMPLAINT)):
        path = Path(name)
        yield Violation(path.relative_to(root) if path.is_absolute() else path, int(number), text)


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--root", type=Path, default=PROJECT)
    parser.add_argument(
        "files", nargs="*", type=Path, metavar="FILE", help="default: every Python file of the checkout"
    )
    arguments = parser.parse_args()
    root = arguments.root.resolve()
    return report(check(root, [path for path in chosen(root, arguments.files) if path.suffix == ".py"]), "lint")


if __name__ == "__main__":
    sys.exit(main())
