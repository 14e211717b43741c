# SPDX-License-Identifier: Apache-2.0
"""The files and folders that a command writes: checked before any work, complete or absent afterwards.

Every command declares its output paths here (click does it through ``paths.py``) and writes through the same object.

- An output is none of the command's inputs and no second output, under another name, a symbolic or a hard link either.
- It is refused before any work when it cannot be written: empty, '-', a folder for a file or the other way round, a
  device, a name that is too long, a loop of links, a missing or write-protected folder.
- Files and new folders are made beside their place and renamed when the whole command has succeeded. When it fails, or
  is interrupted, every file is as it was before and nothing is left behind.
"""

import contextlib
import os
import shutil
import stat
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType

from fluxtrue_tools.errors import FluxtrueError

PREFIX = ".fluxtrue-"  # of everything that is not complete yet


def _reason(error: OSError | ValueError) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def _refused(label: str, path: Path | str, why: str) -> FluxtrueError:
    return FluxtrueError(f"{label} {str(path)!r}: {why}" if not str(path) else f"{label} {path}: {why}")


def _status(label: str, path: Path) -> os.stat_result | None:
    """What exists at the path; None if nothing does."""
    try:
        return path.stat()
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:  # a name that is too long, a loop of links, a file as a folder, a NUL
        raise _refused(label, path, f"cannot be written ({_reason(error)})") from None


def _key(path: Path) -> tuple[int, int] | str:
    """A key that is the same for all names of one file."""
    try:
        found = path.stat()
    except (OSError, ValueError):
        return os.path.realpath(path)
    return found.st_dev, found.st_ino


def _probe(label: str, path: Path, folder: Path) -> None:
    """Find out whether a file can be made, by making one."""
    try:
        handle, name = tempfile.mkstemp(prefix=PREFIX, dir=folder)
        os.close(handle)
        Path(name).unlink()
    except OSError as error:
        raise _refused(label, path, f"cannot be written ({_reason(error)} in {folder})") from None


def _check_name(label: str, path: Path) -> None:
    if str(path) in ("", "-"):
        raise _refused(label, path, "is no name of a file or folder; standard output is not supported")
    try:
        os.fsencode(path)
    except UnicodeEncodeError:
        raise _refused(label, ascii(str(path)), "cannot be written (not a name in this system's encoding)") from None


@dataclass(frozen=True)
class _Target:
    """One declared output."""

    label: str
    given: Path
    real: Path
    is_folder: bool
    names: tuple[str, ...] = ()  # of the files that will be in the folder

    def files(self) -> Iterator[Path]:
        """Every path that will be written."""
        if self.is_folder:
            yield from (self.real / name for name in self.names)
        else:
            yield self.real


@dataclass
class Outputs:
    """All outputs of one command; a context that renames them at its end, or removes them after an error."""

    _inputs: list[tuple[str, Path]] = field(default_factory=list)
    _targets: list[_Target] = field(default_factory=list)
    _staged: list[tuple[_Target, Path]] = field(default_factory=list)
    _made: list[Path] = field(default_factory=list)  # folders above a new folder
    _stale: list[Path] = field(default_factory=list)

    def reads(self, *paths: Path | None, label: str = "input") -> None:
        """Further inputs, as soon as they are known; refuses outputs that would destroy one."""
        self._inputs += [(label, path) for path in paths if path is not None]
        for target in self._targets:
            self._check_apart(target)

    def file(self, label: str, path: Path, suffixes: tuple[str, ...] = ()) -> None:
        """Declare a file."""
        _check_name(label, path)
        status = _status(label, path)
        if status is not None and stat.S_ISDIR(status.st_mode):
            raise _refused(label, path, "is a folder, allowed: a file name")
        if status is not None and not stat.S_ISREG(status.st_mode):
            raise _refused(label, path, "is a device or a pipe, allowed: a file name")
        if suffixes and path.suffix.lower() not in suffixes:
            raise _refused(label, path, f"allowed: a file ending in {', '.join(suffixes)}")
        real = Path(os.path.realpath(path))
        made = any(real.parent == target.real for target in self._targets if target.is_folder)
        if not made and not real.parent.is_dir():
            raise _refused(label, path, f"cannot be written (no folder {real.parent})")
        if status is not None and not os.access(real, os.W_OK):
            raise _refused(label, path, "cannot be written (the file that is there is write-protected)")
        self._declare(_Target(label, path, real, is_folder=False))
        if real.parent.is_dir():
            _probe(label, path, real.parent)

    def folder(self, label: str, path: Path, names: Iterable[str] = ()) -> None:
        """Declare a folder with the names of the files that will be in it; folders above it are made."""
        _check_name(label, path)
        status = _status(label, path)
        if status is not None and not stat.S_ISDIR(status.st_mode):
            raise _refused(label, path, "is a file, allowed: a folder")
        real = Path(os.path.realpath(path))
        above = real
        while _status(label, above) is None:
            above = above.parent
        if not above.is_dir():
            raise _refused(label, path, f"cannot be made ({above} is a file)")
        target = _Target(label, path, real, is_folder=True, names=tuple(names))
        for name in target.names:
            if (real / name).is_dir():
                raise _refused(label, path, f"{real / name} is a folder, a file of that name belongs there")
        self._declare(target)
        _probe(label, path, above)

    def _declare(self, target: _Target) -> None:
        known = {_key(path): other for other in self._targets for path in (*other.files(), other.real)}
        for path in (*target.files(), target.real):
            if _key(path) in known:
                raise _refused(target.label, target.given, "given twice, allowed: another name for every output")
        self._check_apart(target)
        self._targets.append(target)

    def _check_apart(self, target: _Target) -> None:
        inputs = {_key(path): (label, path) for label, path in self._inputs}
        for path in (*target.files(), target.real):
            if _key(path) in inputs:
                label, source = inputs[_key(path)]
                raise _refused(target.label, target.given,
                               f"would overwrite {label} {source}, allowed: another name")  # fmt: skip

    def _target(self, path: Path) -> _Target:
        return next(target for target in self._targets if target.given == path)

    def scratch(self, path: Path) -> Path:
        """A file or folder to fill that takes its declared name when the command succeeds."""
        target = self._target(path)
        suffix = "" if target.is_folder else target.real.suffix
        beside = target.real if target.is_folder and target.real.is_dir() else target.real.parent
        try:
            self._make_parents(beside)
            if target.is_folder:
                made = Path(tempfile.mkdtemp(prefix=PREFIX, dir=beside))
            else:
                handle, name = tempfile.mkstemp(prefix=PREFIX, suffix=suffix[-40:], dir=beside)
                os.close(handle)
                made = Path(name)
        except OSError as error:
            raise _refused(target.label, path, f"cannot be written ({_reason(error)})") from None
        self._staged.append((target, made))
        return made

    def remove(self, path: Path, name: str) -> None:
        """Remove a file of an older run when the command succeeds."""
        self._stale.append(self._target(path).real / name)

    def text(self, path: Path, text: str) -> None:
        """Write a file from text."""
        with self._complaining(path):
            self.scratch(path).write_text(text, encoding="utf-8")

    def data(self, path: Path, data: bytes) -> None:
        """Write a file from bytes."""
        with self._complaining(path):
            self.scratch(path).write_bytes(data)

    @contextlib.contextmanager
    def _complaining(self, path: Path) -> Iterator[None]:
        target = self._target(path)
        try:
            yield
        except OSError as error:
            raise _refused(target.label, path, f"cannot be written ({_reason(error)})") from None

    def _make_parents(self, folder: Path) -> None:
        missing = [folder, *folder.parents]
        missing = missing[: next(k for k, path in enumerate(missing) if path.is_dir())]
        for path in reversed(missing):
            path.mkdir()
            self._made.append(path)

    def __enter__(self) -> "Outputs":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._commit()
            elif isinstance(error, OSError) and self._staged:
                target = self._staged[-1][0]  # what was being written: matplotlib, pandas
                raise _refused(target.label, target.given, f"cannot be written ({_reason(error)})") from None
        finally:
            self._discard()

    def _commit(self) -> None:
        moves = [move for target, made in self._staged for move in _moves(target, made)]
        for target, made, place in moves:
            if place.is_dir():
                raise _refused(target.label, target.given, f"{place} is a folder, a file of that name belongs there")
            _permit(made, place)
        for target, made, place in moves:
            try:
                made.replace(place)
            except OSError as error:
                raise _refused(target.label, target.given, f"cannot be written ({_reason(error)})") from None
        for path in self._stale:
            path.unlink(missing_ok=True)
        self._made.clear()

    def _discard(self) -> None:
        for _, made in self._staged:
            if made.is_dir():
                shutil.rmtree(made, ignore_errors=True)
            else:
                made.unlink(missing_ok=True)
        self._staged.clear()
        for path in reversed(self._made):
            with contextlib.suppress(OSError):  # another program has written into it meanwhile
                path.rmdir()
        self._made.clear()


def _moves(target: _Target, made: Path) -> Iterator[tuple[_Target, Path, Path]]:
    """Every renaming: of a file, of a new folder as a whole, or of each file of an existing folder."""
    if target.is_folder and target.real.is_dir():
        yield from ((target, path, target.real / path.name) for path in sorted(made.iterdir()))
    else:
        yield target, made, target.real


def _permit(path: Path, place: Path) -> None:
    """Set the permissions of the replaced file, or those of a new file; a temporary file has only its owner's."""
    if place.is_file():
        path.chmod(stat.S_IMODE(place.stat().st_mode))
        return
    umask = os.umask(0)
    os.umask(umask)
    for each in (path, *(path.rglob("*") if path.is_dir() else ())):
        each.chmod((0o777 if each.is_dir() else 0o666) & ~umask)


@contextlib.contextmanager
def atomic(path: Path) -> Iterator[Path]:
    """One file that is not an output of the command: replaced when the block succeeds, else unchanged."""
    outputs = Outputs()
    outputs.file("output", path)
    with outputs:
        yield outputs.scratch(path)


def write_text(path: Path, text: str) -> None:
    """Write one file; after an error it is unchanged."""
    with atomic(path) as scratch:
        scratch.write_text(text, encoding="utf-8")
