# SPDX-License-Identifier: Apache-2.0
"""python-can without its reader and writer of MDF4 files, until one of them is wanted.

cantools imports python-can, and python-can imports asammdf, which imports pandas and SymPy: 1.1 s of processor time in
each process that only reads the DBC, such as each generation of a motor's tables. python-can also works without
asammdf; its module for MDF4 is therefore loaded as if asammdf were not installed. with_mdf() loads it again, in full.
"""

import importlib
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import ModuleType
from typing import Final, cast

MODULE: Final = "can.io.mf4"
LEFT_OUT: Final = "asammdf"


class _Loader(SourceFileLoader):
    """Loads the module while `import asammdf` fails."""

    def exec_module(self, module: ModuleType) -> None:
        modules = cast(dict[str, ModuleType | None], sys.modules)
        modules[LEFT_OUT] = None
        try:
            super().exec_module(module)
        finally:
            del modules[LEFT_OUT]


class _Finder:
    """Finds that one module, unless asammdf is loaded already and costs nothing."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != MODULE or LEFT_OUT in sys.modules:
            return None
        spec = PathFinder.find_spec(name, path, target)
        if spec is not None and spec.origin is not None:
            spec.loader = _Loader(name, spec.origin)
        return spec


def install() -> None:
    """Let an import of python-can from now on leave out asammdf; what is loaded already stays as it is."""
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())


def with_mdf() -> ModuleType:
    """python-can's module for MDF4, with asammdf. Its classes keep their identity: python-can finds them by suffix."""
    importlib.import_module(LEFT_OUT)
    module = importlib.import_module(MODULE)
    if getattr(module, LEFT_OUT) is None:
        kept = {name: getattr(module, name) for name in ("MF4Reader", "MF4Writer")}
        importlib.reload(module)
        vars(module).update(kept)  # their functions look up asammdf in the module, where it is now
    return module
