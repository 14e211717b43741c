# SPDX-License-Identifier: Apache-2.0
"""The server's end of the process that measures."""

from collections.abc import Callable
from typing import Any, Final, Protocol

from fluxtrue_tools.commission.steps import Found
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.bus_process import BusProcess, Receiver
from fluxtrue_tools.live.control import NO_COMMANDS
from fluxtrue_tools.live.pace import InStep
from fluxtrue_tools.live.wizard.process import Job, Setup, run

ACTIONS: Final = ("hand", "let_go", "stop", "reset_faults")


class Listener(Protocol):
    """What is told how a step goes. The thread that receives calls it."""

    def progressed(self, step_s: float) -> None: ...
    def found(self, step: str, found: Found) -> None: ...
    def refused(self, step: str, why: str) -> None: ...


class Measuring(BusProcess):
    """Steps in place of torque: what a page may do with an inverter whose motor is not known."""

    def __init__(self, setup: Setup, receivers: list[Receiver], in_step: InStep | None, listener: Listener) -> None:
        self._told: dict[str, Callable[..., None]] = {
            "progress": listener.progressed, "found": listener.found, "refused": listener.refused}  # fmt: skip
        super().__init__(setup, receivers, in_step, run)

    def act(self, action: str, *values: Any) -> None:
        """Stop, signs of life, the reset of faults."""
        if action not in ACTIONS:
            raise FluxtrueError(NO_COMMANDS)
        super().act(action, *values)

    def do(self, job: Job) -> None:
        """Begin a step."""
        self.send("do", job)

    def take(self, message: tuple[Any, ...]) -> None:
        """One message of the child."""
        kind, *content = message
        if kind in self._told:
            self._told[kind](*content)
        else:
            super().take(message)
