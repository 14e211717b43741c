# SPDX-License-Identifier: Apache-2.0
"""Functions that would start a program, a server or a long run are replaced by one that says that it was reached.

What is calculated for a motor is calculated once for everything on which it depends: most mutations of a motor.toml
that are accepted change neither its tables nor its current references.
"""

import faulthandler
import os
import pickle
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from pkgutil import resolve_name
from types import SimpleNamespace
from typing import Any

import pytest
from abused import accepted

from fluxtrue_tools import reader_process
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.bases import Bases
from fluxtrue_tools.motor.config import Machine
from fluxtrue_tools.motor.flux_model import FluxModel
from fluxtrue_tools.motor.motor import load_motor
from fluxtrue_tools.motor.names import PLOTS, source_files
from fluxtrue_tools.motor.references import Solver

# All of it comes after everything that a command can know of its input.
WORK = (
    "sim.build._make", "emulate.build.image", "emulate.build.sim_build.run_logged", "emulate.library.load",
    "fuzz.cli.run_logged", "fuzz.cli.configure_build", "prove.cli.Checker", "mutate.cli.Build", "wcet.bound.Image.read",
    "bench.run", "bench.figures.measure",
    "campaign.run.run_case", "campaign.run._simulate", "campaign.schedule.dask",
    "fault_campaign.run.schedule.missing", "fault_campaign.run.run_one", "demo.all.demonstrate",
    "commission.steps.run", "commission.on_the_bus.VirtualEcu", "commission.on_the_bus.connected",
    "live.cli._session", "live.cli.VirtualEcu", "live.cli.Channel", "live.wizard.start.session",
    "scope.cli.VirtualEcu", "scope.cli.Channel", "scope.cli._line",
)  # fmt: skip


# What these find for an input depends on nothing else, so that it is computed once for each input that they accept.
Function = Callable[..., Any]


def _whole(*arguments: Any) -> bytes:
    return pickle.dumps(arguments)


def _of_tables(model: FluxModel, bases: Bases, machine: Machine) -> bytes:
    """Of the machine, make_flux_tables reads these values only."""
    return _whole(model, bases, machine.i_max_A, machine.pole_pairs, machine.torque_max_Nm, machine.r_ohm)


def _of_references(solver: Solver, *others: Any) -> bytes:
    """What a solver is made from."""
    return _whole(solver.model, solver.pole_pairs, solver.i_max_A, *others)


CALCULATIONS: dict[str, Function] = {
    "motor.map_import.run.fit": _whole, "motor.map_import.run.fit_separately": _whole,
    "motor.map_import.run.make_grid": _whole, "motor.map_import.run.changes": _whole,
    "motor.motor.make_flux_tables": _of_tables, "motor.motor.make_references": _of_references,
    "motor.build.generate": id,
}  # fmt: skip
MOTORS = ("motor.motor.load_motor", "motor.build.load_motor", "motor.map_import.run.load_motor")


def _content(folder: Path) -> tuple[str, tuple[bytes, ...]]:
    """What load_motor reads, and the folder that it names in a message."""
    return str(folder), tuple(path.read_bytes() for path in source_files(folder) if path.is_file())


def remembered(function: Function, key: Function) -> Function:
    """The function with the results and the refusals that it has had."""
    known: dict[Any, tuple[Any, Any]] = {}

    def call(*arguments: Any) -> Any:
        what = key(*arguments)
        if what not in known:
            try:
                known[what] = function(*arguments), arguments  # kept, because of id()
            except FluxtrueError as error:
                known[what] = error, arguments
        found = known[what][0]
        if isinstance(found, FluxtrueError):
            raise type(found)(*found.args)
        return found

    return call


def _read_apart(command: list[str], **_: object) -> subprocess.CompletedProcess[bytes]:
    """The process of a reader, as reader_process.py starts it, but with its packages loaded."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        child = os.fork()
        if child == 0:
            faulthandler.disable()  # a crash is one of the results
            code = 1
            try:
                out.write(reader_process.answer(import_module(command[-2]).read, Path(command[-1])))
                out.flush()
                code = 0
            except Exception as error:
                err.write(reader_process.reason(error).encode())
                err.flush()
            finally:
                os._exit(code)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        return subprocess.CompletedProcess(command, code, *(file.seek(0) or file.read() for file in (out, err)))


def _picture(_: object, path: Path) -> None:
    """The drawing of an imported map takes a second."""
    path.write_bytes(b"a picture")


def _pictures(*given: object) -> tuple[str, ...]:
    """Those of a motor's report take five; the last argument is the folder. Returns what was drawn."""
    folder = given[-1]
    assert isinstance(folder, Path)
    for name in PLOTS:
        (folder / name).write_bytes(b"a picture")
    return tuple(PLOTS)


@pytest.fixture(scope="module", autouse=True)
def stubs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Replace everything that builds, serves, starts another program or runs for long."""
    import_module("fluxtrue_tools.commission.hidden")  # knows the folders of the true checkout
    with pytest.MonkeyPatch.context() as patch:
        for place in WORK:
            patch.setattr(f"fluxtrue_tools.{place}", accepted)
        for place, key in CALCULATIONS.items():
            patch.setattr(f"fluxtrue_tools.{place}", remembered(resolve_name(f"fluxtrue_tools.{place}"), key))
        # Results without --out: other tests read the checkout meanwhile.
        patch.setattr("fluxtrue_tools.sim.build.ROOT", tmp_path_factory.mktemp("checkout"))
        load = remembered(load_motor, _content)
        for place in MOTORS:
            patch.setattr(f"fluxtrue_tools.{place}", load)
        patch.setattr(os, "execv", accepted)
        patch.setattr(os, "execve", accepted)
        patch.setattr("fluxtrue_tools.reader_process.subprocess", SimpleNamespace(run=_read_apart, DEVNULL=None))
        patch.setattr("fluxtrue_tools.motor.map_import.plot.write", _picture)
        patch.setattr("fluxtrue_tools.motor.html.write_plots", _pictures)
        patch.setattr("fluxtrue_tools.motor.measured.measure_loop", lambda _: None)
        patch.setattr("fluxtrue_tools.motor.html.write_report", lambda *given: _pictures(*given[::2]))
        yield
