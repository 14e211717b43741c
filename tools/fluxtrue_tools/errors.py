# SPDX-License-Identifier: Apache-2.0
"""The exception for errors that a user can correct."""


class FluxtrueError(Exception):
    """An error that the user can correct.

    The text is one line naming file, field, value and what was allowed. The command line prints
    it and exits with 2; every other exception is a bug and shows its traceback.
    """

    def __str__(self) -> str:
        return " ".join(super().__str__().split())
