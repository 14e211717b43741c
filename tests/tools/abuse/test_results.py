# SPDX-License-Identifier: Apache-2.0
"""The folder of a campaign that goes on: a case whose file was damaged is refused, or is what was written."""

import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from abused import ABUSED, MEMORY, Blob
from hypothesis import given
from mutations import mutated_bytes, mutated_words

from fluxtrue_tools.campaign.store import MANIFEST, Store
from fluxtrue_tools.errors import FluxtrueError

ROWS = [{"case": 0, "controller": name, "speed_rpm": 500.0 + k, "error_percent": np.sin(k), "finite": True}
        for k in range(40) for name in ("tables", "robust")]  # fmt: skip
WRITTEN = {"campaign file": "0123abcd", "firmware or plant": "89abcdef"}
FOLDER = MEMORY if MEMORY.is_dir() else None


@cache
def case() -> bytes:
    """The file of a finished case."""
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder))
        store.open(WRITTEN, fresh=False)
        store.save(0, ROWS)
        return next(Path(folder).glob("cases/*")).read_bytes()


@ABUSED
@given(mutated_bytes(case))
def test_a_damaged_case_is_refused_or_what_was_written(changed: tuple[Blob, bool]) -> None:
    with tempfile.TemporaryDirectory(dir=FOLDER) as folder:
        store = Store(Path(folder))
        store.open(WRITTEN, fresh=False)
        store.save(0, ROWS)
        path = next(Path(folder).glob("cases/*"))
        path.write_bytes(changed[0])
        try:
            table = store.load(range(1))
        except FluxtrueError as error:
            assert str(path) in str(error) and "\n" not in str(error)
            assert not (Path(folder) / "results.parquet").exists()
        else:
            assert not changed[1]
            pd.testing.assert_frame_equal(table, pd.DataFrame(ROWS))


@ABUSED
@given(mutated_words('{"campaign file": "0123abcd", "firmware or plant": "89abcdef"}\n'))
def test_results_with_a_damaged_manifest_are_not_mixed_with_others(changed: str | bytes) -> None:
    with tempfile.TemporaryDirectory(dir=FOLDER) as folder:
        path = Path(folder) / MANIFEST
        path.write_bytes(changed.encode() if isinstance(changed, str) else changed)
        try:
            Store(Path(folder)).open(WRITTEN, fresh=False)
        except FluxtrueError as error:
            assert str(path) in str(error) and "\n" not in str(error)
        else:
            text = path.read_text()
            assert all(f'"{value}"' in text for value in WRITTEN.values())
