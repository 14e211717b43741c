# SPDX-License-Identifier: Apache-2.0
"""Files of other programs: whatever a reader raises for a damaged one becomes one message."""

import contextlib
import gc
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path

from fluxtrue_tools.errors import FluxtrueError


@contextlib.contextmanager
def reading(path: Path | str, what: str) -> Iterator[None]:
    """Around the reading of a file by a package of others (ELF, MDF, SVD, DBC).

    Which exceptions such a reader raises for a damaged file is not documented, and for the readers used here it is any:
    of struct, of the keys and the arithmetic of their own tables, of the memory.
    """
    try:
        yield
    except FluxtrueError:
        raise
    except OSError as error:
        _release(error)
        raise FluxtrueError(f"{path}: cannot be read ({error.strerror or error})") from None
    except Exception as error:
        _release(error)
        raise FluxtrueError(f"{path}: not {what} ({type(error).__name__}: {str(error)[:200]})") from None


def _release(error: Exception) -> None:
    """Drop what the reader had begun: the end of a half-made object (asammdf's MDF4) raises, which Python prints."""
    hook = sys.unraisablehook
    sys.unraisablehook = lambda _: None
    try:
        each: BaseException | None = error
        while each is not None:
            traceback.clear_frames(each.__traceback__)
            each.__traceback__, each.__context__, each = None, None, each.__context__
        gc.collect()  # of every generation: a collection during the reading may have promoted the object
    finally:
        sys.unraisablehook = hook
