# SPDX-License-Identifier: Apache-2.0
"""Files of arrays as nested dictionaries: .mat up to version 7.2 and .mat 7.3, .h5, .npz, .json, .json.gz.

scipy, h5py, numpy and json read them; nothing that could run code (pickles, MATLAB objects) is loaded.
"""

import gzip
import json
import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.map_import import readers
from fluxtrue_tools.motor.text_table import SIZE_MAX, check_size
from fluxtrue_tools.reader_process import arrays_from

Tree = dict[str, Any]
HDF5, GZIP, ZIP = b"\x89HDF\r\n\x1a\n", b"\x1f\x8b", b"PK"
MATLAB_HEAD = 512  # bytes before the HDF5 part of a .mat 7.3
VALUE_MAX = 1e9
KINDS = ".mat (5 to 7.3), .h5, .npz, .json, .json.gz"


def _npz(path: Path) -> Tree:
    with zipfile.ZipFile(path) as file:
        unpacked = sum(entry.file_size for entry in file.infolist())
    if unpacked > SIZE_MAX:
        raise FluxtrueError(f"{path}: {unpacked} bytes unpacked, allowed: up to {SIZE_MAX}")
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def _json(path: Path, packed: bool) -> Tree:
    if packed:
        with gzip.open(path, "rb") as file:
            data = file.read(SIZE_MAX + 1)
        if len(data) > SIZE_MAX:
            raise FluxtrueError(f"{path}: more than {SIZE_MAX} bytes unpacked, allowed: up to {SIZE_MAX}")
    else:
        data = path.read_bytes()
    tree = json.loads(data)
    if not isinstance(tree, dict):
        raise ValueError("not an object")
    return tree


def _apart(path: Path) -> Tree:
    """The arrays of a .mat or .h5."""
    return _nested(arrays_from(readers.__name__, path)).get(readers.ROOT, {})


def _nested(flat: dict[str, Any]) -> Tree:
    tree: Tree = {}
    for name, value in flat.items():
        node, parts = tree, name.split("/")
        for part in parts[:-1]:
            node = node.setdefault(part, {})
        node[parts[-1]] = str(value) if value.dtype.kind == "U" and value.ndim == 0 else value
    return tree


def load(path: Path) -> Tree:
    """Everything in the file, by name."""
    try:
        check_size(path)
        with path.open("rb") as file:
            start = file.read(MATLAB_HEAD + len(HDF5))
        if start.startswith(HDF5) or start[MATLAB_HEAD:].startswith(HDF5):
            return _apart(path)
        if start.startswith(ZIP):
            return _npz(path)
        if start.startswith(GZIP):
            return _json(path, packed=True)
        return _json(path, packed=False) if start.lstrip()[:1] == b"{" else _apart(path)
    except FluxtrueError:
        raise
    except MemoryError:
        raise FluxtrueError(f"{path}: cannot be read: too large for the memory") from None
    except Exception as error:  # what these readers raise on damaged files is not documented
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise FluxtrueError(f"{path}: cannot be read as one of {KINDS} ({reason})") from None


def at(tree: Tree, name: str) -> Any:
    """The entry of a dotted name; None if there is none."""
    node: Any = tree
    for part in name.split("."):
        if not isinstance(node, dict) or part not in node:
            return None
        node = node[part]
    return node


def names(tree: Tree, prefix: str = "") -> list[str]:
    """Dotted names of all arrays with more than one number."""
    found = []
    for name, node in tree.items():
        if name.startswith("__"):
            continue
        if isinstance(node, dict):
            found += names(node, f"{prefix}{name}.")
        elif np.size(node) > 1 and not isinstance(node, str):
            found.append(f"{prefix}{name}")
    return found


def array(path: Path, tree: Tree, name: str) -> Array:
    """A numeric array, real or complex."""
    node = at(tree, name)
    if node is None or isinstance(node, dict | str):
        shown = ", ".join(names(tree)[:20]) or "nothing"
        raise FluxtrueError(f"{path}: no array {name}, found: {shown}")
    try:
        values = np.asarray(node, dtype=complex)
    except (ValueError, TypeError):
        raise FluxtrueError(f"{path}: {name} is not an array of numbers") from None
    bad = ~np.isfinite(values) | (np.abs(np.where(np.isfinite(values), values, 0.0)) > VALUE_MAX)
    if bad.any():
        raise FluxtrueError(f"{path}: {name} has {int(bad.sum())} values that are not finite or above {VALUE_MAX:g}, "
                            "allowed: none")  # fmt: skip
    return values if np.iscomplexobj(node) else np.asarray(values.real)


def scalar(tree: Tree, name: str) -> float | None:
    """A finite number, or None."""
    node = at(tree, name)
    if node is None or isinstance(node, dict | str) or np.size(node) != 1:
        return None
    try:
        value = float(np.ravel(node)[0])
    except (TypeError, ValueError):
        return None
    return value if math.isfinite(value) else None
