# SPDX-License-Identifier: Apache-2.0
"""The version of the tools, which is the version of the firmware they belong to."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from fluxtrue_tools.errors import FluxtrueError

HEADER: Final = Path(__file__).resolve().parents[2] / "firmware" / "types" / "version.h"
DISTRIBUTION: Final = "fluxtrue-tools"
NAMES: Final = ("MAJOR", "MINOR", "PATCH")


def read(header: Path) -> str:
    """major.minor.patch, as the C header defines them."""
    text = header.read_text(encoding="utf-8")
    numbers = []
    for name in NAMES:
        found = re.search(rf"^#define FLUXTRUE_VERSION_{name} (\d+)$", text, re.MULTILINE)
        if found is None:
            raise FluxtrueError(f"{header}: no line '#define FLUXTRUE_VERSION_{name} <number>'")
        numbers.append(found.group(1))
    return ".".join(numbers)


def in_checkout() -> bool:
    """False if the tools were installed from a wheel, without the firmware beside them."""
    return HEADER.is_file()


def version() -> str:
    """From the checkout the tools run in; outside of one, from the installed package."""
    if in_checkout():
        return read(HEADER)
    import importlib.metadata  # a slow import that only this function needs

    return importlib.metadata.version(DISTRIBUTION)
