# SPDX-License-Identifier: Apache-2.0
"""The exception for errors that a user can correct, and the words for those of the system."""

import os


class FluxtrueError(Exception):
    """An error that the user can correct.

    The text is one line naming file, field, value and what was allowed. The command line prints
    it and exits with 2; every other exception is a bug and shows its traceback.
    """

    def __str__(self) -> str:
        return " ".join(super().__str__().split())


def of_system(error: OSError) -> str:
    """The system's complaint without Python's number: a program that is missing, or a file with the reason."""
    if error.filename is None:
        return error.strerror or str(error)
    name = os.fsdecode(error.filename)
    is_program = isinstance(error, FileNotFoundError) and os.sep not in name and "." not in name
    return f"{name} not found: install it or run tools/setup" if is_program else f"{name}: {error.strerror}"
