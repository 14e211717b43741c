# SPDX-License-Identifier: Apache-2.0
"""The campaign's folder: one Parquet file per finished case, so that a run can be stopped and continued."""

import contextlib
import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pandas as pd

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.outputs import PREFIX, atomic, write_text

MANIFEST: Final = "campaign.json"
RESULTS: Final = "results.parquet"


@dataclass(frozen=True)
class Store:
    """Results on disk."""

    folder: Path

    @property
    def _cases(self) -> Path:
        return self.folder / "cases"

    @contextlib.contextmanager
    def opened(self, manifest: dict[str, Any], fresh: bool) -> Iterator[None]:
        """The folder for one run; a run that finishes no case leaves no folder that was not there before."""
        missing = [path for path in (self.folder, *self.folder.parents) if not path.exists()]
        try:
            self.open(manifest, fresh)
            yield
        except BaseException:
            if missing and not any(self._cases.glob("case-*")):
                shutil.rmtree(missing[-1], ignore_errors=True)
            raise

    def open(self, manifest: dict[str, Any], fresh: bool) -> None:
        """Make the folder or continue with it; results of another campaign or another firmware are not mixed in."""
        path = self.folder / MANIFEST
        if fresh and path.is_file():
            shutil.rmtree(self._cases, ignore_errors=True)
            path.unlink()
        try:
            self._cases.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FluxtrueError(f"--out {self.folder}: cannot be made ({error.strerror})") from error
        for scratch in self._cases.glob(f"{PREFIX}*"):  # of a run that was killed
            scratch.unlink(missing_ok=True)
        if not path.is_file():
            write_text(path, json.dumps(manifest, indent=1) + "\n")
            return
        was = self._manifest(path)
        for key in manifest | was:
            if manifest.get(key) != was.get(key):
                raise FluxtrueError(
                    f"{path}: these results were made with another {key}, allowed: the same one, another --out, or "
                    "--fresh to throw them away"
                )

    @staticmethod
    def _manifest(path: Path) -> dict[str, Any]:
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError) as error:
            raise FluxtrueError(f"{path}: not a campaign's manifest ({error})") from error
        if not isinstance(data, dict):
            raise FluxtrueError(f"{path}: not a campaign's manifest")
        return data

    def _path(self, case: int) -> Path:
        return self._cases / f"case-{case:05d}.parquet"

    def missing(self, cases: range) -> list[int]:
        """What is still to be run."""
        return [case for case in cases if not self._path(case).is_file()]

    def save(self, case: int, rows: list[dict[str, Any]]) -> None:
        """Save a case completely or not at all; a case without a window has no file."""
        if not rows:
            return
        with atomic(self._path(case)) as scratch:
            pd.DataFrame(rows).to_parquet(scratch, index=False, write_page_checksum=True)

    def _case(self, case: int) -> pd.DataFrame:
        """A finished case; one whose file was damaged would change the figures of all."""
        path = self._path(case)
        try:
            return pd.read_parquet(path, page_checksum_verification=True)
        except Exception as error:  # what the reader raises on damaged files is not documented
            said = " ".join(str(error).split())[:120] or type(error).__name__
            raise FluxtrueError(f"{path}: not the results of a case ({said}), allowed: the file as the campaign has "
                                "written it; without it the same command runs the case again") from None  # fmt: skip

    def load(self, cases: range) -> pd.DataFrame:
        """Every finished case of the range, and the same as one file."""
        frames = [self._case(case) for case in cases if self._path(case).is_file()]
        if not frames:
            raise FluxtrueError(f"{self.folder}: no case has a window: no plant reaches windows.torque_min_Nm at any "
                                "speed drawn, allowed: less torque, lower speeds or a smaller spread")  # fmt: skip
        table = pd.concat(frames, ignore_index=True)
        with atomic(self.folder / RESULTS) as scratch:
            table.to_parquet(scratch, index=False)
        return table
