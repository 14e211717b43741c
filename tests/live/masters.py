# SPDX-License-Identifier: Apache-2.0
"""What a session needs of an XCP master before its first command."""

from typing import Self


class ConnectedMaster:
    """A master in place of pyxcp's, which needs a bus."""

    def __init__(self) -> None:
        self.is_closed = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.is_closed = True

    def connect(self) -> None:
        """Begin the session."""

    def cond_unlock(self) -> None:
        """Give the key."""
