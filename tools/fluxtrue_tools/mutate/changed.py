# SPDX-License-Identifier: Apache-2.0
"""Sources that differ from another branch, for a quick measurement of a change."""

import subprocess
from collections.abc import Sequence
from pathlib import Path

from fluxtrue_tools.errors import FluxtrueError


def _git(root: Path, *words: str) -> str | None:
    try:
        run = subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return None
    return run.stdout.strip() if run.returncode == 0 else None


def changed(root: Path, base: str, files: Sequence[str]) -> list[str] | None:
    """Those of the files that differ from the merge base, in commits or not yet; None where git knows no such base."""
    for name in (base, f"origin/{base}"):
        commit = _git(root, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{name}^{{commit}}")
        if commit and (found := _git(root, "merge-base", "HEAD", commit)):
            differing = _git(root, "diff", "--name-only", "--relative", found)
            untracked = _git(root, "ls-files", "--others", "--exclude-standard")
            if differing is None or untracked is None:
                raise FluxtrueError(f"{root}: git cannot compare with {found}")
            present = set(differing.splitlines()) | set(untracked.splitlines())
            return [file for file in files if file in present]
    return None
