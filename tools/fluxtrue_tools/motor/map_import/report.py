# SPDX-License-Identifier: Apache-2.0
"""import.txt: what was read, how it was counted, what the fit changed."""

from fluxtrue_tools.motor.map_import.changes import TORQUE_WANTED
from fluxtrue_tools.motor.map_import.run import Imported

OFFSET_MAX = 0.05  # of the largest psi_q
CURL_MAX = 0.05  # of the mean inductance
LOSS_MAX = 0.2  # of the rms iron loss that the two coefficients leave


def _mVs(value: float) -> str:
    return f"{1e3 * value:.3f} mVs"


def _percent(value: float) -> str:
    return f"{100.0 * value:.3f} %"


def warnings(done: Imported) -> list[str]:
    """What would hurt."""
    found = []
    changed, grid = done.changes, done.grid
    path, i_max = done.path, done.i_max_A
    largest = float(abs(done.points.psi_q).max())
    if abs(done.fit.offset_Vs) > OFFSET_MAX * largest:
        found.append(
            f"{path}: psi_q has an offset of {1e3 * done.fit.offset_Vs:.3g} mV·s, "
            f"{100 * abs(done.fit.offset_Vs) / largest:.2g} % of its largest value; it was taken away (allowed without "
            f"a warning: {100 * OFFSET_MAX:g} %). An angle that is off turns psi_d into psi_q"
        )
    if done.curl > CURL_MAX:
        found.append(
            f"{path}: not reciprocal: d psi_d/d i_q and d psi_q/d i_d differ by {100 * done.curl:.3g} % of the mean "
            f"inductance (allowed without a warning: {100 * CURL_MAX:g} %); no lossless machine has such a map"
        )
    if changed.worst(changed.torque) > TORQUE_WANTED:
        found.append(
            f"{path}: the torque of the map differs by up to {_percent(changed.worst(changed.torque))} of the largest "
            f"from {changed.source} torque (wanted: {100 * TORQUE_WANTED:g} %)"
        )
    if grid.circle_outside > 0.0:
        found.append(
            f"{path}: no points in {100 * grid.circle_outside:.2g} % of the circle of machine.i_max_A = {i_max:g} A; "
            "the map goes on there with the last inductances (column extrapolated)"
        )
    loss = done.iron_loss
    if loss is not None and loss.share > LOSS_MAX:
        found.append(
            f"{path}: the iron losses are not (k_h w + k_e w²)|psi|²: the fit leaves {100 * loss.share:.2g} % of their "
            f"rms value (allowed without a warning: {100 * LOSS_MAX:g} %)"
        )
    return found


def _iron(done: Imported) -> list[str]:
    loss = done.iron_loss
    if loss is None:
        return ["iron loss: none given"]
    lines = [
        f"iron loss: {loss.points} points up to {loss.largest_W:.4g} W, k_h {loss.hysteresis:.4g}, k_e {loss.eddy:.4g}",
        f"  left               rms {loss.rms_W:.3g} W ({100 * loss.share:.2g} %), max {loss.max_W:.3g} W",
    ]
    if loss.assumed:
        lines.append("  assumed            half hysteresis, half eddy currents: one speed cannot tell them apart")
    return lines


def text(done: Imported) -> str:
    """The report."""
    c, grid, fit = done.changes, done.grid, done.fit
    lines = [
        *(f"warning: {one}" for one in warnings(done)),
        f"imported {done.path}: {done.read} points, {len(done.points)} used",
        *(f"  {note}" for note in done.notes),
        f"co-energy: {fit.unknowns:.0f} effective unknowns of {fit.count}, {len(grid.id_A)} x {len(grid.iq_A)} nodes, "
        f"i_d {grid.id_A[0]:g} ... 0 A, i_q 0 ... {grid.iq_A[-1]:g} A (the other half by symmetry)",
        f"  psi_d changed by   max {_mVs(c.worst(c.psi_d_Vs))}, rms {_mVs(c.rms(c.psi_d_Vs))} (in the circle)",
        f"  psi_q changed by   max {_mVs(c.worst(c.psi_q_Vs))}, rms {_mVs(c.rms(c.psi_q_Vs))}, of which its offset "
        f"{_mVs(fit.offset_Vs)}",
        f"  torque             max {_percent(c.worst(c.torque))}, rms {_percent(c.rms(c.torque))} of "
        f"{c.largest_Nm:.4g} N·m, against {c.source} torque",
        f"                     removed before: max {_percent(c.torque_even)}, the part that +i_q and -i_q share",
        f"  not reciprocal     {_percent(done.curl)} of the mean inductance in the file, {_percent(done.curl_left)} "
        "in the map",
        f"extrapolated: {int(grid.extrapolated.sum())} of {grid.extrapolated.size} nodes, "
        f"{100 * grid.circle_outside:.2g} % of the current circle; the points reach {grid.reach_A:.4g} A on both axes",
        *_iron(done),
        *(f"assumed: {one}" for one in done.settings.assumed()),
    ]
    return "\n".join(lines) + "\n"
