# SPDX-License-Identifier: Apache-2.0
"""docs/howto/can.md and the DBC agree about the messages; test_words.py compares names and explanations."""

import re

import pytest
from cantools.database import load_file
from cantools.database.can import Database, Message

from fluxtrue_tools.bus import DBC

ROOT = DBC.parents[2]
PAGE = re.sub(r"<!-- figure: \w+ -->", "", (ROOT / "docs/howto/can.md").read_text(encoding="utf-8"))
ROW = re.compile(r"^\| 0x(\w+)(?:–0x(\w+))? \| `(\w+)…?` \| (vehicle|inverter) \| (\d+) \| (.*) \|$", re.M)
SENDER = {"vehicle": "VCU", "inverter": "INV"}


@pytest.fixture(scope="module")
def dbc() -> Database:
    """The description of the bus."""
    database = load_file(DBC)
    assert isinstance(database, Database)
    return database


def attribute(message: Message, name: str) -> int:
    """An attribute of the DBC."""
    assert message.dbc is not None
    found = message.dbc.attributes.get(name)
    return int(found.value) if found is not None else 0


def test_the_table_of_messages_is_the_one_of_the_dbc(dbc: Database) -> None:
    described = {}
    for first, last, name, sender, cycle, text in ROW.findall(PAGE):
        for frame_id in range(int(first, 16), int(last or first, 16) + 1):
            described[frame_id] = (name, SENDER[sender], int(cycle), "**protected**" in text)
    assert described.keys() == {m.frame_id for m in dbc.messages}
    for m in dbc.messages:
        name, sender, cycle, protected = described[m.frame_id]
        assert m.name.startswith(name)
        assert (m.senders, m.cycle_time) == ([sender], cycle)
        assert protected == (attribute(m, "E2EDataId") != 0)


def test_data_ids_and_time_outs_are_those_of_the_dbc(dbc: Database) -> None:
    listed = re.search(r"data id  (.*?); not sent", PAGE, re.S)
    assert listed is not None
    ids = [int(number, 16) for number in re.findall(r"0x(\w+)", listed[1])]
    assert ids == [data_id for m in dbc.messages if (data_id := attribute(m, "E2EDataId"))]
    time_outs = {m.name: attribute(m, "TimeOut") for m in dbc.messages}
    assert f"torque begins to fall | {time_outs['VCU_TorqueRequest']} ms after" in PAGE
    assert f"battery limits lost after they had been received | {time_outs['VCU_BatteryLimits']} ms" in PAGE


def test_the_load_of_the_bus_is_the_one_stated(dbc: Database) -> None:
    """A frame with n data bytes and the most stuff bits that it can need has 55 + 10 n bits. VCU_Commission is sent
    during a commissioning only."""
    bits_per_s = {m.name: (55 + 10 * m.length) * 1000 / m.cycle_time for m in dbc.messages if m.cycle_time}
    whole = sum(bits_per_s.values()) / 500e3
    assert 0.21 < whole < 0.22
    assert 0.18 < whole - bits_per_s["VCU_Commission"] / 500e3 < 0.19
    assert "a bus of 500 kbit/s by at most 19 %" in " ".join(PAGE.split())
