# SPDX-License-Identifier: Apache-2.0
"""Everything behind the page."""

import asyncio
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Protocol

from aiohttp import web

from fluxtrue_tools.live.link import Status
from fluxtrue_tools.live.oscilloscope import Oscilloscope
from fluxtrue_tools.live.pace import InStep
from fluxtrue_tools.live.recorder import Recorder
from fluxtrue_tools.live.replay import Replay
from fluxtrue_tools.live.samples import Samples
from fluxtrue_tools.live.tuning import Tuning
from fluxtrue_tools.live.words import Words

if TYPE_CHECKING:
    from fluxtrue_tools.live.wizard.wizard import Wizard


class BusSide(Protocol):
    """What commands: a Link, or the process that has one."""

    def act(self, action: str, *values: Any) -> None: ...
    def turn(self, knob: str, value: float) -> None: ...
    def status(self) -> Status: ...
    def standing_still(self) -> AbstractContextManager[None]: ...


@dataclass
class Session:
    """The parts of the server, and the pages that are connected."""

    title: str
    torque_max_Nm: float
    samples: Samples
    recorder: Recorder
    words: Words
    link: BusSide | None = None  # None in a replay, where nothing can be commanded
    replay: Replay | None = None
    tuning: Tuning | None = None
    oscilloscope: Oscilloscope | None = None
    wizard: "Wizard | None" = None  # for an unknown motor, in place of torque and tuning
    in_step: InStep | None = None  # simulated time waits for the pages
    viewers: list[web.WebSocketResponse] = field(default_factory=list)
    drawn: dict[web.WebSocketResponse, int] = field(default_factory=dict)  # number of the last batch, page by page
    sending: dict[web.WebSocketResponse, asyncio.Task[None]] = field(default_factory=dict)  # under way, page by page
    changed: asyncio.Event = field(default_factory=asyncio.Event)  # a page has connected, drawn or disconnected
    hand: web.WebSocketResponse | None = None  # the page that has control
    status_sent: Status | None = None  # what the pages know
    last_file: str = ""

    def status(self) -> Status:
        """Commands and state; a replay has the recorded state only."""
        return Status(self.samples.state()) if self.link is None else self.link.status()

    def control(self, page: web.WebSocketResponse) -> str:
        """Whether a page has control, can have it, or another page has it."""
        return "free" if self.hand is None else "mine" if self.hand is page else "other"

    def wall_s(self, seconds: float) -> float | None:
        """A time-out by the wall clock: none where simulated time waits for the pages."""
        return None if self.in_step is not None else seconds


SESSION: Final = web.AppKey("session", Session)
