# SPDX-License-Identifier: Apache-2.0
"""One motor, resolved: configuration, flux model, bases, tables, gains."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fluxtrue_tools import strict
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor import doubts
from fluxtrue_tools.motor.advice import Test, advice
from fluxtrue_tools.motor.bases import Bases, make_bases
from fluxtrue_tools.motor.bus import BusScales, make_bus_scales
from fluxtrue_tools.motor.config import MotorConfig, check_config, load_config
from fluxtrue_tools.motor.derived import Derived, derive, reference_flux_low
from fluxtrue_tools.motor.flux_map import FluxMap, load_flux_map
from fluxtrue_tools.motor.flux_model import ConstantModel, FluxModel, SplineModel
from fluxtrue_tools.motor.flux_tables import FluxTables, TableError, make_flux_tables
from fluxtrue_tools.motor.names import FILE_NAME
from fluxtrue_tools.motor.quantise import Unfit
from fluxtrue_tools.motor.references import Limits, ReferenceErrors, References, Solver, make_references

TORQUE_SHARE_MIN = 0.01  # of the torque at i_max: less is a wrong unit, and below the resolution of the formats


@dataclass(frozen=True)
class Motor:
    """Everything the generators and the report need."""

    config: MotorConfig
    flux_map: FluxMap | None
    model: FluxModel
    bases: Bases
    derived: Derived
    bus: BusScales
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


def _check_torque(config: MotorConfig, solver: Solver) -> None:
    machine = config.machine
    given = f"machine.torque_max_Nm = {machine.torque_max_Nm:g} N·m, allowed:"
    if machine.torque_max_Nm > solver.torque_top_Nm:
        raise FluxtrueError(
            f"{given} up to {strict.down(solver.torque_top_Nm):g} N·m, all the torque there is at "
            f"i_max_A = {machine.i_max_A:g} A"
        )
    if machine.torque_max_Nm < TORQUE_SHARE_MIN * solver.torque_top_Nm:
        raise FluxtrueError(
            f"{given} from {TORQUE_SHARE_MIN * solver.torque_top_Nm:.4g} N·m, 1 % of the torque at "
            f"i_max_A = {machine.i_max_A:g} A"
        )


def resolve(config: MotorConfig, flux_map: FluxMap | None, model: FluxModel) -> Motor:
    """Everything that follows from the values."""
    machine = config.machine
    bases = make_bases(config, model)
    solver = Solver(model, machine.pole_pairs, machine.i_max_A)
    _check_torque(config, solver)
    tables, table_error = make_flux_tables(model, bases, machine)
    references, limits, errors = make_references(solver, bases, reference_flux_low(config), machine.torque_max_Nm)
    derived = derive(config, model, bases)
    return Motor(
        config,
        flux_map,
        model,
        bases,
        derived,
        make_bus_scales(config, derived),
        tables,
        table_error,
        solver,
        references,
        limits,
        errors,
    )


def _whole(flux_map: FluxMap | None, model: FluxModel) -> Test:
    """Every check for which motor build refuses a configuration."""
    from fluxtrue_tools.motor.emit_c import check_numbers

    def test(config: MotorConfig) -> None:
        check_config(config)
        check_numbers(resolve(config, flux_map, model))

    return test


def _advised(
    config: MotorConfig, flux_map: FluxMap | None, model: FluxModel, error: Unfit, quick: Test
) -> FluxtrueError:
    """The complaint about a number that does not fit: the doubt about its unit, else the keys that help."""
    doubt = doubts.explaining(config, model)
    if doubt is not None and doubt.conclusive:
        return FluxtrueError(doubt.text)
    said = advice(config, quick, _whole(flux_map, model))
    return _doubted(FluxtrueError(f"{said}: {error}" if said else str(error)), doubt)


def _doubted(error: FluxtrueError, doubt: doubts.Doubt | None) -> FluxtrueError:
    if doubt is None:
        return error
    return FluxtrueError(doubt.text if doubt.conclusive else f"{error}. {doubt.text}")


def load_motor(folder: Path) -> Motor:
    """Read, check and work out one motor's folder; what cannot be built is refused."""
    config = load_config(folder)
    with naming(folder), np.errstate(all="ignore"):
        flux_map, model = _model(folder, config)
        try:
            motor = resolve(config, flux_map, model)
        except Unfit as error:
            raise _advised(config, flux_map, model, error, lambda c: (check_config(c), make_bases(c, model))) from None
        except FluxtrueError as error:
            raise _doubted(error, doubts.explaining(config, model)) from None
        return fitted(motor)


def fitted(motor: Motor) -> Motor:
    """The motor, if the firmware's formats hold its numbers."""
    from fluxtrue_tools.motor.emit_c import check_numbers

    def quick(config: MotorConfig) -> None:
        check_config(config)
        bases = make_bases(config, motor.model)
        derived = derive(config, motor.model, bases)
        bus = make_bus_scales(config, derived)
        check_numbers(replace(motor, config=config, bases=bases, derived=derived, bus=bus))

    try:
        check_numbers(motor)
    except Unfit as error:
        raise _advised(motor.config, motor.flux_map, motor.model, error, quick) from None
    return motor
