# SPDX-License-Identifier: Apache-2.0
"""The place of a motor's simulation library, and its build."""

import contextlib
import fcntl
import hashlib
import os
import re
import shutil
import stat
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.names import DBC_NAME

ROOT = Path(__file__).resolve().parents[3]
SHIPPED = ROOT / "firmware" / "motors"
LIBRARY = "libfluxtrue_sim.so"
SIL_LIBRARY = "libfluxtrue_sil.so"
VECU = "fluxtrue_vecu"
UNUSABLE = ';"$\\'
_STEP = re.compile(r"^\[(\d+)/(\d+)\]")


@dataclass(frozen=True)
class MotorFolder:
    """The libraries and data built for one machine."""

    name: str
    folder: Path

    @property
    def library(self) -> Path:
        """Plant, firmware and twin: libfluxtrue_sim.so."""
        return self.folder / LIBRARY

    @property
    def sil(self) -> Path:
        """The firmware alone: libfluxtrue_sil.so."""
        return self.folder / SIL_LIBRARY

    @property
    def vecu(self) -> Path:
        """Application and plant as a program that serves a CAN bus."""
        return self.folder / VECU

    @property
    def dbc(self) -> Path:
        """The bus in the scale of this motor."""
        return self.folder / DBC_NAME

    @property
    def data(self) -> Path:
        """Result of the motor tool: motor.json."""
        return self.folder / "motor.json"


def shipped_names() -> list[str]:
    """The motors that come with the project."""
    return sorted(path.parent.name for path in SHIPPED.glob("*/motor.toml"))


def locate(motor: str, base: Path, where: str = "motor") -> tuple[str, Path]:
    """Name and folder of a shipped motor, or of a folder with a motor.toml, relative to `base`."""
    if motor in shipped_names():
        return motor, SHIPPED / motor
    shipped = ", ".join(shipped_names())
    if not motor or set(motor) & set(UNUSABLE) or not motor.isprintable():
        raise FluxtrueError(f"{where} = {motor!r}, allowed: {shipped}, or a folder whose path has none of "
                            f"{' '.join(UNUSABLE)} and no control characters")  # fmt: skip
    try:
        folder = (base / Path(motor).expanduser()).resolve()
        found = stat.S_ISREG((folder / "motor.toml").stat().st_mode)
    except (FileNotFoundError, NotADirectoryError):
        found = False
    except (OSError, RuntimeError, ValueError) as error:  # a loop of links, an unknown ~user, a name that is too long
        raise FluxtrueError(f"{where} = {motor!r}: {getattr(error, 'strerror', None) or error}") from None
    if not found:
        raise FluxtrueError(f"{where} = {motor!r}: neither a folder with a motor.toml nor one of {shipped}")
    return folder.name, folder


def sources(motor: str, base: Path, where: str = "motor") -> tuple[Path, ...]:
    """The files a motor is made from: no command that uses the motor may write them."""
    from fluxtrue_tools.motor.names import source_files

    return source_files(locate(motor, base, where)[1])


@contextlib.contextmanager
def build_lock() -> Iterator[None]:
    """One build at a time in a checkout.

    It is the lock of the scripts in tools/. Under one of them, which holds it for all it starts, the
    commands that run side by side (tests) take turns by a second one.
    """
    build = ROOT / "build"
    build.mkdir(exist_ok=True)
    inherited = os.environ.get("FLUXTRUE_LOCK") == str(build)
    with (build / (".lock.inner" if inherited else ".lock")).open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def run_logged(command: list[str], log: Path, label: str) -> None:
    """Run a build command with its output in a log and a counter on a terminal."""
    show = sys.stderr.isatty()
    shown = False
    with (
        log.open("a") as file,
        subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process,
    ):
        assert process.stdout is not None
        for line in process.stdout:
            file.write(line)
            if show and (step := _STEP.match(line)):
                print(f"\r{label}: {step[1]} of {step[2]} ", end="", file=sys.stderr, flush=True)
                shown = True
    if shown:
        print("\r\033[K", end="", file=sys.stderr, flush=True)
    if process.returncode != 0:
        raise FluxtrueError(f"{label}: '{' '.join(command)}' failed, see {log}")


def configure_build(build_dir: Path, folder: Path | None, log: Path) -> None:
    """Configure a new build folder; with a folder of motor data for that machine alone, without tests."""
    if (build_dir / "build.ninja").is_file():
        return
    command = ["cmake", "--preset", "host", "-B", str(build_dir)]
    if folder is not None:
        command += [f"-DFLUXTRUE_MOTOR={folder}", "-DFLUXTRUE_TESTS=OFF"]
    run_logged(command, log, f"configuring {build_dir.name}")


def _make(name: str, build_dir: Path, folder: Path | None) -> MotorFolder:
    target = "selected" if folder is not None else name
    build_dir.mkdir(parents=True, exist_ok=True)
    log = build_dir / "simulation.log"
    with build_lock():
        log.unlink(missing_ok=True)
        configure_build(build_dir, folder, log)
        targets = [f"fluxtrue_sim_{target}", f"fluxtrue_sil_{target}", f"fluxtrue_vecu_{target}"]
        command = ["cmake", "--build", str(build_dir), "-j2", "--target", *targets]
        run_logged(command, log, f"building the simulation of motor {name}")
    return MotorFolder(name, build_dir / "motors" / target)


def prepare(motor: str, build_dir: Path | None = None, base: Path | None = None, where: str = "motor") -> MotorFolder:
    """The built motor. A given build folder is used as it is; otherwise build/ is brought up to date."""
    name, folder = locate(motor, base or Path.cwd(), where)
    is_shipped, given = folder == SHIPPED / name, build_dir
    if build_dir is None and "FLUXTRUE_BUILD_DIR" in os.environ:
        build_dir = Path(os.environ["FLUXTRUE_BUILD_DIR"])
    target = name if is_shipped or build_dir is None else _target(build_dir, folder)
    if build_dir is not None and target is not None:
        built = MotorFolder(name, build_dir / "motors" / target)
        if not built.library.is_file():
            raise FluxtrueError(f"{built.library} is missing: cmake --build {build_dir} --target fluxtrue_sim_{target}")
        return built
    if given is not None:
        raise FluxtrueError(f"--build-dir {given}: has no build of {folder}, allowed: a build folder configured with "
                            f"-DFLUXTRUE_MOTOR={folder}")  # fmt: skip
    if is_shipped:
        return _make(name, ROOT / "build" / "host", None)
    return _make_from(name, ROOT / "build" / "sim" / f"{name}-{tag(folder)}", folder)


def tag(folder: Path) -> str:
    """What tells folders of the same name apart in build/."""
    return hashlib.sha256(str(folder).encode()).hexdigest()[:8]


def _make_from(name: str, build_dir: Path, folder: Path) -> MotorFolder:
    """Build a motor from any folder in a build folder of its own, which is removed if the motor data are refused."""
    is_new = not build_dir.exists()
    if is_new:
        _check_motor(folder)
    try:
        return _make(name, build_dir, folder)
    except FluxtrueError:
        _check_motor(folder)
        raise
    finally:
        if is_new and not (build_dir / "build.ninja").is_file():
            shutil.rmtree(build_dir, ignore_errors=True)


def _check_motor(folder: Path) -> None:
    """Report bad motor data themselves instead of the build log."""
    from fluxtrue_tools.motor.build import generate
    from fluxtrue_tools.motor.motor import load_motor, naming

    motor = load_motor(folder)
    with naming(folder):
        generate(motor)


def _target(build_dir: Path, folder: Path) -> str | None:
    """The name by which a build folder has a motor's folder: FLUXTRUE_MOTOR, or one of the tests' machines."""
    for note in sorted(build_dir.glob("motors/*/folder.txt")):
        if Path(note.read_text(encoding="utf-8").strip()).resolve() == folder:
            return note.parent.name
    return None
