# SPDX-License-Identifier: Apache-2.0
"""The work folder of a commissioning: the finished steps, so that a run that was interrupted can go on.

A step is kept when it has ended well, in one file that is replaced as a whole. The map is not: it is the last step, and
without it nothing is left to be done. The file has a checksum, because a number that was changed in it would become a
current or an angle of the machine on the bench, and could not be distinguished from a measured one.
"""

import json
from dataclasses import fields, is_dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

import numpy as np

from fluxtrue_tools.commission.bursts import Raw
from fluxtrue_tools.commission.connection import Followed
from fluxtrue_tools.commission.dc_zero import DcZero
from fluxtrue_tools.commission.drag import Drag
from fluxtrue_tools.commission.harmonics import Harmonics
from fluxtrue_tools.commission.levels import Resistance
from fluxtrue_tools.commission.plan import First
from fluxtrue_tools.commission.spin import Spun
from fluxtrue_tools.commission.steps import Found
from fluxtrue_tools.commission.turning import Connection
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.outputs import atomic

NAME: Final = "steps.json"
TYPES: Final = {kind.__name__: kind
               for kind in (DcZero, Connection, Followed, Harmonics, Spun, Drag, Resistance, First, Raw)}  # fmt: skip
# Of Found.
KEPT: Final = ("offset_A", "offset_sigma_A", "dc_zero", "followed", "spun", "drag", "resistance", "first",
               "levels")  # fmt: skip
LAST: Final = "map"


def _encoded(value: Any) -> Any:
    if is_dataclass(value):
        return {"type": type(value).__name__, **{f.name: _encoded(getattr(value, f.name)) for f in fields(value)}}
    if isinstance(value, list | tuple):
        return [_encoded(part) for part in value]
    if isinstance(value, np.ndarray):
        parts = [value.real.tolist(), value.imag.tolist()] if np.iscomplexobj(value) else [value.tolist()]
        return {"array": parts}
    if isinstance(value, complex):
        return {"complex": [value.real, value.imag]}
    return value.item() if isinstance(value, np.generic) else value


def _decoded(value: Any) -> Any:
    if isinstance(value, list):
        return [_decoded(part) for part in value]
    if not isinstance(value, dict):
        return value
    if "complex" in value:
        return complex(*value["complex"])
    if "array" in value:
        real, *imaginary = (np.array(part, float) for part in value["array"])
        return real + 1j * imaginary[0] if imaginary else real
    return TYPES[value["type"]](**{name: _decoded(part) for name, part in value.items() if name != "type"})


def _checksum(content: dict[str, Any]) -> str:
    """Of everything else in the file."""
    return sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


class Work:
    """Finished steps in a folder.

    belongs   what the steps were measured on, by its name in messages; steps of something else are refused
    """

    def __init__(self, folder: Path, belongs: dict[str, str]) -> None:
        self._folder, self._path, self._belongs = folder, folder / NAME, belongs

    def save(self, steps: tuple[str, ...], found: Found) -> None:
        """Keep what has been found by these steps, completely or not at all."""
        if LAST in steps:
            return
        kept = {name: _encoded(getattr(found, name)) for name in KEPT}
        content = {"belongs": self._belongs, "steps": steps, "found": kept}
        text = json.dumps({"checksum": _checksum(content), **content}, indent=1)
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FluxtrueError(f"--work {self._folder}: cannot be made ({error.strerror})") from error
        with atomic(self._path) as scratch:
            scratch.write_text(text + "\n", encoding="utf-8")

    def load(self) -> tuple[tuple[str, ...], Found]:
        """The finished steps and what they have found."""
        try:
            data = json.loads(self._path.read_text(encoding="utf-8"))
            if data.pop("checksum") != _checksum(data):
                raise ValueError("it was changed after it had been written")
            belongs, steps = dict(data["belongs"]), tuple(map(str, data["steps"]))
            found = Found(**{name: _decoded(data["found"][name]) for name in KEPT})
        except FileNotFoundError as error:
            raise FluxtrueError(f"{self._path}: missing, so no step has ended there, allowed: the --work of an earlier "
                                "run, or no --resume to begin with the first step") from error  # fmt: skip
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            said = " ".join(str(error).split())
            raise FluxtrueError(f"{self._path}: not the steps of a commissioning ({said}), allowed: the file as "
                                "commission has written it, or no --resume to begin again") from error  # fmt: skip
        other = [name for name, value in self._belongs.items() if belongs.get(name) != value]
        if other:
            raise FluxtrueError(f"{self._path}: measured with another {' and another '.join(other)}, allowed: the "
                                "same, another --work, or no --resume to begin again")  # fmt: skip
        return steps, found
