# SPDX-License-Identifier: Apache-2.0
"""`fluxtrue` in the process of a test: to load the tools takes longer than most of its commands."""

import contextlib
import io
import subprocess
from pathlib import Path

from fluxtrue_tools.cli import run


def fluxtrue(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    """What a process of its own would answer: exit code, standard output and standard error."""
    words, out, err = [str(a) for a in arguments], io.StringIO(), io.StringIO()
    with contextlib.chdir(cwd), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run(words)
    return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())
