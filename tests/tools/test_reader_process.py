# SPDX-License-Identifier: Apache-2.0
"""Readers in a process of their own: their arrays arrive, and whatever they do with a damaged file is one line."""

from pathlib import Path

import numpy as np
import pytest

from fluxtrue_tools.reader_process import arrays_from

READER = """
import ctypes
import numpy as np
from fluxtrue_tools.errors import FluxtrueError

class HalfMade:
    def __init__(self):
        self.me = self
        raise KeyError("table")
    def __del__(self):
        raise AttributeError("half made")

def read(path):
    {body}
"""


@pytest.fixture
def reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> str:
    """The name of a module whose function read() has this body."""
    (tmp_path / "a_reader.py").write_text(READER.format(body=request.param))
    monkeypatch.syspath_prepend(str(tmp_path))
    return "a_reader"


@pytest.mark.parametrize(
    "reader", ["print('a word'); return {'a/b': np.arange(3.0), 'text': 'm\\u00b2', 'n': 4}"], indirect=True
)
def test_arrays_and_texts_arrive_by_their_names(reader: str, tmp_path: Path) -> None:
    found = arrays_from(reader, tmp_path / "x")
    assert np.array_equal(found["a/b"], [0.0, 1.0, 2.0]) and str(found["text"]) == "m\u00b2" and int(found["n"]) == 4


@pytest.mark.parametrize(("reader", "said"), [
    ("ctypes.string_at(0)", "the reader crashed"),
    ("return {'a': np.ones(1 << 30)}", "MemoryError: "),
    ("print('hello'); raise OSError('gone')", "OSError: gone"),
    ("HalfMade()", "KeyError: 'table'"),
    ("raise FluxtrueError('no frames')", "no frames"),
    ("raise ValueError('two\\nlines')", "ValueError: two lines"),
], indirect=["reader"])  # fmt: skip
def test_a_failure_is_one_line(reader: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=f"^{said}") as raised:
        arrays_from(reader, tmp_path / "x")
    assert "\n" not in str(raised.value)
