# SPDX-License-Identifier: Apache-2.0
"""Start-up: messages and their cycles, and the behaviour without commands."""

from itertools import pairwise

import pytest
from rig import COMMAND, MS, STATUS, Rig

VERSION = "INV_Version"
FNV_START, FNV_PRIME = 2166136261, 16777619


def test_after_start_the_ecu_reaches_standby_and_tells_its_version(rig: Rig) -> None:
    rig.advance(1.1)
    assert rig.state == "standby"
    assert rig.signal(VERSION, "Interface") == int(rig.database.version)


@pytest.mark.plant
def test_it_says_which_motor_it_was_built_for(rig: Rig) -> None:
    rig.advance(1.1)
    expected = FNV_START
    for byte in b"hsm1":
        expected = (expected ^ byte) * FNV_PRIME % 2**32
    assert int(rig.signal(VERSION, "MotorId")) == expected


def test_every_message_of_the_inverter_comes_in_its_cycle(rig: Rig) -> None:
    rig.advance(3.0)
    times = [frame.time_s for frames in rig.frames.values() for frame in frames]
    heard_s = max(times) - min(times)  # by time stamps: a simulation in real time may fall behind
    assert heard_s > 1.0
    for name, message in rig.by_name.items():
        if "INV" in message.senders:
            # The time may begin right after a frame and end right before one; health.py checks each period.
            assert len(rig.frames[name]) >= heard_s / rig.cycle_s(name) - 1.5, name


@pytest.mark.plant
def test_status_stays_within_300_microseconds_of_its_period_on_a_bus_of_its_own(rig: Rig) -> None:
    rig.advance(1.0)
    times = [frame.time_s for frame in rig.frames[STATUS]][2:]
    periods = [b - a for a, b in pairwise(times)]
    # It is queued at the same point of the task each time; only a command that is on the bus can delay it.
    assert max(abs(period - 10 * MS) for period in periods) <= 0.3 * MS


def test_without_commands_it_stays_in_standby(rig: Rig) -> None:
    rig.is_sending = False
    rig.expected.counters |= {"TimeOuts", "Jumps", "Repeated"}
    rig.advance(2.0)
    assert rig.state == "standby"
    assert rig.signal("INV_Currents", "IdRef") == rig.signal("INV_Currents", "IqRef") == 0.0


@pytest.mark.plant
def test_the_bus_carries_its_cyclic_traffic_below_a_third_of_its_capacity(rig: Rig) -> None:
    rig.advance(2.0)
    counters = rig.stand.counters()
    # The command and 5 messages every 10 ms, 7 every 100 ms, 1 every second: at most 671 frames of 135 bits: 18 %.
    assert 0.10 < counters["load_peak"] < 0.33
    assert rig.counted[STATUS] > 0 and rig.by_name[COMMAND].cycle_time == 10
