# SPDX-License-Identifier: Apache-2.0
"""Reads a .mat or .h5, in a process of its own: scipy's and h5py's readers can crash on a damaged file."""

from pathlib import Path
from typing import Any

import numpy as np

DEPTH_MAX = 12
ROOT = "root"  # above all names, so that none is that of an argument of numpy's
Tree = dict[str, Any]


def _text(values: Any) -> str:
    return "".join(chr(int(value)) for value in np.ravel(values)[:1000])


def _h5_value(node: Any, matlab: bool) -> Any:
    if node.attrs.get("MATLAB_empty", 0):
        return np.zeros(0)
    values = node[()]
    if matlab:  # MATLAB stores the first index as the fastest one
        if node.attrs.get("MATLAB_class", b"") == b"char":
            return _text(values.T)
        if getattr(values, "dtype", None) is not None and values.dtype.names == ("real", "imag"):
            values = values["real"] + 1j * values["imag"]
        return np.asarray(values).T
    return values.decode("latin-1") if isinstance(values, bytes) else values


def _h5_tree(group: Any, matlab: bool, depth: int = 0) -> Tree:
    import h5py

    found: Tree = {}
    for name, node in group.items():
        if isinstance(node, h5py.Dataset):
            found[name] = _h5_value(node, matlab)
        elif depth < DEPTH_MAX and not name.startswith("#"):
            found[name] = _h5_tree(node, matlab, depth + 1)
    return found


def _h5(path: Path) -> Tree:
    import h5py

    with path.open("rb") as file:
        matlab = file.read(6) == b"MATLAB"
    with h5py.File(path, "r") as file:
        return _h5_tree(file, matlab)


def _mat(path: Path) -> Tree:
    from scipy.io import loadmat

    return dict(loadmat(path, simplify_cells=True))


def _flat(tree: Tree, prefix: str = "", depth: int = 0) -> Tree:
    """Numbers and texts by their names; what is neither is left out."""
    found: Tree = {}
    for name, node in tree.items():
        if isinstance(node, dict):
            found |= _flat(node, f"{prefix}{name}/", depth + 1) if depth < DEPTH_MAX else {}
            continue
        try:
            value = np.asarray(node)
        except (ValueError, TypeError):
            continue
        if value.dtype.kind in "biufcU" and not name.startswith("__"):
            found[f"{prefix}{name}"] = value
    return found


def read(path: Path) -> Tree:
    """Its arrays by their names, parts divided by slashes (reader_process.py)."""
    with path.open("rb") as file:
        start = file.read(1024)
    return _flat({ROOT: _h5(path) if b"\x89HDF\r\n\x1a\n" in start else _mat(path)})
