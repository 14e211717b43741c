# SPDX-License-Identifier: Apache-2.0
"""From a file to a motor folder, step by step."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fluxtrue_tools import strict
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor import doubts
from fluxtrue_tools.motor.bases import make_bases
from fluxtrue_tools.motor.config import MotorConfig
from fluxtrue_tools.motor.flux_map import load_flux_map
from fluxtrue_tools.motor.flux_model import FluxModel, SplineModel
from fluxtrue_tools.motor.map_import import folder, frame, iron_loss, layouts, table
from fluxtrue_tools.motor.map_import.changes import Changes, changes
from fluxtrue_tools.motor.map_import.coenergy import Fit, Points, fit, fit_separately
from fluxtrue_tools.motor.map_import.frame import Convention
from fluxtrue_tools.motor.map_import.grid import Grid, chosen, default_i_max, make_grid
from fluxtrue_tools.motor.map_import.source import Losses, Raw
from fluxtrue_tools.motor.motor import Motor, load_motor
from fluxtrue_tools.motor.references import Solver

OPTIONS = {"current": "--current", "flux": "--flux", "flux_unit": "--flux-unit", "counting": "--convention",
           "axes": "--axes", "angle_from": "--angle-from", "angle_unit": "--angle-unit"}  # fmt: skip


@dataclass(frozen=True)
class Request:
    """What the command line asks for."""

    path: Path
    format: str
    columns: tuple[str, ...]
    convention: dict[str, str]  # only what was given
    given: tuple[str, ...]
    motor: Path | None
    nodes: int
    rows: str | None = None
    iron_loss: Path | None = None
    iron_loss_columns: tuple[str, ...] = ()
    iron_loss_points: tuple[tuple[float, float], ...] = ()  # W, rpm


@dataclass(frozen=True)
class Imported:
    """Everything that the report and the plot show."""

    path: Path
    read: int
    points: Points
    notes: list[str]
    i_max_A: float
    settings: folder.Settings
    fit: Fit
    curl: float  # of the points
    curl_left: float  # of the map
    grid: Grid
    model: FluxModel
    changes: Changes
    iron_loss: iron_loss.IronLoss | None


READERS: dict[str, Callable[[Request], Raw]] = {
    "csv": lambda request: table.read_map(request.path, request.columns),
    "arrays": lambda request: layouts.named(request.path, request.columns, request.rows),
    "syre": lambda request: layouts.syre(request.path),
    "motulator": lambda request: layouts.motulator(request.path),
    "pyleecan": lambda request: layouts.pyleecan(request.path),
}


def _convention(request: Request, raw: Raw) -> Convention:
    for name in request.convention:
        if name in raw.fixed:
            raise FluxtrueError(f"{OPTIONS[name]}: has no effect with --format {request.format}, which fixes it: "
                                f"{raw.fixed[name]}")  # fmt: skip
    for name, value in raw.stated.items():
        if request.convention.get(name, value) != value:
            raise FluxtrueError(f"{OPTIONS[name]} {request.convention[name]}: the header of {request.path} says "
                                f"{value}, allowed: the same, or without this option")  # fmt: skip
    polar = "gamma" in raw.quantities
    for name in ("angle_from", "angle_unit"):
        if name in request.convention and not polar:
            raise FluxtrueError(f"{OPTIONS[name]}: has no effect on points given by i_d and i_q")
    if polar and "angle_from" not in request.convention:
        raise FluxtrueError(f"{request.path}: i_s and gamma: wanted: --angle-from d or q, the axis where gamma is 0")
    return Convention(**(raw.fixed | raw.stated | request.convention))


def _settings(request: Request, raw: Raw, out: Path) -> folder.Settings:
    found = folder.settings(request.path, raw.facts, request.motor, request.given)
    found.need(request.path, *folder.NEEDED)
    found.default("machine.name", folder.name_from(out))
    folder.check(found)
    return found


def _model(staging: Path, i_max_A: float) -> SplineModel:
    """The map as motor build reads it."""
    m = load_flux_map(staging / folder.MAP, i_max_A)
    return SplineModel(m.id_A, m.iq_A, m.psi_d_Vs, m.psi_q_Vs)


def _losses(
    request: Request, raw: Raw, convention: Convention, turn: complex, pole_pairs: int
) -> tuple[Losses, str] | None:
    """Iron losses, and what gave them for messages."""
    if request.iron_loss is not None:
        path, columns = request.iron_loss, request.iron_loss_columns
        return iron_loss.read(path, columns, convention, turn, pole_pairs), str(path)
    if request.iron_loss_points:
        return iron_loss.from_points(request.iron_loss_points, pole_pairs), "--iron-loss-point"
    if raw.losses is not None:
        i = turn * convention.amperes * (raw.losses.i_d + 1j * raw.losses.i_q)
        return replace(raw.losses, i_d=i.real, i_q=i.imag), str(raw.path)
    return None


def _complete(found: folder.Settings, model: FluxModel, loss: iron_loss.IronLoss | None, path: Path) -> None:
    """The keys that follow from the map."""
    i_max, pole_pairs = found.number("machine.i_max_A", 1e-3), int(found.number("machine.pole_pairs", 1))
    top = Solver(model, pole_pairs, i_max).torque_top_Nm
    torque = min(strict.down(folder.TORQUE_SHARE * top), folder.TORQUE_MOST_NM)
    found.default("machine.torque_max_Nm", float(f"{torque:.4g}"))
    if loss is not None:
        for key, value in (("iron_loss_hysteresis", loss.hysteresis), ("iron_loss_eddy", loss.eddy)):
            if found.origin.get(f"machine.{key}") == "--set":
                raise FluxtrueError(f"--set machine.{key}: has no effect, the iron losses of {path} are fitted")
            found.put(f"machine.{key}", float(f"{value:.6g}"), str(path))
    if "inverter.current_full_scale_A" not in found.values:
        _scale(found, model, i_max)


def _scale(found: folder.Settings, model: FluxModel, i_max_A: float) -> None:
    """The smallest usual range of the current measurement that the firmware's formats take."""
    for factor in (*folder.FULL_SCALES, folder.FULL_SCALES[0]):  # none fits: the first, whose refusal says what would
        found.put("inverter.current_full_scale_A", folder.full_scale(i_max_A, factor), "assumed")
        try:
            make_bases(strict.parse(MotorConfig, folder.motor_toml(found), folder.FILE_NAME), model)
            return
        except FluxtrueError:
            continue


@contextmanager
def _naming(path: Path, staging: Path) -> Iterator[None]:
    """Errors in data that are not written yet name the file from which the data come."""
    try:
        yield
    except FluxtrueError as error:
        said = str(error).replace(f"{staging / folder.FILE_NAME}: ", "").replace(f"{staging}/", "")
        raise FluxtrueError(f"{path}: {said}") from None


def run(request: Request, staging: Path, out: Path) -> tuple[Imported, Motor]:
    """Read, fit, write into the staging folder, and check the result as motor build does."""
    path = request.path
    raw = READERS[request.format](request)
    convention = _convention(request, raw)
    found = _settings(request, raw, out)
    pole_pairs = int(found.number("machine.pole_pairs", 1))
    with np.errstate(all="ignore"):
        framed = frame.to_frame(raw, convention)
        points, signs = frame.check_torque(raw, framed.points, pole_pairs)
        found.default("machine.i_max_A", default_i_max(points, path))
        i_max = found.number("machine.i_max_A", 1e-3)
        used = chosen(points, i_max, path)
        losses = _losses(request, raw, convention, framed.turn, pole_pairs)  # a bad table is refused before the fit
        fitted = fit(used, i_max)
        grid = make_grid(fitted.model, used, i_max, request.nodes, path)
        (staging / folder.MAP).write_text(folder.flux_map_csv(grid, f"imported from {path.name}"), encoding="utf-8")
        with _naming(path, staging):
            model = _model(staging, i_max)
        loss = None if losses is None else iron_loss.fit(losses[0], model, i_max, losses[1])
        _complete(found, model, loss, request.iron_loss or path)
        (staging / folder.FILE_NAME).write_text(folder.motor_toml(found), encoding="utf-8")
        with _naming(path, staging):
            motor = load_motor(staging)  # what motor build would refuse is refused here
        done = Imported(
            path, len(raw.quantities["psi_d"]), used, [*raw.notes, *framed.notes, *signs], i_max, found, fitted,
            doubts.curl(fit_separately(used, i_max), i_max), doubts.curl(model, i_max), grid, model,
            changes(used, model, pole_pairs, i_max), loss,
        )  # fmt: skip
    return done, motor
