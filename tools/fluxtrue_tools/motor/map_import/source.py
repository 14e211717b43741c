# SPDX-License-Identifier: Apache-2.0
"""What a file gives: quantities by name, values for motor.toml, and what its format fixes."""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array

PLACES = (("i_d", "i_q"), ("i_s", "gamma"))
FLUXES = ("psi_d", "psi_q")
QUANTITIES = ("i_d", "i_q", "i_s", "gamma", "psi_d", "psi_q", "torque")
LOSS_QUANTITIES = ("i_d", "i_q", "i_s", "gamma", "speed", "frequency", "loss")

# Names that are understood without --column, in small letters without signs and spaces. Id_Peak, Flux_Linkage_D,
# Phase_Advance, Electromagnetic_Torque and their neighbours are those of Motor-CAD's saturation maps, as its Python
# examples read them (pymotorcad, Id_Peak and so on of the exported .mat).
ALIASES = {
    "i_d": ("id", "ida", "idmap", "idpeak", "currentd", "daxiscurrent"),
    "i_q": ("iq", "iqa", "iqmap", "iqpeak", "currentq", "qaxiscurrent"),
    "i_s": (
        "is",
        "isa",
        "ipeak",
        "ipeaka",
        "irms",
        "irmsa",
        "current",
        "currenta",
        "statorcurrent",
        "statorcurrentphasepeak",
    ),
    "gamma": ("gamma", "gammadeg", "beta", "betadeg", "phaseadvance", "phaseadvancedeg", "currentangle"),
    "psi_d": ("psid", "psidvs", "psidwb", "psidmap", "fd", "fluxd", "fluxlinkaged", "lambdad", "phid"),
    "psi_q": ("psiq", "psiqvs", "psiqwb", "psiqmap", "fq", "fluxq", "fluxlinkageq", "lambdaq", "phiq"),
    "torque": ("torque", "torquenm", "t", "tnm", "mnm", "tem", "taum", "electromagnetictorque", "drehmoment"),
    "speed": ("speed", "speedrpm", "n", "nrpm", "rpm"),
    "frequency": ("frequency", "frequencyhz", "f", "fhz", "hz"),
    "loss": ("loss", "lossw", "ironloss", "ironlossw", "pfe", "pfew", "coreloss"),
}

# A name with its unit: Psi_d [mVs], Psi_d (mVs), Psi_d / mVs, Psi_d in mVs.
WITH_UNIT = re.compile(r"(.*?)\s*(?:\[([^]]*)\]|\(([^)]*)\)|/\s*(\S+)|\sin\s(\S+))")
# Units that a header may have, and what the unit says about the source (the options of the command line).
FLUX_UNITS = {"vs": {"flux_unit": "Vs"}, "wb": {"flux_unit": "Vs"}, "mvs": {"flux_unit": "mVs"},
              "mwb": {"flux_unit": "mVs"}}  # fmt: skip
UNITS: dict[str, dict[str, dict[str, str]]] = {
    "i_d": {"a": {}}, "i_q": {"a": {}}, "i_s": {"a": {}},
    "gamma": {"deg": {"angle_unit": "deg"}, "°": {"angle_unit": "deg"}, "rad": {"angle_unit": "rad"}},
    "psi_d": FLUX_UNITS, "psi_q": FLUX_UNITS,
    "torque": {"nm": {}}, "speed": {"rpm": {}, "1/min": {}}, "frequency": {"hz": {}}, "loss": {"w": {}},
}  # fmt: skip


@dataclass(frozen=True)
class Losses:
    """Iron losses at currents as the file has them."""

    i_d: Array
    i_q: Array
    omega_rad_s: Array  # electrical
    loss_W: Array


@dataclass(frozen=True)
class Raw:
    """One file as it is."""

    path: Path
    quantities: dict[str, Array]
    fixed: dict[str, str] = field(default_factory=dict)  # options that the format answers itself
    facts: dict[str, Any] = field(default_factory=dict)  # "machine.pole_pairs" and so on
    notes: list[str] = field(default_factory=list)
    losses: Losses | None = None
    stated: dict[str, str] = field(default_factory=dict)  # options that the file's own units answer


def plain(name: str) -> str:
    """A name without capitals, signs and spaces."""
    return "".join(character for character in name.lower() if character.isalnum())


def _parts(quantity: str, header: str) -> tuple[str, dict[str, str] | None]:
    """The name in a header, and what its unit says; None without a unit of this quantity."""
    found = WITH_UNIT.fullmatch(header.strip())
    if found is None:
        return header, None
    unit = next(part for part in found.groups()[1:] if part is not None).lower()
    return found[1], UNITS[quantity].get(re.sub("[ ·*]", "", unit))


def known_as(quantity: str, name: str) -> bool:
    """Whether a name, without or with a unit, is one of the usual ones of a quantity."""
    bare, said = _parts(quantity, name)
    return plain(name) in ALIASES[quantity] or (said is not None and plain(bare) in ALIASES[quantity])


def stated(path: Path, headers: dict[str, str]) -> dict[str, str]:
    """What the units of these columns, by their quantities, say about the source."""
    found: dict[str, str] = {}
    for quantity, header in headers.items():
        for option, value in (_parts(quantity, header)[1] or {}).items():
            if found.setdefault(option, value) != value:
                raise FluxtrueError(f"{path}: columns in {found[option]} and in {value} ({header!r}), allowed: one "
                                    "unit for both")  # fmt: skip
    return found


def mapping(given: tuple[str, ...], option: str, quantities: tuple[str, ...]) -> dict[str, str]:
    """NAME=HEADER of a command line."""
    found: dict[str, str] = {}
    for text in given:
        name, sign, header = text.partition("=")
        if not sign or name not in quantities or not header.strip():
            raise FluxtrueError(f"{option} {text[:60]!r}: allowed: NAME=HEADER, NAME one of {', '.join(quantities)}")
        if name in found:
            raise FluxtrueError(f"{option} {text[:60]!r}: {name} given twice, allowed: once")
        found[name] = header.strip()
    return found


def place_of(present: set[str], chosen: dict[str, str], path: Path, option: str) -> tuple[str, str]:
    """Which two quantities say where a point is: the pair that is named, else the first that is there."""
    given = [pair for pair in PLACES if present.issuperset(pair)]
    named = [pair for pair in given if {*pair} <= {*chosen}]
    if len(named) > 1:
        raise FluxtrueError(f"{option}: i_d, i_q and i_s, gamma are both named, allowed: one pair")
    if given:
        return (named or given)[0]
    raise FluxtrueError(f"{path}: no currents found, wanted: i_d and i_q, or i_s and gamma; name them with {option}")
