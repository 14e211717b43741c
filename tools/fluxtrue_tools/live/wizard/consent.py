# SPDX-License-Identifier: Apache-2.0
"""Whether a step may continue: the page that has started it still responds, and Stop has not been pressed.

Pure decisions on a clock that the caller brings. Any thread.
"""

import threading
from typing import Final

from fluxtrue_tools.live.commander import HAND_TIMEOUT_S

GONE: Final = f"The page with control was closed or silent for {HAND_TIMEOUT_S:g} s."
NEXT: Final = "Nothing was changed. The step can be done again."


class Consent:
    """Given for one step by the page with control; it ends with the step, by Stop, or when that page is gone."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._is_given = False
        self._seen_s = 0.0
        self._why = ""

    def give(self, now_s: float) -> None:
        """A step begins."""
        with self._lock:
            self._is_given, self._seen_s, self._why = True, now_s, ""

    def hand(self, now_s: float) -> None:
        """Record a report from the page that has control."""
        with self._lock:
            self._seen_s = now_s

    def withdraw(self, why: str) -> bool:
        """Stop, or the page has closed; whether a step has to end. The first reason stays."""
        with self._lock:
            if not self._is_given:
                return False
            self._why = self._why or why
            return True

    def check(self, now_s: float) -> str:
        """Why the step has to end now; empty while it may go on."""
        with self._lock:
            if self._is_given and not self._why and now_s - self._seen_s > HAND_TIMEOUT_S:
                self._why = GONE
            return self._why if self._is_given else ""

    def end(self) -> str:
        """The step has ended; why it had to, or empty."""
        with self._lock:
            self._is_given, why = False, self._why
            return why
