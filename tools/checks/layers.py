# SPDX-License-Identifier: Apache-2.0
"""Holds every #include to the layer table of docs/architecture.md."""

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tree import Violation, files, lines, run

FREESTANDING = frozenset({"stdint.h", "stdbool.h", "stddef.h", "limits.h"})
HOSTED = FREESTANDING | {
    "assert.h", "errno.h", "float.h", "inttypes.h", "math.h", "stdarg.h", "stdio.h",
    "stdlib.h", "string.h", "time.h",
}  # fmt: skip


@dataclass(frozen=True)
class Layer:
    """What the files of one folder may include, besides the files of the folder itself."""

    folder: str
    may_include: tuple[str, ...]
    system: frozenset[str] = FREESTANDING
    # A folder of stages: another stage only for its value types, and only upstream.
    stages: tuple[str, ...] | None = None


# The direction of the signal. A feedback arrow is a field one sample old, never an include.
PIPELINE = (
    "measure", "angle_harmonics", "angle_tracker", "transform", "flux_table", "mrai", "identify", "torque_estimate",
    "commission", "dead_time_trim",
    "torque_limit", "torque_loop", "voltage_reserve", "i_d_limit", "current_reference", "current_control", "modulate",
)  # fmt: skip

# First match wins: a folder comes before the folder that contains it.
LAYERS = (
    # string.h: memcpy of a few bytes is how C spells a packed load.
    Layer("firmware/fx", (), FREESTANDING | {"arm_acle.h", "string.h"}),
    Layer("firmware/types", ("firmware/fx",)),
    Layer("firmware/signal", ("firmware/fx", "firmware/types")),
    Layer("firmware/control", ("firmware/fx", "firmware/types", "firmware/signal"),
          stages=PIPELINE),
    Layer("firmware/safety", ("firmware/fx", "firmware/types", "firmware/signal"), stages=()),
    Layer("firmware/comm", ("firmware/fx", "firmware/types", "firmware/signal"),
          FREESTANDING | {"string.h"}),
    Layer("firmware/app", ("firmware/fx", "firmware/types", "firmware/signal",
                           "firmware/control", "firmware/safety", "firmware/comm", "hal"),
          FREESTANDING | {"string.h"}),
    Layer("hal/host", ("firmware/fx", "firmware/types", "firmware/app", "hal"), HOSTED),
    Layer("hal/*", ("firmware/fx", "firmware/types", "firmware/signal", "firmware/app", "hal")),
    Layer("hal", ("firmware/fx", "firmware/types")),
    Layer("tests/plant", (), HOSTED),
    Layer("tests/support/twin", (), HOSTED),
)  # fmt: skip

# Written by the build from firmware/comm/fluxtrue.dbc.
GENERATED = {"bus/bus.h": ("firmware/comm",), "bus/signals.h": ("firmware/comm",)}

# Changes of frame are inline arithmetic on value types, not a stage with a state.
VALUE_HEADERS = {"transform"}

INCLUDE = re.compile(r'\s*#\s*include\s*(?:<([^>]+)>|"([^"]+)")')
# Where "..." is looked up after the folder of the file itself.
ROOTS = ("firmware", "", "tests", "tests/support")


def layer_of(path: Path) -> Layer | None:
    """The first layer whose folder holds the file, at any depth."""
    for layer in LAYERS:
        depth = layer.folder.count("/") + 1
        folder = Path(*path.parts[:depth])
        if len(path.parts) > depth and folder.match(layer.folder):
            return layer
    return None


def same_stage(one: str, other: str) -> bool:
    """mrai and mrai_schedule are one stage; so are flux_table and flux_table_types."""
    return one == other or one.startswith(other + "_") or other.startswith(one + "_")


def stage_rank(stem: str, stages: tuple[str, ...]) -> int | None:
    """Place in the pipeline of the stage a file belongs to."""
    for rank, stage in enumerate(stages):
        if stem == stage or stem.startswith(stage + "_"):
            return rank
    return None


def stage_problem(layer: Layer, path: Path, target: Path) -> str | None:
    """Why a file of one stage may not include a header of the same layer."""
    stages = layer.stages or ()
    own, other = stage_rank(path.stem, stages), stage_rank(target.stem, stages)
    if stages and own is None:
        return f"stage '{path.stem}' has no place in PIPELINE of tools/checks/layers.py"
    if same_stage(path.stem, target.stem) or (own is not None and own == other):
        return None
    if not target.stem.endswith("_types") and target.stem not in VALUE_HEADERS:
        return f"another stage may be included for its value types only (*_types.h): {target}"
    if own is not None and other is not None and other > own:
        return f"include against the signal's direction: {target} is downstream"
    return None


def resolve(root: Path, path: Path, name: str) -> Path | None:
    """The project's file an #include "name" means."""
    for folder in (path.parent, *map(Path, ROOTS)):
        if (root / folder / name).is_file():
            target = (root / folder / name).resolve()
            return target.relative_to(root.resolve())
    return None


def project_problem(root: Path, layer: Layer, path: Path, name: str) -> str | None:
    """Why an include of the project's own file is not allowed."""
    if name in GENERATED:
        return None if layer.folder in GENERATED[name] else f"{layer.folder} may not include the generated {name}"
    target = resolve(root, path, name)
    if target is None:
        return f'"{name}" is not a file of the project'
    target_layer = layer_of(target)
    if path.stem.endswith("_isr") and target.parts[:2] == ("firmware", "comm"):
        return f"an interrupt packs nothing for the bus: {target}"
    if target_layer is layer:
        if layer.folder == "hal/*" and target.parts[:2] != path.parts[:2]:
            return f"one port may not include another: {target}"
        return stage_problem(layer, path, target) if layer.stages is not None else None
    if target_layer is None or target_layer.folder not in layer.may_include:
        allowed = ", ".join(layer.may_include) or "nothing outside its folder"
        return f"{layer.folder} may include {allowed}; not {target}"
    return None


def check(root: Path) -> Iterator[Violation]:
    """All includes of all layers."""
    for path in files(root, ".c", ".h"):
        layer = layer_of(path)
        if layer is None:
            continue
        for number, line in enumerate(lines(root, path), start=1):
            match = INCLUDE.match(line)
            if not match:
                continue
            system, name = match.groups()
            if system is None:
                problem = project_problem(root, layer, path, name)
            else:
                problem = None if system in layer.system else f"<{system}> in {layer.folder}"
            if problem:
                yield Violation(path, number, problem)


if __name__ == "__main__":
    sys.exit(run(check, "layer rule"))
