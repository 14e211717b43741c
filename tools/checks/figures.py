# SPDX-License-Identifier: Apache-2.0
"""Figures that the pages state agree with docs/figures.toml, and that file with results and constants of the code."""

import argparse
import json
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tree import PROJECT, Violation, files, lines, report

DATA = Path("docs/figures.toml")
RESULTS = {"performance": Path("docs/performance.json")}
MARK = re.compile(r"<!-- figure: (\S+) -->(.*)")
NUMBER = re.compile(r"[-−]?\d+(?:\.(\d+))?")

Figure = dict[str, Any]


def read(root: Path) -> dict[str, dict[str, Figure]]:
    """The sections of the data file; none if there is no such file."""
    path = root / DATA
    return tomllib.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def line_of(text: list[str], name: str) -> int:
    """Where the data file defines a figure."""
    return next((n for n, line in enumerate(text, start=1) if line.startswith(f"{name} ")), 1)


def copies(root: Path) -> Iterator[tuple[Path, int, str, str]]:
    """Every marked figure of every page: where, its name, and the text that follows."""
    for path in files(root, ".md"):
        for number, line in enumerate(lines(root, path), start=1):
            rest = line
            while match := MARK.search(rest):
                name, rest = match.groups()
                yield path, number, name, rest


def states(rest: str, text: str) -> bool:
    """Whether the value and nothing longer follows the mark."""
    return re.match(re.escape(text) + r"(?![\w.]*\d)(?!\w)", rest) is not None


def page_problems(root: Path, known: dict[str, str]) -> Iterator[Violation]:
    """Copies that differ, and figures that no page states."""
    used = set()
    for path, number, name, rest in copies(root):
        used.add(name)
        if name not in known:
            yield Violation(path, number, f"figure '{name}' is not in {DATA}")
        elif not states(rest, known[name]):
            yield Violation(path, number, f"figure '{name}' reads '{rest[:12]}', {DATA} has '{known[name]}'")
    for name in sorted(known.keys() - used):
        yield Violation(DATA, line_of(lines(root, DATA), name), f"no page states figure '{name}'")


def found_at(results: Any, path: list[str]) -> float:
    """The number at a path of keys; of a list "name=x" picks an entry, a number the one at this place from 0 on."""
    for key in path:
        if isinstance(results, list) and key.isdecimal():
            results = results[int(key)] if int(key) < len(results) else None
        elif isinstance(results, list):
            name, _, value = key.partition("=")
            results = next((entry for entry in results if str(entry[name]) == value), None)
        else:
            results = results.get(key) if isinstance(results, dict) else None
        if results is None:
            raise KeyError(key)
    return float(results)


def constant(root: Path, file: str, name: str) -> float:
    """The value of a constant of the firmware."""
    pattern = re.compile(rf"\s*#define {re.escape(name)} (-?[\d.]+)[UFL]*\b")
    match = next(filter(None, map(pattern.match, lines(root, Path(file)))), None)
    if match is None:
        raise KeyError(name)
    return float(match.group(1))


def matched(root: Path, file: str, pattern: str) -> float:
    """The number that the group of a pattern finds in the only line of a file that has it."""
    found = [match.group(1) for line in lines(root, Path(file)) if (match := re.search(pattern, line))]
    if len(found) != 1:
        raise KeyError(pattern)
    return float(found[0])


def source_of(root: Path, figure: Figure, results: Path | None) -> tuple[str, float] | None:
    """The source of a figure by name, and the number there; nothing for a figure without a source."""
    if "match" in figure:
        file, pattern = figure["match"]
        return file, matched(root, file, pattern)
    if "define" in figure:
        file, name = figure["define"]
        return file, constant(root, file, name)
    if "path" in figure and results is not None:
        return results.name, found_at(json.loads(results.read_text(encoding="utf-8")), figure["path"])
    return None


def source_problem(root: Path, name: str, figure: Figure, results: Path | None) -> str | None:
    """Why the text of a figure is not what its source gives, rounded as the text is."""
    match = NUMBER.match(figure["text"])
    if match is None:
        return f"figure '{name}': no number in '{figure['text']}'"
    try:
        source = source_of(root, figure, results)
    except (KeyError, TypeError, ValueError, OSError):
        return f"figure '{name}': nothing at {figure.get('path') or figure.get('define') or figure.get('match')}"
    if source is None:
        return None
    rounded = f"{source[1] / figure.get('scale', 1):.{len(match.group(1) or '')}f}"
    if rounded != match.group(0).replace("−", "-"):
        return f"figure '{name}' reads '{figure['text']}', {source[0]} gives {rounded}"
    return None


def check(root: Path, campaign: Path | None = None) -> Iterator[Violation]:
    """Pages against the data file, the data file against the results."""
    sections = read(root)
    yield from page_problems(root, {name: f["text"] for section in sections.values() for name, f in section.items()})
    for title, section in sections.items():
        results = campaign if title == "campaign" else root / RESULTS[title] if title in RESULTS else None
        for name, figure in section.items():
            if problem := source_problem(root, name, figure, results):
                yield Violation(DATA, line_of(lines(root, DATA), name), problem)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="figures")
    parser.add_argument("--root", type=Path, default=PROJECT)
    parser.add_argument("--campaign", type=Path, help="summary.json of a campaign, to compare its section with")
    arguments = parser.parse_args()
    sys.exit(report(check(arguments.root, arguments.campaign), "figures"))
