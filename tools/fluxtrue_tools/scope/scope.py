# SPDX-License-Identifier: Apache-2.0
"""Configure, arm, wait for and read captures. docs/howto/scope.md has an example."""

import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.a2l.elf import Description, Signal
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.scope.xcp import Master, XcpRefused, checksum, upload

USER = 0xF1
SELECT, SETUP, SAMPLES, ARM, TRIGGER, STOP = 1, 2, 3, 4, 5, 6  # firmware/scope/scope.h
IDLE, ARMED, TRIGGERED, DONE = 0, 1, 2, 3
STATES: Final = ("idle", "armed", "triggered", "done")
TRIGGERS: Final = ("manual", "fault", "rising", "falling", "above", "below")
LEVELS: Final = TRIGGERS[2:]
SIGNALS_MAX, WORDS, DIVISOR_MAX = 8, 6144, 0xFFFF
BLOCK, ATTEMPTS = 2048, 3  # bytes of one checksum; readings of a block before it is an error
BUSY = 0x10
FORMATS: Final = {"U8": "B", "U16": "H", "S16": "h", "U32": "I"}
POLL_S: Final = 0.01


@dataclass(frozen=True)
class Status:
    """The scope's state: what has been armed, and how far the capture is."""

    state: str
    is_freeze_frame: bool
    number: int
    signals: tuple[int, ...]
    trigger: str
    trigger_signal: int
    level: int
    divisor: int
    samples: int
    wanted: int
    first: int
    before: int
    taken: int
    lost: int
    trigger_period: int


@dataclass(frozen=True)
class Capture:
    """A capture that has been read; time 0 is the trigger's sample."""

    time_s: NDArray[np.float64]
    columns: dict[str, NDArray[np.float64]]
    units: dict[str, str]
    texts: dict[str, str]
    trigger: int  # index of its sample
    trigger_period: int  # PWM periods since the start of the drive
    is_freeze_frame: bool
    number: int
    lost: int = 0  # how often the inverter came too late for samples, or a copy of them did not end in time

    @property
    def warning(self) -> str:
        """Why the samples must not be trusted; empty if they may be."""
        if not self.lost:
            return ""
        times = "once" if self.lost == 1 else f"{self.lost} times"
        return (f"the inverter lost samples {times}: its 1 kHz task was late, or a copy did not end in time; values "
                "may be wrong or missing, repeat the capture")  # fmt: skip


@dataclass(frozen=True)
class Setup:
    """What a capture shall be, in the numbers of the firmware."""

    signals: tuple[int, ...]
    trigger: str
    trigger_signal: int
    level: int
    divisor: int
    samples: int
    wanted: int  # samples before the trigger


def _number(known: Mapping[str, Signal], name: str) -> int:
    if name not in known:
        raise FluxtrueError(f"no signal '{name}', allowed: {', '.join(known)}")
    return known[name].number


def _raw_level(signal: Signal, level: float) -> int:
    base = signal.base
    raw = round(level / base.factor) if np.isfinite(level) else 1 << 15
    if not -(1 << 15) <= raw < 1 << 15:
        raise FluxtrueError(f"level {level:g} {base.unit} of {signal.name}, allowed: {-base.full:g} to {base.full:g}")
    return raw


def make_setup(known: Mapping[str, Signal], signals: Sequence[str], trigger: str, on: str | None, level: float,
               before: float, samples: int | None, divisor: int) -> Setup:  # fmt: skip
    """Check what Scope.configure() is given; no connection is needed for that."""
    if not 1 <= len(signals) <= SIGNALS_MAX:
        raise FluxtrueError(f"{len(signals)} signals, allowed: 1 to {SIGNALS_MAX}")
    capacity = WORDS // len(signals)
    count = capacity if samples is None else samples
    if not 1 <= count <= capacity:
        many = "signal" if len(signals) == 1 else "signals"
        raise FluxtrueError(f"{count} samples, allowed with {len(signals)} {many}: 1 to {capacity}")
    if not 0.0 <= before < 1.0:
        raise FluxtrueError(f"share {before:g} before the trigger, allowed: 0 to less than 1")
    if not 1 <= divisor <= DIVISOR_MAX:
        raise FluxtrueError(f"divisor {divisor}, allowed: 1 to {DIVISOR_MAX}")
    if trigger not in TRIGGERS:
        raise FluxtrueError(f"trigger '{trigger}', allowed: {', '.join(TRIGGERS)}")
    numbers = tuple(_number(known, name) for name in signals)
    source = on if on is not None else signals[0]
    number = _number(known, source)
    raw = _raw_level(known[source], level) if trigger in LEVELS else 0
    return Setup(numbers, trigger, number, raw, divisor, count, int(before * count))


class Scope:
    """The scope of one ECU, over an XCP connection that others may use between two calls."""

    def __init__(self, master: Master, description: Description) -> None:
        if not description.signals:
            raise FluxtrueError("this firmware has no scope")
        self._master = master
        self._period_s = description.period_s
        self.signals = {signal.name: signal for signal in description.signals}
        self._names = {signal.number: signal.name for signal in description.signals}
        self._fields = {value.name.removeprefix("scope_"): value for value in description.scope}
        self._armed: Status | None = None

    def configure(self, signals: Sequence[str], trigger: str = "manual", on: str | None = None, level: float = 0.0,
                  before: float = 0.25, samples: int | None = None, divisor: int = 1) -> None:  # fmt: skip
        """What the next arm() captures.

        signals   up to eight names of self.signals
        trigger   manual, fault, rising, falling, above, below; the last four compare the signal `on` (by default the
                  first) with the level, in its unit
        before    share of the samples that lie before the trigger, from 0 to less than 1
        samples   of each signal; by default as many as the memory holds
        divisor   PWM periods from one sample to the next
        """
        self.take(make_setup(self.signals, signals, trigger, on, level, before, samples, divisor))

    def take(self, setup: Setup) -> None:
        """The same, with what has been checked before the connection."""
        for position, number in enumerate(setup.signals):
            self._user(SELECT, position, number)
        self._user(SETUP, len(setup.signals), *setup.divisor.to_bytes(2, "little"), TRIGGERS.index(setup.trigger),
                   setup.trigger_signal)  # fmt: skip
        self._user(SAMPLES, *struct.pack("<HHh", setup.samples, setup.wanted, setup.level))
        self._wanted = (setup.signals, setup.trigger, setup.trigger_signal, setup.level, setup.divisor, setup.samples,
                        setup.wanted)  # fmt: skip

    def arm(self) -> Status:
        """Start to record and to wait for the trigger. Refused while another capture or a freeze frame is kept."""
        try:
            self._user(ARM)
        except XcpRefused as error:
            if error.code == BUSY:
                raise FluxtrueError(f"the scope is in use ({self.status().state}): read it or stop() it") from error
            raise
        self._armed = armed = self.status()
        captured = (armed.signals, armed.trigger, armed.trigger_signal, armed.level, armed.divisor, armed.samples,
                    armed.wanted)  # fmt: skip
        if captured != self._wanted:
            self.stop()  # else the next attempt would find the scope in use
            raise FluxtrueError("another XCP master has changed what the scope captures")
        return armed

    def trigger(self) -> None:
        """Trigger now."""
        self._user(TRIGGER)

    def stop(self) -> None:
        """End a capture, or release what it holds."""
        self._user(STOP)
        self._armed = None

    def give_up(self) -> None:
        """Stop the capture that was armed, if it is still ours."""
        if self._armed is not None and self.status().number == self._armed.number:
            self.stop()

    def pass_periods(self, periods: int) -> None:
        """Wait for so many PWM periods."""
        self._master.pass_time(periods * self._period_s)

    def status(self) -> Status:
        """The present state."""
        got = self._header()
        return Status(
            STATES[got["state"]], bool(got["frozen"]), got["number"],
            tuple(got["signal"][: got["signals"]]), TRIGGERS[got["trigger"]], got["trigger_signal"], got["level"],
            got["divisor"], got["samples"], got["wanted"], got["first"], got["before"], got["taken"], got["lost"],
            got["trigger_period"],
        )  # fmt: skip

    def progress(self) -> Status:
        """How far the capture is that was armed. FluxtrueError if it was given up: a fault may have left a freeze frame
        in its place."""
        status = self.status()
        if self._armed is not None and status.number != self._armed.number:
            self._armed = None
            what = "a fault has come first: read() has its freeze frame" if status.is_freeze_frame else (
                "another XCP master has armed the scope")  # fmt: skip
            raise FluxtrueError(f"the capture was given up: {what}")
        return status

    def until_complete(self, seconds: float) -> Status:
        """Wait until the capture that was armed is complete."""
        waited_s = 0.0
        while True:
            status = self.progress()
            if status.state in ("done", "idle"):
                return status
            if waited_s >= seconds:
                missing = ": the trigger has not come" if status.state == "armed" else ""
                raise FluxtrueError(f"no complete capture within {seconds:g} s (the scope is {status.state}{missing})")
            self._master.pass_time(POLL_S)
            waited_s += POLL_S

    def read(self, release: bool = True, most: int | None = None) -> Capture:
        """The complete capture or freeze frame; every block is compared with the checksum that the ECU computes.

        most   samples to read at most, the oldest; by default all
        """
        status = self.status()
        if status.state != "done":
            raise FluxtrueError(f"the scope is {status.state}: there is no capture to read")
        taken = status.taken if most is None else min(most, status.taken)
        data = self._rows(status, taken)
        if self.status() != status:
            raise FluxtrueError("the capture has changed while it was read")
        if release:
            self.stop()
        arrays = np.frombuffer(data, dtype="<i2").reshape(taken, len(status.signals)).T
        chosen = [self.signals[self._names[number]] for number in status.signals]
        index = np.arange(taken, dtype=np.float64) - status.before
        return Capture(
            index * status.divisor * self._period_s,
            {signal.name: array * signal.base.factor for signal, array in zip(chosen, arrays, strict=True)},
            {signal.name: signal.base.unit for signal in chosen}, {signal.name: signal.text for signal in chosen},
            status.before, status.trigger_period, status.is_freeze_frame, status.number, status.lost,
        )  # fmt: skip

    def _user(self, *command: int) -> None:
        self._master.command(USER, *command)

    def _header(self) -> dict[str, Any]:
        fields = [value for value in self._fields.values() if value.name != "scope_memory"]
        start = min(value.address for value in fields)
        end = max(value.address + struct.calcsize(FORMATS[value.type]) for value in fields)
        content = upload(self._master, start, end - start)
        got: dict[str, Any] = {value.name.removeprefix("scope_"): struct.unpack_from("<" + FORMATS[value.type], content,
                                                                     value.address - start)[0]
               for value in fields}  # fmt: skip
        at = self._fields["signal"].address - start
        got["signal"] = content[at : at + SIGNALS_MAX]
        return got

    def _rows(self, status: Status, count: int) -> bytes:
        """The oldest rows; all of them lie in a circle."""
        row = 2 * len(status.signals)
        if count == status.taken:
            whole = self._memory(0, row * status.samples)
            return (whole[row * status.first :] + whole[: row * status.first])[: row * count]
        to_end = min(count, status.samples - status.first)
        return self._memory(row * status.first, row * to_end) + self._memory(0, row * (count - to_end))

    def _memory(self, offset: int, size: int) -> bytes:
        start, content = self._fields["memory"].address + offset, b""
        while len(content) < size:
            content += self._block(start + len(content), min(BLOCK, size - len(content)))
        return content

    def _block(self, address: int, size: int) -> bytes:
        for _ in range(ATTEMPTS):
            block = upload(self._master, address, size)
            if zlib.crc32(block) == checksum(self._master, address, size):
                return block
        raise FluxtrueError(f"{size} bytes of the capture have another checksum in the ECU, {ATTEMPTS} times")
