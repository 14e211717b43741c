# SPDX-License-Identifier: Apache-2.0
"""docs/howto/can.md, the DBC and the firmware's fault words say the same."""

import re

import pytest
from cantools.database import load_file
from cantools.database.can import Database, Message

from fluxtrue_tools.bus import DBC

ROOT = DBC.parents[2]
PAGE = (ROOT / "docs/howto/can.md").read_text(encoding="utf-8")
ARCHITECTURE = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| 0x(\w+)(?:–0x(\w+))? \| `(\w+)…?` \| (vehicle|inverter) \| (\d+) \| (.*) \|$", re.M)
SENDER = {"vehicle": "VCU", "inverter": "INV"}
FIRST_ECU_FAULT = 33


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
    """55 + 10 n bits: a frame with the most stuff bits it can need."""
    bits_per_s = sum((55 + 10 * m.length) * 1000 / m.cycle_time for m in dbc.messages if m.cycle_time)
    assert 0.15 < bits_per_s / 500e3 < 0.16
    assert "a bus of 500 kbit/s by at most 16 %" in " ".join(PAGE.split())


def names_in(dbc: Database, signal: str) -> dict[int, str]:
    """Bits and names in the comment of a fault word."""
    comment = dbc.get_message_by_name("INV_Faults").get_signal_by_name(signal).comment
    assert isinstance(comment, str)
    return {int(bit): name for bit, name in re.findall(r"(\d+) (\w+)", comment)}


def test_the_comments_of_the_dbc_name_every_bit_of_the_fault_words(dbc: Database) -> None:
    choices = dbc.get_message_by_name("INV_Faults").get_signal_by_name("FirstFault").choices
    assert choices is not None
    drive = {n - 1: str(name) for n, name in choices.items() if 0 < n < FIRST_ECU_FAULT}
    ecu = {n - FIRST_ECU_FAULT: str(name) for n, name in choices.items() if n >= FIRST_ECU_FAULT}
    assert names_in(dbc, "DriveFaults") == drive
    assert names_in(dbc, "EcuFaults") == ecu


@pytest.mark.parametrize(
    ("header", "prefix", "signal"),
    [("types/faults.h", "FAULT", "DriveFaults"), ("ecu/supervisor.h", "ECU_FAULT", "EcuFaults")],
)
def test_the_firmware_has_the_bits_that_the_dbc_names(dbc: Database, header: str, prefix: str, signal: str) -> None:
    text = (ROOT / "firmware" / header).read_text(encoding="utf-8")
    enum = {int(bit): name.lower() for name, bit in re.findall(rf"\b{prefix}_(\w+) = 1[uU] << (\d+)", text)}
    assert {bit: name.removeprefix("ecu_") for bit, name in names_in(dbc, signal).items()} == enum


def test_the_pages_list_every_bit_of_the_fault_words(dbc: Database) -> None:
    ecu = PAGE[PAGE.index("| bit of `EcuFaults` |") :]
    assert [int(b) for b in re.findall(r"^\| (\d+) \|", ecu, re.M)] == list(names_in(dbc, "EcuFaults"))
    drive = ARCHITECTURE[ARCHITECTURE.index("| bit | name | detection |") :]
    assert [int(b) for b in re.findall(r"^\| (\d+) \|", drive, re.M)] == list(names_in(dbc, "DriveFaults"))
