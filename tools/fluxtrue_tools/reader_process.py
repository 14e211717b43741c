# SPDX-License-Identifier: Apache-2.0
"""Files that compiled readers of other projects take apart (.mat, .h5, .mf4), in a process of its own.

Some damaged files make such a reader crash, fill the memory or leave half-made objects whose end raises once more. None
of that reaches the caller here: it gets arrays, or one message.
"""

import io
import os
import resource
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from fluxtrue_tools.errors import FluxtrueError

MEMORY_MAX = 4 << 30  # bytes
SECONDS_MAX = 120  # of processor time

Arrays = dict[str, Any]


def arrays_from(reader: str, path: Path) -> Arrays:
    """What the function `read(path)` of the module `reader` returns: arrays of numbers or texts by their names.

    Raises ValueError with one line that says what the reader found wrong.
    """
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-m", __name__, reader, os.fspath(path)]
    done = subprocess.run(command, capture_output=True, check=False, env=environment, stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        said = done.stderr.decode("utf-8", "replace").strip().splitlines()
        raise ValueError(said[-1] if done.returncode > 0 and said else "the reader crashed")
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as arrays:
        return {name: arrays[name] for name in arrays.files}


def answer(read: Callable[[Path], Arrays], path: Path) -> bytes:
    """In the process of the reader: the file's arrays in numpy's format .npz, within bounded memory and time."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_MAX, MEMORY_MAX))
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS_MAX, SECONDS_MAX))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    file = io.BytesIO()
    np.savez(file, **read(path))
    return file.getvalue()


def reason(error: Exception) -> str:
    """One line: ours as it is, another package's with its kind, because its text alone may be a bare key or number."""
    text = " ".join(str(error).split())
    return text if isinstance(error, FluxtrueError) else f"{type(error).__name__}: {text}"


def _main(reader: str, path: Path) -> None:
    """The program of the process. It ends at once after a message, before half-made objects print theirs."""
    arrays, sys.stdout = sys.stdout.buffer, sys.stderr  # a reader that prints would damage the arrays
    try:
        arrays.write(answer(import_module(reader).read, path))
        arrays.flush()
    except Exception as error:  # what these readers raise on damaged files is not documented
        print(reason(error), file=sys.stderr, flush=True)
        os._exit(1)


if __name__ == "__main__":
    _main(sys.argv[1], Path(sys.argv[2]))
