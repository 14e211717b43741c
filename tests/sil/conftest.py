# SPDX-License-Identifier: Apache-2.0
"""Drives of one shipped motor, each closed after its test."""

import ctypes
from collections.abc import Callable, Iterator

import pytest
from sil import Drive, load


@pytest.fixture(scope="module")
def library() -> ctypes.CDLL:
    """The motor of a module that names no other."""
    return load("hsm1")


@pytest.fixture
def make(library: ctypes.CDLL) -> Iterator[Callable[[], Drive]]:
    """Creates drives."""
    drives: list[Drive] = []

    def new() -> Drive:
        drives.append(Drive(library))
        return drives[-1]

    yield new
    for drive in drives:
        drive.close()
