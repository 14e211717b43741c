# SPDX-License-Identifier: Apache-2.0
"""Types in the debug information (DWARF) of a library or an image."""

import math

from elftools.dwarf.die import DIE


def name(die: DIE) -> str:
    """'' for an unnamed struct or union."""
    found = die.attributes.get("DW_AT_name")
    return found.value.decode() if found else ""


def bare(die: DIE) -> DIE:
    """The type without typedef, const and volatile."""
    while die.tag in ("DW_TAG_typedef", "DW_TAG_const_type", "DW_TAG_volatile_type"):
        die = die.get_DIE_from_attribute("DW_AT_type")
    return die


def _length(subrange: DIE) -> int:
    """gcc gives the last index, clang the number."""
    given = subrange.attributes
    return int(given["DW_AT_count"].value) if "DW_AT_count" in given else int(given["DW_AT_upper_bound"].value) + 1


def elements(array: DIE) -> int:
    """Number of elements of an array of any dimensions."""
    return math.prod(_length(child) for child in array.iter_children() if child.tag == "DW_TAG_subrange_type")


def size(die: DIE) -> int:
    """Bytes of a type."""
    die = bare(die)
    if die.tag == "DW_TAG_array_type":
        return elements(die) * size(die.get_DIE_from_attribute("DW_AT_type"))
    return int(die.attributes["DW_AT_byte_size"].value)
