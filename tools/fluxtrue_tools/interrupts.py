# SPDX-License-Identifier: Apache-2.0
"""SIGINT and SIGTERM end a command, also if the exception that they raise is lost.

A signal handler runs wherever the interpreter happens to be. In a finaliser or a callback of a library an exception is
printed and discarded: the command would go on as if no signal had come. A loop that takes long therefore asks, between
two steps, whether a signal has come.
"""

import signal
from types import FrameType

_received: list[int] = []


def _raise(number: int) -> None:
    if number == signal.SIGINT:
        raise KeyboardInterrupt
    raise SystemExit(128 + number)


def _handle(number: int, _frame: FrameType | None) -> None:
    _received.append(number)
    _raise(number)


def install() -> None:
    """Let both signals end the command as Ctrl-C does: incomplete output files are removed first.

    A SIGINT that is ignored, as in a job that a shell has started in the background, stays so.
    """
    signal.signal(signal.SIGTERM, _handle)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _handle)


def raise_if_received() -> None:
    """Raise the exception of a signal that has come, again."""
    if _received:
        _raise(_received[-1])
