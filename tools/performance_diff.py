#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a change does to the cost of the firmware: the difference of two performance.json, as a table in Markdown.

    tools/performance_diff.py before.json after.json
    tools/performance_diff.py --base main              docs/performance.json of a commit against the present one

Python's own library only: continuous integration runs it without any set-up.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
BASELINE = "docs/performance.json"
HEAD = ("| figure | before | after | change |", "|---|---:|---:|---:|")


class InputError(Exception):
    """One line that says which input is wrong and why."""


def leaves(figures: Any, at: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Every figure with the keys that lead to it. A list of numbers is one figure: minimum, mean, maximum."""
    if isinstance(figures, dict):
        for key, value in figures.items():
            yield from leaves(value, (*at, str(key)))
    elif isinstance(figures, list) and any(isinstance(part, (dict, list)) for part in figures):
        for number, part in enumerate(figures):
            yield from leaves(part, (*at, str(number)))
    else:
        yield at, figures


def text(figure: Any) -> str:
    """The value as a cell of the table."""
    parts = figure if isinstance(figure, list) else [figure]
    return " / ".join(f"{part:.10g}" if is_number(part) else str(part) for part in parts).replace("|", "\\|")


def is_number(figure: Any) -> bool:
    """A count or a measured value; True and False are neither."""
    return isinstance(figure, (int, float)) and not isinstance(figure, bool)


def change(before: Any, after: Any) -> str:
    """In the figure's unit, and in percent for a single number; empty if the two cannot be subtracted."""
    if is_number(before) and is_number(after):
        percent = f" ({100 * (after - before) / before:+.1f} %)" if before else ""
        return f"{after - before:+.10g}{percent}"
    both = [before, after]
    if all(isinstance(figure, list) and all(map(is_number, figure)) for figure in both) and len(before) == len(after):
        return " / ".join(f"{new - old:+.6g}" for old, new in zip(before, after, strict=True))
    return ""


def table(before: Any, after: Any) -> str:
    """A row for each figure that changed, appeared or vanished."""
    old, new = dict(leaves(before)), dict(leaves(after))
    rows = []
    for at in dict.fromkeys([*old, *new]):
        if at not in new:
            cells = (text(old[at]), "–", "gone")
        elif at not in old:
            cells = ("–", text(new[at]), "new")
        elif old[at] != new[at]:
            cells = (text(old[at]), text(new[at]), change(old[at], new[at]))
        else:
            continue
        rows.append(f"| {' · '.join(at)} | {' | '.join(cells)} |")
    if not rows:
        return f"No figure of `{BASELINE}` has changed."
    return "\n".join((f"{len(rows)} of {len(new)} figures of `{BASELINE}` have changed.", "", *HEAD, *rows))


def parse(name: str, content: str) -> Any:
    """The figures of one file."""
    try:
        figures = json.loads(content)
    except json.JSONDecodeError as error:
        raise InputError(f"{name}: no JSON: {error}") from error
    if not isinstance(figures, dict) or not figures:
        raise InputError(f"{name}: holds no figures, wanted: what `tools/fluxtrue bench --update` writes")
    return figures


def read(path: Path) -> Any:
    """The figures in a file."""
    try:
        return parse(str(path), path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: no text: {error.reason}") from error


def read_commit(root: Path, commit: str) -> Any:
    """The figures in a commit."""
    command = ["git", "-C", str(root), "show", "--end-of-options", f"{commit}:{BASELINE}"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise InputError(f"--base {commit}: {' '.join(done.stderr.split())}")
    return parse(f"{commit}:{BASELINE}", done.stdout)


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="before.json and after.json")
    parser.add_argument("--base", help="a commit to compare with, instead of the files")
    parser.add_argument("--root", type=Path, default=ROOT, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if len(arguments.files) != (0 if arguments.base is not None else 2):
        parser.error(f"two files or --base wanted, got {len(arguments.files)} files")
    try:
        if arguments.base is not None:
            print(table(read_commit(arguments.root, arguments.base), read(arguments.root / BASELINE)))
        else:
            print(table(*map(read, arguments.files)))
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
