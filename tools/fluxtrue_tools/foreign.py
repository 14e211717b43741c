# SPDX-License-Identifier: Apache-2.0
"""Files of other programs: whatever a reader raises for a damaged one becomes one message."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from fluxtrue_tools.errors import FluxtrueError


@contextlib.contextmanager
def reading(path: Path | str, what: str) -> Iterator[None]:
    """Around the reading of a file by a package of others (ELF, SVD, DBC, other logs).

    Which exceptions such a reader raises for a damaged file is not documented, and for the readers used here it is any:
    of struct, of the keys and the arithmetic of their own tables, of the memory.
    """
    try:
        yield
    except FluxtrueError:
        raise
    except OSError as error:
        raise FluxtrueError(f"{path}: cannot be read ({error.strerror or error})") from None
    except Exception as error:
        raise FluxtrueError(f"{path}: not {what} ({type(error).__name__}: {str(error)[:200]})") from None
