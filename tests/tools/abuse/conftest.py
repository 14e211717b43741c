# SPDX-License-Identifier: Apache-2.0
"""Functions that would start a program, a server or a long run are replaced by one that says that it was reached.

The calculation of a motor is done once for each motor.
"""

import os
import pickle
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import pytest
from abused import accepted

from fluxtrue_tools.motor.motor import load_motor
from fluxtrue_tools.motor.names import PLOTS, source_files

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
CALCULATIONS = {
    "motor.map_import.run.fit": pickle.dumps, "motor.map_import.run.fit_separately": pickle.dumps,
    "motor.build.generate": id,
}  # fmt: skip
MOTORS = ("motor.motor.load_motor", "motor.build.load_motor", "motor.map_import.run.load_motor")
Function = Callable[..., Any]


def _content(folder: Path) -> tuple[bytes, ...]:
    """What load_motor reads."""
    return tuple(path.read_bytes() for path in source_files(folder) if path.is_file())


def remembered(function: Function, key: Function) -> Function:
    """The function with the results that it has had; what it refuses is worked out again."""
    known: dict[Any, tuple[Any, Any]] = {}

    def call(*arguments: Any) -> Any:
        what = key(arguments) if key is pickle.dumps else key(*arguments)
        if what not in known:
            known[what] = function(*arguments), arguments
        return known[what][0]

    return call


def _picture(_: object, path: Path) -> None:
    """The drawing of an imported map takes a second."""
    path.write_bytes(b"a picture")


def _pictures(*given: object) -> None:
    """Those of a motor's report take five; the last argument is the folder."""
    folder = given[-1]
    assert isinstance(folder, Path)
    for name in PLOTS:
        (folder / name).write_bytes(b"a picture")


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
        patch.setattr("fluxtrue_tools.motor.map_import.plot.write", _picture)
        patch.setattr("fluxtrue_tools.motor.html.write_plots", _pictures)
        patch.setattr("fluxtrue_tools.motor.measured.measure_loop", lambda _: None)
        patch.setattr("fluxtrue_tools.motor.html.write_report", lambda *given: _pictures(*given[::2]))
        yield
