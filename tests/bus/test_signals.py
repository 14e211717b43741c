# SPDX-License-Identifier: Apache-2.0
"""The firmware's encoding of every signal equals that of cantools over the whole range."""

import ctypes
import math
from decimal import Decimal

import cantools
import numpy as np
import pytest
from cantools.database.can import Message
from cantools.database.can.c_source import camel_to_snake_case
from cantools.database.can.signal import Signal
from ecu import BUILD, load_dbc

from fluxtrue_tools.bus.scales import dbc_of, standard_factors

DBC = load_dbc()
SCALES = (ctypes.c_float * 7)(*map(float, standard_factors().values()))  # bus_scales_t
LIB = ctypes.CDLL(str(BUILD / "libfluxtrue_bus_exports.so"))
SENT = [message for message in DBC.messages if "INV" in message.senders]
RECEIVED = [message for message in DBC.messages if "INV" in message.receivers]
STEPS = 4001


def signals(messages: list[Message]) -> list[tuple[Message, int]]:
    """Each signal as (message, index in the message)."""
    return [(message, index) for message in messages for index in range(len(message.signals))]


def physical(messages: list[Message]) -> list[tuple[Message, int]]:
    """The signals that are not plain integers: the firmware converts them in floating point."""
    return [(m, k) for m, k in signals(messages) if m.signals[k].scale != 1 or m.signals[k].unit]


def names(case: tuple[Message, int]) -> str:
    """The name of a case in the test's report."""
    return f"{case[0].name}.{case[0].signals[case[1]].name}"


def c_encode(message: Message, values: list[float], scales: ctypes.Array = SCALES) -> tuple[int, bytes]:
    """The frame that the firmware encodes, and the number of values that it used."""
    data = (ctypes.c_uint8 * 8)()
    function = getattr(LIB, f"test_{camel_to_snake_case(message.name)}")
    taken = function((ctypes.c_double * len(values))(*values), data, scales)
    return int(taken), bytes(data)


def c_decode(message: Message, data: bytes, scales: ctypes.Array = SCALES) -> tuple[bool, list[float]]:
    """Whether the firmware finds the values of a frame in range, and the values."""
    values = (ctypes.c_double * len(message.signals))()
    function = getattr(LIB, f"test_{camel_to_snake_case(message.name)}")
    in_range = function(values, (ctypes.c_uint8 * 8)(*data), scales)
    return bool(in_range), list(values)


def smallest(message: Message) -> list[float]:
    """Every signal at zero, or at its smallest value if zero is out of range."""
    return [max(0.0, float(signal.minimum)) for signal in message.signals]


def raw_range(signal: Signal) -> np.ndarray:
    """Raw values over the DBC's range: all of them, or some thousands with both ends."""
    low = round((signal.minimum - signal.offset) / signal.scale)
    high = round((signal.maximum - signal.offset) / signal.scale)
    if high - low < STEPS:
        return np.arange(low, high + 1)
    return np.unique(np.linspace(low, high, STEPS).round().astype(np.int64))


def raw_of(message: Message, index: int, data: bytes) -> int:
    """The unscaled value that cantools decodes."""
    decoded = message.decode(data, decode_choices=False, scaling=False)
    return int(decoded[message.signals[index].name])


@pytest.mark.parametrize("case", signals(SENT), ids=names)
def test_every_count_of_a_sent_signal_is_encoded_as_cantools_does(case: tuple[Message, int]) -> None:
    message, index = case
    signal = message.signals[index]
    values = smallest(message)
    for raw in raw_range(signal):
        values[index] = float(raw * signal.scale + signal.offset)
        taken, data = c_encode(message, values)
        assert taken == len(message.signals)
        expected = message.encode({s.name: v for s, v in zip(message.signals, values, strict=True)}, strict=False)
        assert data == expected
        assert raw_of(message, index, data) == raw


# A value between two counts is rounded to the nearer one. A float has 24 bits, so that a value within a thousandth of a
# count of the middle may be rounded to either.
@pytest.mark.parametrize("case", physical(SENT), ids=names)
def test_values_between_counts_are_rounded_to_the_nearest(case: tuple[Message, int]) -> None:
    message, index = case
    signal = message.signals[index]
    values = smallest(message)
    rng = np.random.default_rng(1)
    for share in rng.uniform(0.0, 1.0, 2000):
        exact = signal.minimum + share * (signal.maximum - signal.minimum)
        values[index] = float(np.float32(exact))
        wanted = (values[index] - signal.offset) / signal.scale
        _, data = c_encode(message, values)
        # float32 of the value and of the scale: relative 2^-23 each
        slack = 0.5 + 1e-3 + abs(wanted) * 3e-7
        assert abs(raw_of(message, index, data) - wanted) <= slack


@pytest.mark.parametrize("digit", [1, 2, 5])
def test_another_scale_is_encoded_and_decoded_as_its_dbc_says(digit: int) -> None:
    factors = {name: Decimal(digit).scaleb(n - 4) for n, name in enumerate(standard_factors())}
    messages = cantools.database.load_string(dbc_of(factors), "dbc").messages
    scales = (ctypes.c_float * len(factors))(*map(float, factors.values()))
    rng = np.random.default_rng(digit)
    for message in (m for m in messages for _ in range(50)):
        values = [float(rng.uniform(s.minimum, s.maximum) if s.unit else s.minimum) for s in message.signals]
        named = {s.name: v for s, v in zip(message.signals, values, strict=True)}
        if "INV" in message.senders:
            told = message.decode(c_encode(message, values, scales)[1], decode_choices=False)
        else:
            told = dict(zip(named, c_decode(message, message.encode(named), scales)[1], strict=True))
        for signal in message.signals:
            slack = 0.501 * signal.scale + 3e-7 * abs(named[signal.name])  # half a count, and a float's resolution
            assert abs(told[signal.name] - named[signal.name]) <= slack, signal.name


@pytest.mark.parametrize("case", signals(SENT), ids=names)
def test_values_beyond_the_range_become_its_ends(case: tuple[Message, int]) -> None:
    message, index = case
    signal = message.signals[index]
    is_count = signal.scale == 1 and not signal.unit
    ends = raw_range(signal)
    values = smallest(message)
    beyond = [2.0 * abs(signal.maximum) + 10.0, 99999.0] + ([] if is_count else [1e30])
    for value in (x for x in beyond if signal.maximum < x and not (is_count and x >= 2**32)):
        values[index] = value
        assert raw_of(message, index, c_encode(message, values)[1]) == ends[-1]
    if not is_count:
        for value in (signal.minimum - 1.0, -1e30):
            values[index] = value
            assert raw_of(message, index, c_encode(message, values)[1]) == ends[0]


@pytest.mark.parametrize("case", physical(SENT), ids=names)
def test_a_value_that_is_no_number_is_refused(case: tuple[Message, int]) -> None:
    message, index = case
    for value in (math.nan, math.inf, -math.inf):
        values = smallest(message)
        values[index] = value
        assert c_encode(message, values)[0] == len(message.signals) - 1


@pytest.mark.parametrize("case", signals(RECEIVED), ids=names)
def test_every_count_of_a_received_signal_is_decoded_as_cantools_does(case: tuple[Message, int]) -> None:
    message, index = case
    signal = message.signals[index]
    low, high = -(1 << signal.length - 1) if signal.is_signed else 0, (1 << signal.length - signal.is_signed) - 1
    raws = np.unique(np.linspace(low, high, min(STEPS, high - low + 1)).round().astype(np.int64))
    zero = {s.name: 0 for s in message.signals}
    for raw in np.union1d(raws, raw_range(signal)[[0, -1]]):
        data = message.encode({**zero, signal.name: int(raw)}, scaling=False, strict=False)
        in_range, values = c_decode(message, data)
        exact = float(raw) * signal.scale + signal.offset
        assert values[index] == pytest.approx(exact, rel=2e-7, abs=1e-9)
        assert in_range == (signal.minimum - 1e-9 <= exact <= signal.maximum + 1e-9)


def test_no_signals_overlap_and_every_message_says_how_often_it_comes() -> None:
    for message in DBC.messages:
        assert message.cycle_time in (10, 100, 1000)
        assert message.length == 8
        assert message.comment
        for signal in message.signals:
            assert signal.comment, signal.name
            assert signal.minimum is not None and signal.maximum is not None
            assert signal.byte_order == "little_endian"


def test_whatever_can_move_the_car_is_protected() -> None:
    for message in RECEIVED:
        assert message.dbc.attributes["E2EDataId"].value > 0
        assert [s.name for s in message.signals[:2]] == ["Crc", "Counter"]
        assert (message.signals[0].start, message.signals[0].length) == (0, 8)
        assert (message.signals[1].start, message.signals[1].length, message.signals[1].maximum) == (8, 4, 14)


# A frame of eight bytes has 108 bits, at most 24 stuff bits and 3 bits of silence behind it.
@pytest.mark.parametrize(("without", "share"), [("VCU_Commission", 0.19), ("", 0.22)])
def test_all_messages_together_load_a_bus_of_500_kbit_by_at_most_19_percent(without: str, share: float) -> None:
    """With the message that is sent during a commissioning alone by 22 %."""
    bits_per_s = sum(135 * 1000 / message.cycle_time for message in DBC.messages if message.name != without)
    assert bits_per_s <= share * 500e3
