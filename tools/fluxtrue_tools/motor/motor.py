# SPDX-License-Identifier: Apache-2.0
"""One motor, resolved: configuration, flux model, bases, tables, gains."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.bases import Bases, make_bases
from fluxtrue_tools.motor.config import FILE_NAME, MotorConfig, load_config
from fluxtrue_tools.motor.derived import Derived, derive, reference_flux_low
from fluxtrue_tools.motor.flux_map import FluxMap, load_flux_map
from fluxtrue_tools.motor.flux_model import ConstantModel, FluxModel, SplineModel
from fluxtrue_tools.motor.flux_tables import FluxTables, TableError, make_flux_tables
from fluxtrue_tools.motor.references import Limits, ReferenceErrors, References, Solver, make_references


TORQUE_SHARE_MIN = 0.01  # of the torque at i_max: less is a slip of the units, and below the formats' resolution


@dataclass(frozen=True)
class Motor:
    """Everything the generators and the report need."""

    config: MotorConfig
    flux_map: FluxMap | None
    model: FluxModel
    bases: Bases
    derived: Derived
    tables: FluxTables
    table_error: TableError
    solver: Solver
    references: References
    limits: Limits
    reference_errors: ReferenceErrors

    @property
    def flash_bytes(self) -> int:
        return self.tables.flash_bytes + self.references.flash_bytes


@contextmanager
def naming(folder: Path) -> Iterator[None]:
    """Complaints about derived numbers begin with the file whose values they come from."""
    path = folder / FILE_NAME
    try:
        yield
    except FluxtrueError as error:
        text = str(error)
        raise error if text.startswith(str(path)) else FluxtrueError(f"{path}: {text}") from None


def _model(folder: Path, config: MotorConfig) -> tuple[FluxMap | None, FluxModel]:
    machine = config.machine
    if machine.flux_map is None:
        assert machine.ld_H is not None and machine.lq_H is not None and machine.psi_f_Vs is not None
        return None, ConstantModel(machine.ld_H, machine.lq_H, machine.psi_f_Vs)
    flux_map = load_flux_map(folder / machine.flux_map, machine.i_max_A)
    return flux_map, SplineModel(flux_map.id_A, flux_map.iq_A, flux_map.psi_d_Vs, flux_map.psi_q_Vs)


def _check_torque(folder: Path, config: MotorConfig, solver: Solver) -> None:
    machine = config.machine
    if machine.torque_max_Nm > solver.torque_top_Nm:
        raise FluxtrueError(f"{folder / FILE_NAME}: machine.torque_max_Nm = {machine.torque_max_Nm:g}, allowed: up to "
                            f"{solver.torque_top_Nm:.4g}, all the torque there is at i_max_A = {machine.i_max_A:g}")
    if machine.torque_max_Nm < TORQUE_SHARE_MIN * solver.torque_top_Nm:
        raise FluxtrueError(f"{folder / FILE_NAME}: machine.torque_max_Nm = {machine.torque_max_Nm:g}, allowed: from "
                            f"{TORQUE_SHARE_MIN * solver.torque_top_Nm:.4g}, 1 % of the torque at i_max_A = "
                            f"{machine.i_max_A:g}")


def load_motor(folder: Path) -> Motor:
    """Read, check and work out one motor's folder."""
    config = load_config(folder)
    flux_map, model = _model(folder, config)
    machine = config.machine
    with naming(folder):
        bases = make_bases(config, model)
        solver = Solver(model, machine.pole_pairs, machine.i_max_A)
        _check_torque(folder, config, solver)
        tables, table_error = make_flux_tables(model, bases, machine.i_max_A, machine.pole_pairs,
                                               machine.torque_max_Nm)
        references, limits, errors = make_references(solver, bases, reference_flux_low(config),
                                                     machine.torque_max_Nm)
        return Motor(config, flux_map, model, bases, derive(config, model, bases), tables, table_error, solver,
                     references, limits, errors)
