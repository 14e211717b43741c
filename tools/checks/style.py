# SPDX-License-Identifier: Apache-2.0
"""Licence lines, file sizes, line lengths, include guards, top level, words out of place; prose of the pages."""

import fnmatch
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from prose import check_markdown
from tree import Violation, files, lines, run

TOP_LEVEL = {
    "CMakeLists.txt", "CMakePresets.json", "README.md", "LICENSE", "CONTRIBUTING.md", "CHANGELOG.md", "firmware",
    "hal", "tests", "tools", "docs", ".ci", ".gitignore", ".clang-format", ".editorconfig",
    ".clang-tidy", ".ruff.toml", ".pre-commit-config.yaml", ".github", "build", ".git",
}  # fmt: skip

# Largest number of lines of a file; the first match counts. Constant tables are data, not code.
MAX_LINES = (
    ("firmware/fx/*_table.c", 2000),
    ("firmware/fx/*.c", 150),
    ("firmware/types/*.h", 80),
    ("firmware/signal/*.c", 120),
    ("firmware/control/*/*.c", 200),
    ("firmware/safety/*.c", 200),
    ("firmware/comm/*.c", 200),
    ("firmware/drive/*.c", 250),
    ("firmware/storage/*.c", 200),
    ("firmware/scope/*.c", 250),
    ("firmware/calibration/*.c", 200),
    ("firmware/ecu/*.c", 250),
    ("hal/*/registers.h", 2000),  # generated
    ("hal/*/*.[ch]", 300),
    ("hal/*.h", 60),
    ("tests/plant/*.c", 300),
)

SOURCES = {".c", ".h", ".py", ".cmake", ".toml", ".txt"}
SPDX = "SPDX-License-Identifier: Apache-2.0"
# As in .clang-format and .editorconfig.
MAX_COLUMNS = 120

# Marks of unfinished work, and words that describe how a text was written instead of the project.
FORBIDDEN = (
    r"\b(TODO|FIXME|XXX|HACK)\b",
    r"/work/",
    r"/tmp/brief",
    r"\.\./shared\b",
    r"\bissue[ #]*\d+",
    r"\b(this|previous|next|another) session\b",
    r"\bartifact[-_]registry\b|\bpkg\.dev\b",
    r"\b(Claude|Anthropic|ChatGPT|OpenAI|Copilot)\b",
    r"\bas an AI\b|\blanguage model\b",
)
WORDS = re.compile("|".join(FORBIDDEN), re.IGNORECASE)
CASED = re.compile(FORBIDDEN[0])
# Compiler tricks and single instructions have names in firmware/fx, which say what they save (fx/codegen.h).
TRICK = re.compile(r"\b(__asm__|asm|fx_arch_\w+)\b\s*(?:volatile\b|goto\b)?\s*\(")
HINT = re.compile(
    r"(__builtin_\w+|#pragma|_Pragma|__OPTIMIZE__)\b"
    r"|__attribute__\(\(.*\b(always_inline|cold|flatten|may_alias|noinline)\b"
)
# Files that have to contain what they forbid.
EXEMPT = {"tools/checks/style.py", "tests/tools/test_checks.py"}


def size_limit(path: Path) -> int | None:
    """The largest number of lines that this file may have."""
    for pattern, limit in MAX_LINES:
        if fnmatch.fnmatch(str(path), pattern) and pattern.count("/") == str(path).count("/"):
            return limit
    return None


def is_source(path: Path, text: list[str]) -> bool:
    """Whether the file must carry the licence line."""
    return path.suffix in SOURCES or bool(text and text[0].startswith("#!"))


def forbidden_word(path: Path, line: str) -> str | None:
    """The first word of the line that does not belong into the project."""
    if str(path) in EXEMPT or path.name == "LICENSE":
        return None
    for match in WORDS.finditer(line):
        is_mark = match.group(0).upper() in {"TODO", "FIXME", "XXX", "HACK"}
        if not is_mark or CASED.search(line):
            return match.group(0)
    return None


def guard_problem(path: Path, text: list[str]) -> str | None:
    """A header's guard is its path below firmware/ (or its name, in other places)."""
    guard = next((line.split()[1] for line in text if re.match(r"#ifndef \w+", line)), None)
    name = re.sub(r"\W", "_", path.name).upper()
    folder = path.parent.name.upper()
    if guard is None or not guard.endswith(name):
        return f"include guard '{guard}', wanted one ending in {name}"
    if path.parts[0] == "firmware" and guard != f"{folder}_{name}":
        return f"include guard '{guard}', wanted {folder}_{name}"
    return None


def hidden_trick(path: Path, line: str) -> str | None:
    """An instruction by hand, or a hint for the compiler that has a name in fx/codegen.h, outside firmware/fx. A port
    may contain instructions and must place functions itself, but not use the tricks of the library."""
    if (
        path.suffix not in {".c", ".h"}
        or path.parts[0] not in {"firmware", "hal"}
        or path.parts[:2] == ("firmware", "fx")
    ):
        return None
    found = TRICK.search(line)
    if found and (path.parts[0] == "firmware" or found[1].startswith("fx_arch_")):
        return found[1]
    hint = HINT.search(line)
    return (hint[1] or hint[2]) if hint and "section(" not in line else None


def check_file(root: Path, path: Path) -> Iterator[Violation]:
    """Everything about one file."""
    text = lines(root, path)
    if is_source(path, text) and not any(SPDX in line for line in text[:3]):
        yield Violation(path, 1, f"no '{SPDX}' in the first three lines")
    limit = size_limit(path)
    if limit is not None and len(text) > limit:
        yield Violation(path, len(text), f"{len(text)} lines, at most {limit}")
    if path.suffix == ".h" and (problem := guard_problem(path, text)):
        yield Violation(path, 1, problem)
    if path.suffix == ".md":
        yield from check_markdown(path, text)
    for number, line in enumerate(text, start=1):
        if word := forbidden_word(path, line):
            yield Violation(path, number, f"'{word}' does not belong here")
        if trick := hidden_trick(path, line):
            yield Violation(path, number, f"'{trick}' belongs into firmware/fx, behind a name that says what it does")
        if path.suffix in {".c", ".h", ".py"} and len(line) > MAX_COLUMNS:
            yield Violation(path, number, f"{len(line)} columns, at most {MAX_COLUMNS}")


def check(root: Path) -> Iterator[Violation]:
    """The whole checkout."""
    for entry in sorted(root.iterdir()):
        if entry.name not in TOP_LEVEL:
            yield Violation(Path(entry.name), 1, "does not belong at the top level")
    for path in files(root):
        yield from check_file(root, path)


if __name__ == "__main__":
    sys.exit(run(check, "style"))
