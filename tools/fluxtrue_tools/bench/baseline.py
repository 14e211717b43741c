# SPDX-License-Identifier: Apache-2.0
"""The committed figures: compared exactly, rewritten by one command."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fluxtrue_tools.bench.build import ROOT
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.outputs import write_text

BASELINE = ROOT / "docs" / "performance.json"
PAGE = ROOT / "docs" / "performance.md"
HOW = "accept with: tools/fluxtrue bench --update"


def differences(old: Any, new: Any, at: str = "") -> Iterator[str]:
    """One line for each figure that changed, appeared or vanished."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in [*old, *(k for k in new if k not in old)]:
            below = f"{at} / {key}" if at else str(key)
            if key not in new:
                yield f"{below}: {old[key]}, now gone"
            elif key not in old:
                yield f"{below}: new, {new[key]}"
            else:
                yield from differences(old[key], new[key], below)
    elif old != new:
        yield f"{at}: {old} → {new}"


def load(path: Path = BASELINE) -> dict[str, Any]:
    """The committed figures."""
    try:
        read = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FluxtrueError(f"{path}: {error.strerror}; write it with: tools/fluxtrue bench --update") from error
    except json.JSONDecodeError as error:
        raise FluxtrueError(f"{path}: no JSON: {error}") from error
    if not isinstance(read, dict) or "compiler" not in read:
        raise FluxtrueError(f"{path}: compiler is missing; write it with: tools/fluxtrue bench --update")
    return read


def other_compiler(committed: dict[str, Any], here: str) -> str | None:
    """Why the figures cannot be compared; empty if they can."""
    if committed["compiler"] == here:
        return None
    return f"not compared: the baseline is of '{committed['compiler']}', here is '{here}'"


def compare(committed: dict[str, Any], figures: dict[str, Any], page: str, committed_page: str) -> list[str]:
    """Every difference; empty without any."""
    found = list(differences(committed, figures))
    if not found and page != committed_page:
        found.append(f"{PAGE.name} is not what the figures give")
    return found


def write(figures: dict[str, Any], page: str, baseline: Path = BASELINE, document: Path = PAGE) -> None:
    """Write both files; each is replaced only when it is complete."""
    for path, text in ((baseline, json.dumps(figures, indent=1, ensure_ascii=False) + "\n"), (document, page)):
        write_text(path, text)
