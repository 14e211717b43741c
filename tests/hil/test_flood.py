# SPDX-License-Identifier: Apache-2.0
"""Other nodes that misbehave: the control is not affected unless its commands are lost."""

from collections.abc import Iterator

import can
import e2e
import numpy as np
import pytest
from rig import COMMAND, MS, Command, Rig

from fluxtrue_tools.vecu.stepped import client_port

FULL = 38  # frames of 8 bytes in 10 ms: more than 500 kbit/s carry
TRUTH = "truth.torque_shaft_mean_Nm"


class Peer:
    """Another node; simulated time continues only when the virtual ECU has received its frames."""

    def __init__(self, rig: Rig, client: can.BusABC) -> None:
        self._rig, self._client, self._posted = rig, client, 0

    def post(self, frame_id: int, data: bytes, count: int = 1) -> None:
        """Send so many frames at once."""
        for _ in range(count):
            self._client.send(can.Message(arbitration_id=frame_id, data=data, is_extended_id=False))
        self._posted += count
        self._rig.stand.run(0.0, client_port(self._client), self._posted)


@pytest.fixture
def peer(rig: Rig, second_client: can.BusABC) -> Iterator[Peer]:
    yield Peer(rig, second_client)


def drive(rig: Rig, peer: Peer | None, frame_id: int = 0, per_ms: float = 0.0, seconds: float = 1.0) -> str:
    """A short drive while another node sends; the result is the hash of all duties."""
    rig.power_cycle(seed=7)
    rig.expected.load = rig.expected.frames = True
    rig.expected.counters |= {"Ignored"}
    rig.keep_frames = False
    rig.stand.set(current_noise_A_rms=0.5)
    rig.turn(2000.0)
    rig.start(50.0)
    rig.stand.duty_hash()
    owed = 0.0
    for ms in range(round(seconds / MS)):
        rig.ask(torque_Nm=50.0 if ms % 400 < 200 else -30.0)
        owed += per_ms
        if peer is not None and owed >= 1.0:
            peer.post(frame_id, bytes(range(8)), int(owed))
            owed -= int(owed)
        rig.advance(MS)
    return rig.stand.duty_hash()


@pytest.mark.plant
@pytest.mark.parametrize(
    ("frame_id", "per_ms", "load"),
    # 0x001 has priority over all others: with two such frames per millisecond the command still arrives in its step.
    [(0x7FF, 4.0, 0.99), (0x400, 4.0, 0.99), (0x001, 2.0, 0.7)],
    ids=["full_load_below_us", "full_load_in_between", "babbling_above_us"],
)
def test_a_node_that_fills_the_bus_changes_no_duty(
    rig: Rig, peer: Peer, frame_id: int, per_ms: float, load: float
) -> None:
    quiet = drive(rig, None)
    loud = drive(rig, peer, frame_id, per_ms)
    assert loud == quiet
    assert rig.stand.counters()["load_peak"] > load
    assert rig.signal("INV_DiagReceive", "TimeOuts") == 0.0


@pytest.mark.plant
def test_the_hash_of_duties_tells_journeys_apart(rig: Rig) -> None:
    """The hash depends on the duties: otherwise the test above could not fail."""
    assert drive(rig, None, seconds=0.3) == drive(rig, None, seconds=0.3)
    assert drive(rig, None, seconds=0.3) != drive(rig, None, seconds=0.301)


@pytest.mark.plant
def test_a_node_that_blocks_the_bus_takes_the_torque_away_within_50_ms(rig: Rig, peer: Peer) -> None:
    rig.expected.load = rig.expected.frames = True
    rig.expected.counters |= {"Ignored", "TimeOuts", "Jumps", "Repeated", "SkippedCommands", "NotSent"}
    rig.turn(2000.0)
    rig.start(80.0)
    rig.advance(0.5)
    trace = rig.record([TRUTH], 1)
    for _ in range(15):
        peer.post(0x000, bytes(8), FULL)
        rig.advance(10 * MS)
    # The bus is blocked from the first frame on; the last command was received 10 ms before.
    assert np.abs(trace[TRUTH][round(50 * MS / 1e-4) :]).max() < 1.0
    rig.advance(1.0)  # the frames that are still queued are transmitted
    assert rig.state == "ready"


@pytest.mark.plant
def test_a_second_commander_is_found_out(rig: Rig, peer: Peer) -> None:
    """Two senders of commands count independently, so that the sequence of counters is invalid."""
    rig.expected.faults = rig.expected.load = rig.expected.frames = True
    rig.expected.counters |= {"Jumps", "Repeated", "SkippedCommands", "TimeOuts"}
    rig.start(30.0)
    rig.advance(0.3)
    foreign = e2e.Sender(rig.data_id(COMMAND), 9)
    data = rig.encode(Command(enable=True, mode="torque", torque_Nm=120.0))
    for _ in range(20):
        peer.post(rig.by_name[COMMAND].frame_id, foreign.protect(data))
        rig.advance(10 * MS)
    assert rig.state == "fault"
