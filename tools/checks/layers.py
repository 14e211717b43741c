# SPDX-License-Identifier: Apache-2.0
"""Every #include follows the layer table of docs/architecture.md."""

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
    # Other folders whose value types (VALUE_HEADERS) the files may know.
    values_of: tuple[str, ...] = ()
    # Each file is a stage of its own: another one may be included for its value types only.
    stages: bool = False
    # Files include only what stands above them in the STRUCTURE table: the direction of the signal.
    ordered: bool = False


BASE = ("firmware/fx", "firmware/types", "firmware/signal")
CURRENT, IDENTIFY = "firmware/control/current", "firmware/control/identify"
TORQUE, COMMISSION = "firmware/control/torque", "firmware/control/commission"
ADAPT, MRAI = "firmware/control/adapt", "firmware/control/mrai"
CONTROL = (CURRENT, IDENTIFY, MRAI, ADAPT, COMMISSION, TORQUE)
DRIVE = (*BASE, *CONTROL, "firmware/safety", "firmware/second_level", "firmware/drive", "hal")
ECU = (*DRIVE, "firmware/scope", "firmware/comm", "firmware/calibration")

# First match wins: a folder comes before the folder that contains it. No folder of the chain that every drive needs
# (current, identify, torque) includes one that can be left out (mrai, adapt, commission).
LAYERS = (
    # string.h: memcpy of a few bytes is the way to write an unaligned load in C.
    Layer("firmware/fx", (), FREESTANDING | {"arm_acle.h", "string.h"}, ordered=True),
    Layer("firmware/types", ("firmware/fx",), ordered=True),
    Layer("firmware/signal", ("firmware/fx", "firmware/types"), ordered=True),
    Layer(CURRENT, BASE, stages=True, ordered=True),
    Layer(IDENTIFY, BASE, values_of=(CURRENT,), ordered=True),
    Layer(MRAI, BASE, values_of=(CURRENT,), ordered=True),
    Layer(ADAPT, BASE, stages=True, ordered=True),
    Layer(COMMISSION, BASE, values_of=(CURRENT,), ordered=True),
    Layer(TORQUE, BASE, values_of=(CURRENT,), stages=True, ordered=True),
    Layer("firmware/safety", BASE, stages=True, ordered=True),
    # Shares nothing with the layers above except the fixed-point library and value types.
    Layer("firmware/second_level", ("firmware/fx", "firmware/types"), ordered=True),
    Layer("firmware/comm", BASE, FREESTANDING | {"string.h"}),
    Layer("firmware/drive", DRIVE, FREESTANDING | {"string.h"}, ordered=True),
    Layer("firmware/scope", DRIVE, ordered=True),
    Layer("firmware/storage", DRIVE, FREESTANDING | {"string.h"}),
    Layer("firmware/calibration", (*DRIVE, "firmware/scope", "firmware/comm"), FREESTANDING | {"string.h"}),
    Layer("firmware/ecu", ECU, FREESTANDING | {"string.h"}),
    Layer("hal/host", (*BASE, *CONTROL, "firmware/drive", "firmware/storage", "firmware/calibration", "firmware/ecu",
                       "hal"), HOSTED),
    Layer("hal/*", (*BASE, "firmware/drive", "firmware/storage", "firmware/ecu", "hal")),
    Layer("hal", ("firmware/fx", "firmware/types")),
    Layer("tests/plant", (), HOSTED),
    Layer("tests/support/twin", (), HOSTED),
)  # fmt: skip

# Written by the build from firmware/comm/fluxtrue.dbc.
GENERATED = {"bus/bus.h": ("firmware/comm",), "bus/signals.h": ("firmware/comm",)}

# Value types, and changes of frame, which are inline arithmetic on them.
VALUE_HEADERS = re.compile(r"(\w+_types|transform)\.h")

STRUCTURE = Path("docs/architecture.md")
STRUCTURE_FOLDER = re.compile(r"\| \*\*`(firmware/[\w/]+)`\*\*")
README_ORDER = re.compile(r"    (\w+(?: → \w+)*)")
STRUCTURE_FILE = re.compile(r"\| `(\w+)` \| ((?:\.[ch] ?)+)\|")

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


def structure(root: Path) -> dict[Path, int]:
    """The files of the STRUCTURE table, each with its line."""
    found: dict[Path, int] = {}
    folder = Path()
    for number, line in enumerate(lines(root, STRUCTURE), start=1):
        if match := STRUCTURE_FOLDER.match(line):
            folder = Path(match.group(1))
        elif match := STRUCTURE_FILE.match(line):
            for suffix in match.group(2).split():
                found[folder / f"{match.group(1)}{suffix}"] = number
    return found


def structure_problems(root: Path, table: dict[Path, int]) -> Iterator[Violation]:
    """Files of firmware/ that the table lacks, and names in it without a file."""
    tree = {path for path in files(root, ".c", ".h") if path.is_relative_to("firmware")}
    for path in sorted(tree - table.keys()):
        yield Violation(path, 1, f"has no line in the STRUCTURE table of {STRUCTURE}")
    for path in sorted(table.keys() - tree):
        yield Violation(STRUCTURE, table[path], f"{path} does not exist")


def orders(table: dict[Path, int]) -> dict[Path, list[str]]:
    """The order of each folder of the table: of its files, or of its folders if it has no files of its own."""
    found: dict[Path, dict[str, None]] = {}
    for path in table:
        found.setdefault(path.parent, {})[path.stem] = None
    own = set(found)
    for folder in own.copy():
        for above in folder.parents:
            if above not in own and above != Path():
                found.setdefault(above, {})
    for folder in found.keys() - own:
        names = (path.relative_to(folder).parts[0] for path in table if path.is_relative_to(folder))
        found[folder] = dict.fromkeys(names)
    return {folder: list(names) for folder, names in found.items()}


def readme_problems(root: Path, table: dict[Path, int]) -> Iterator[Violation]:
    """Folders whose README does not state the order of the table."""
    for folder, names in sorted(orders(table).items()):
        page = folder / "README.md"
        text = lines(root, page) if (root / page).is_file() else []
        found = [(n, m.group(1)) for n, line in enumerate(text, start=1) if (m := README_ORDER.fullmatch(line))]
        wanted = " → ".join(names)
        if len(found) != 1:
            yield Violation(page, 1, f"wanted one indented line with the order: {wanted}")
        elif found[0][1] != wanted:
            yield Violation(page, found[0][0], f"the order in the STRUCTURE table is {wanted}")


def stage_of(path: Path, table: dict[Path, int]) -> str:
    """modulate_applied belongs to modulate, flux_table_types to flux_table: the shortest stem that it continues."""
    stems = {other.stem for other in table if other.parent == path.parent} | {path.stem}
    return min((stem for stem in stems if f"{path.stem}_".startswith(f"{stem}_")), key=len)


def neighbour_problem(layer: Layer, path: Path, target: Path, table: dict[Path, int]) -> str | None:
    """Why a file may not include a header of its own folder."""
    same = stage_of(path, table) == stage_of(target, table)
    if layer.stages and not same and not VALUE_HEADERS.fullmatch(target.name):
        return f"another stage may be included for its value types only (*_types.h): {target}"
    neighbours = path.parent == target.parent and not same
    if layer.ordered and neighbours and table.get(target, 0) > table.get(path, 0):
        return f"include against the order of the STRUCTURE table: {target} stands below"
    return None


def resolve(root: Path, path: Path, name: str) -> Path | None:
    """The project's file an #include "name" means."""
    for folder in (path.parent, *map(Path, ROOTS)):
        if (root / folder / name).is_file():
            target = (root / folder / name).resolve()
            return target.relative_to(root.resolve())
    return None


def project_problem(root: Path, layer: Layer, path: Path, name: str, table: dict[Path, int]) -> str | None:
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
        return neighbour_problem(layer, path, target, table)
    if target_layer and target_layer.folder in layer.values_of:
        known = VALUE_HEADERS.fullmatch(target.name)
        return None if known else f"another stage may be included for its value types only (*_types.h): {target}"
    if target_layer is None or target_layer.folder not in layer.may_include:
        allowed = ", ".join(layer.may_include) or "nothing outside its folder"
        return f"{layer.folder} may include {allowed}; not {target}"
    return None


def check(root: Path) -> Iterator[Violation]:
    """All includes of all layers, and the table against the tree."""
    table = structure(root)
    yield from structure_problems(root, table)
    yield from readme_problems(root, table)
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
                problem = project_problem(root, layer, path, name, table)
            else:
                problem = None if system in layer.system else f"<{system}> in {layer.folder}"
            if problem:
                yield Violation(path, number, problem)


if __name__ == "__main__":
    sys.exit(run(check, "layer rule"))
