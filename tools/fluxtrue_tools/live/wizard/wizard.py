# SPDX-License-Identifier: Apache-2.0
"""The cards of the wizard: one step after the other, each done with the user's consent, accepted or repeated.

Nothing is changed until a result is accepted: the next step then builds on it. After the last one the motor's folder is
written. Pages act in the thread of the server, results arrive in the thread that receives; a lock keeps them apart.
"""

import math
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.steps import TURNING, Found, Step, announcement
from fluxtrue_tools.commission.turning import LIMIT_SHARE
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.wizard.folder import Folder, written
from fluxtrue_tools.live.wizard.results import TITLES, Row, rows
from fluxtrue_tools.motor.map_import.folder import name_from

NAME: Final = "my-motor"
SOURCE_MAX: Final = 60
MAGNET_BEFORE: Final = "resistance"  # its evaluation needs the flux linkage of the magnet
MAGNET_BY: Final = "spin"  # measures it


@dataclass
class Card:
    """One step. State: waiting, next, running, found, accepted, refused."""

    step: Step
    state: str = "waiting"
    refused: str = ""  # why it ended without a result
    found: Found | None = None
    rows: list[Row] = field(default_factory=list)  # of its result
    number: int = 0  # of the result, so that a page asks for the new picture


@dataclass
class Finish:
    """The motor's folder. State: waiting, writing, written, refused."""

    state: str = "waiting"
    refused: str = ""
    folder: Folder | None = None


class Wizard:
    """What the pages see and may do. `begin` starts a step in the process that measures."""

    def __init__(self, steps: list[Step], nameplate: Path, known: Nameplate, full_scale_A: float,
                 slower: float) -> None:  # fmt: skip
        self._cards = {step.name: Card(step) for step in steps}
        self._nameplate, self._known, self._full_scale_A, self._slower = nameplate, known, full_scale_A, slower
        self._name, self._step_s, self._number = NAME, 0.0, 0
        self._finish = Finish()
        self._lock = threading.RLock()
        self.thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="wizard")  # pictures and folder
        self.begin: Callable[[Step, tuple[str, ...], Found, Nameplate], None] | None = None
        self._advance()

    # What the pages see.

    def offer(self) -> list[dict[str, Any]]:
        """What each step does: the same words as of commission --dry-run, and how long the drive runs."""
        return [{"name": step.name, "title": TITLES[step.name], "does": announcement(step, self._known),
                 "seconds": self._seconds(step), "turns": step.name in TURNING}
                for step in (card.step for card in self._cards.values())]  # fmt: skip

    @property
    def most_rpm(self) -> float:
        """The speed at which the firmware ends a movement."""
        return LIMIT_SHARE * self._known.speed_max_rpm

    @property
    def measures_magnet(self) -> bool:
        """Whether a step measures its flux linkage; otherwise the user can give it."""
        return MAGNET_BY in self._cards

    def _seconds(self, step: Step) -> float:
        return step.bus_seconds or step.seconds * self._slower

    def shown(self) -> dict[str, Any]:
        """The present state."""
        with self._lock:
            known, finish = self._known, self._finish
            return {
                "cards": {name: self._shown(card) for name, card in self._cards.items()},
                "known": {"name": self._name, "psi_f_mVs": 1e3 * known.psi_f_Vs, "source": known.psi_f_source,
                          "open": self._is_open()},
                "finish": {"state": finish.state, "refused": finish.refused,
                           "report": finish.folder.report if finish.folder else ""},
            }  # fmt: skip

    def _shown(self, card: Card) -> dict[str, Any]:
        return {"state": card.state, "refused": card.refused, "number": card.number,
                "step_s": round(self._step_s, 1) if card.state == "running" else 0.0,
                "rows": card.rows}  # fmt: skip

    def result(self, name: str) -> tuple[Found, Nameplate, int]:
        """What a step has found, what was known then, and the number of the result."""
        with self._lock:
            card = self._cards.get(name)
            if card is None or card.found is None:
                raise FluxtrueError(f"{name}: nothing has been found")
            return card.found, card.found.known(self._known), card.number

    @property
    def folder(self) -> Folder | None:
        """The motor's folder, when it has been written."""
        with self._lock:
            return self._finish.folder

    # What a page with control may do.

    def _is_open(self) -> bool:
        """Whether the name, and the magnet's flux linkage if no step measures it, can still be given."""
        return self._cards[MAGNET_BEFORE].state in ("waiting", "next", "refused")

    def _check_name(self, name: str) -> None:
        if not self._is_open():
            raise FluxtrueError("name and psi_f: the resistance has been measured with the present values, allowed: "
                                "before that step")  # fmt: skip
        if name != name_from(Path("/") / name) or not name:
            raise FluxtrueError(f"name {name!r}: allowed: letters, digits, blank and _.+-, at most 48")

    def call(self, name: str) -> None:
        """The user's name for the motor."""
        with self._lock:
            self._check_name(name)
            self._name = name

    def know(self, name: str, psi_f_mVs: float, source: str) -> None:
        """The name, and the flux linkage of the magnet with its source."""
        with self._lock:
            self._check_name(name)
            if not (math.isfinite(psi_f_mVs) and psi_f_mVs > 0.0):
                raise FluxtrueError(f"psi_f {psi_f_mVs:g} mV·s: allowed: more than 0")
            if not source.isprintable() or len(source) > SOURCE_MAX or not source.strip():
                raise FluxtrueError(f"source of psi_f: wanted: a few words, at most {SOURCE_MAX} characters")
            self._name = name
            self._known = replace(self._known, psi_f_Vs=1e-3 * psi_f_mVs, psi_f_source=source.strip())

    def _card(self, name: str, *states: str) -> Card:
        card = self._cards.get(name)
        if card is None:
            raise FluxtrueError(f"step {name!r}: allowed: {', '.join(self._cards)}")
        if card.state not in states:
            raise FluxtrueError(f"step {name}: not now, it is {card.state}")
        return card

    def do(self, name: str, may_turn: bool) -> None:
        """The user consents to a step, or repeats it: a result that was not accepted is discarded.

        may_turn   the user has also agreed that the shaft turns, for this time
        """
        with self._lock:
            card = self._card(name, "next", "refused", "found")
            if name in TURNING and not may_turn:
                raise FluxtrueError(f"step {name}: it turns the shaft, allowed: with the consent to that")
            done = tuple(name for name, card in self._cards.items() if card.state == "accepted")
            accepted = self._cards[done[-1]].found if done else None
            card.state, card.found, card.rows, card.refused = "running", None, [], ""
            self._step_s = 0.0
            assert self.begin is not None
            self.begin(card.step, done, accepted or Found(), self._known)

    def accept(self, name: str) -> None:
        """The result counts; after the last one the folder is written."""
        with self._lock:
            self._card(name, "found").state = "accepted"
            self._advance()
            if all(card.state == "accepted" for card in self._cards.values()):
                self._finish.state = "writing"
                self.thread.submit(self._write)

    def _advance(self) -> None:
        """The first step that has not been accepted is the next one."""
        card = next((card for card in self._cards.values() if card.state != "accepted"), None)
        if card is not None and card.state == "waiting":
            card.state = "next"

    def _write(self) -> None:
        found, known, _ = self.result(list(self._cards)[-1])
        try:
            folder = written(found, known, self._nameplate, self._name)
            finish = Finish("written", folder=folder)
        except (FluxtrueError, OSError) as error:
            finish = Finish("refused", str(error))
        with self._lock:
            self._finish = finish

    # How a step goes, by the process that measures.

    def progressed(self, step_s: float) -> None:
        """For this time the drive has run in this step."""
        with self._lock:
            self._step_s = step_s

    def found(self, step: str, found: Found) -> None:
        """A step has ended with a result."""
        with self._lock:
            self._number += 1
            card = self._cards[step]
            card.state, card.found, card.number = "found", found, self._number
            card.rows = rows(step, found, self._known, self._full_scale_A)

    def refused(self, step: str, why: str) -> None:
        """A step has ended without one."""
        with self._lock:
            card = self._cards[step]
            card.state, card.refused = "refused", why

    def close(self) -> None:
        """No picture is drawn any more."""
        self.thread.shutdown(cancel_futures=True)
