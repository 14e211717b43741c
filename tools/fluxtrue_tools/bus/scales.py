# SPDX-License-Identifier: Apache-2.0
"""The scale of the bus's signals for one motor: its factors, its DBC, the hash that names both.

A signal's unit names its quantity, and a quantity has one factor: physical value = raw value * factor. The range of a
signal is fixed in raw values, so that ranges scale with the factors. firmware/comm/fluxtrue.dbc has the standard
factors; the DBC of a motor is the same text with the motor's.

Source   docs/decisions/018-bus-scales.md
"""

import math
import re
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from functools import cache, lru_cache
from types import MappingProxyType
from typing import Final

from fluxtrue_tools.bus import DBC
from fluxtrue_tools.errors import FluxtrueError

QUANTITIES: Final = {
    "Nm": "torque_Nm", "rpm": "speed_rpm", "mOhm": "resistance_mohm", "mVs": "flux_mVs", "A": "current_A",
    "V": "voltage_V", "kW": "power_kW",
}  # fmt: skip
"""The quantity of each unit, as the members of bus_scales_t in their order."""

RESOLUTION: Final = Decimal("0.001")  # of the rated value
RESERVE: Final = Decimal("1.2")  # of the largest value
HASH: Final = "InterfaceHash"
MATCHES: Final = "this_file"
KEPT: Final = 64
"""Texts of which the results are kept: the search for values that fit tries thousands, nearly all with one DBC."""

_BUS = re.compile(r"^BO_ (\d+) (\w+):", re.MULTILINE)
_SIGNAL = re.compile(
    r"^( SG_ (\w+) : (\d+)\|(\d+)@([01])([+-]) )\(([^,]+),([^)]+)\) \[([^|]+)\|([^\]]+)\] "
    r"(\"([^\"]*)\".*)$",
    re.MULTILINE,
)
_VERSION = re.compile(r'^VERSION "(\w*)"$', re.MULTILINE)
_MATCHING = re.compile(rf'^VAL_ \d+ {HASH} (\d+) "{MATCHES}" ;$', re.MULTILINE)

Factors = dict[str, Decimal]


@dataclass(frozen=True)
class Need:
    """Requirements of one quantity of a motor on its signals."""

    rated: float
    largest: float


@dataclass(frozen=True)
class Carrier:
    """The standard factor of a quantity, and the largest raw value that all its signals have."""

    factor: Decimal
    counts: int


def _plain(value: Decimal) -> str:
    return f"{value.normalize():f}"


@cache
def standard() -> str:
    """The text of the DBC with the standard factors."""
    return DBC.read_text(encoding="utf-8")


@lru_cache(maxsize=KEPT)
def carriers(text: str) -> Mapping[str, Carrier]:
    """Each quantity as the DBC carries it; a quantity with two factors is an error."""
    found: dict[str, Carrier] = {}
    for match in _SIGNAL.finditer(text):
        name = QUANTITIES.get(match[12])
        if name is None:
            continue
        factor = Decimal(match[7])
        counts = int(Decimal(match[10]) / factor)
        before = found.get(name, Carrier(factor, counts))
        if before.factor != factor or Decimal(match[8]) != 0:
            raise FluxtrueError(f"{DBC.name}: {match[2]}: signals in {match[12]} must have one factor and no offset")
        found[name] = Carrier(factor, min(before.counts, counts))
    return MappingProxyType(found)


@cache
def series(around: Decimal) -> tuple[Decimal, ...]:
    """1, 2 and 5 times powers of ten, the nearest to `around` first; equally near ones with the finer first."""
    decade = around.adjusted()
    steps = [Decimal(digit).scaleb(decade + n) for n in range(-9, 10) for digit in (1, 2, 5)]
    return tuple(sorted(steps, key=lambda step: (abs(math.log10(step / around)), step)))


def factor_for(carrier: Carrier, need: Need) -> Decimal:
    """The standard factor if it is fine enough and reaches far enough, else the nearest of the series that does.

    Range comes before resolution: where none is both, the finest that reaches far enough.
    """
    rated, largest = Decimal(repr(need.rated)), Decimal(repr(need.largest))
    reaching = [f for f in (carrier.factor, *series(carrier.factor)) if f * carrier.counts >= RESERVE * largest]
    return next((factor for factor in reaching if factor <= RESOLUTION * rated), min(reaching))


def factors_for(needs: dict[str, Need]) -> Factors:
    """The factors of one motor."""
    carried = carriers(standard())
    if carried.keys() != needs.keys():
        raise FluxtrueError(f"{DBC.name}: carries {', '.join(carried)}, the motor gives {', '.join(needs)}")
    return {name: factor_for(carried[name], needs[name]) for name in QUANTITIES.values()}


def standard_factors() -> Factors:
    """The factors of the standard DBC."""
    carried = carriers(standard())
    return {name: carried[name].factor for name in QUANTITIES.values()}


def with_factors(text: str, factors: Factors) -> str:
    """The DBC with these factors, its ranges in raw values unchanged."""

    def scaled(match: re.Match[str]) -> str:
        name = QUANTITIES.get(match[12])
        if name is None:
            return match[0]
        low, high = (Decimal(match[n]) / Decimal(match[7]) * factors[name] for n in (9, 10))
        return f"{match[1]}({_plain(factors[name])},{match[8]}) [{_plain(low)}|{_plain(high)}] {match[11]}"

    return _SIGNAL.sub(scaled, text)


def in_raw_values(text: str) -> str:
    """The DBC without a factor in any scaled signal: what the firmware's code is generated from."""
    return with_factors(text, {name: Decimal(1) for name in QUANTITIES.values()})


def declared(text: str) -> list[str]:
    """Each signal with its place and its scale."""
    lines: list[str] = []
    for part in re.split(r"^(?=BO_ )", text, flags=re.MULTILINE)[1:]:
        message = _BUS.match(part)
        assert message is not None
        for signal in _SIGNAL.finditer(part):
            sign = "signed" if signal[6] == "-" else "unsigned"
            order = "little_endian" if signal[5] == "1" else "big_endian"
            lines.append(f"0x{int(message[1]):03X} {message[2]}.{signal[2]} {signal[3]}|{signal[4]} {sign} {order} "
                         f"x {float(signal[7]):g} + {float(signal[8]):g} {signal[12] or '-'}")  # fmt: skip
    return sorted(lines)


@lru_cache(maxsize=KEPT)
def interface_hash(text: str) -> int:
    """CRC-32 over version and signals: it changes with a name, a place, a factor or a unit, not with a comment."""
    version = _VERSION.search(text)
    if version is None:
        raise FluxtrueError(f"{DBC.name}: no VERSION")
    return zlib.crc32("\n".join([f"version {version[1]}", *declared(text)]).encode())


def with_hash(text: str) -> str:
    """The DBC whose value table of InterfaceHash names its own hash, so that any tool shows whether it matches."""
    line = _MATCHING.search(text)
    if line is None:
        raise FluxtrueError(f'{DBC.name}: no line VAL_ ... {HASH} ... "{MATCHES}" ;')
    return text[: line.start(1)] + str(interface_hash(text)) + text[line.end(1) :]


@lru_cache(maxsize=KEPT)
def _dbc_of(factors: tuple[tuple[str, Decimal], ...]) -> str:
    return with_hash(with_factors(standard(), dict(factors)))


def dbc_of(factors: Factors) -> str:
    """The DBC of a motor with these factors."""
    return _dbc_of(tuple(factors.items()))
