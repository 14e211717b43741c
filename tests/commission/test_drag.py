# SPDX-License-Identifier: Apache-2.0
"""Inertia and drag as they are shown, and the warning of a shaft that is coupled."""

from dataclasses import replace

import pytest

from fluxtrue_tools.commission import hidden, report
from fluxtrue_tools.commission.drag import HEAVY, Drag, inertia_text
from fluxtrue_tools.commission.drive import SoftwareInTheLoop
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.score import turned
from fluxtrue_tools.commission.steps import Found, chosen, run
from fluxtrue_tools.live.wizard import results
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

LIGHT = Drag(4.0312e-5, 2.1e-7, 1e-3, 2e-5, 0.0, 30.0, 300.0, 1e-4, 2e-4)
COUPLED = "is the shaft coupled?"
INERTIA = 0.03


@pytest.mark.parametrize(("kgm2", "digits", "text"), [
    (4.0312e-5, 4, "40.31 kg·mm²"), (0.0539, 4, "0.05390 kg·m²"), (2.1513, 4, "2.151 kg·m²"), (4e-5, 1, "40 kg·mm²"),
    (0.0, 1, "0 kg·mm²"),
])  # fmt: skip
def test_an_inertia_can_be_read(kgm2: float, digits: int, text: str) -> None:
    assert inertia_text(kgm2, digits) == text


def test_card_and_report_have_uncertainties(known: Nameplate) -> None:
    small = replace(known, inertia_kgm2=5e-5)
    rows = {name: rest for name, *rest in results.rows("drag", Found(drag=LIGHT), small, 75.0)}
    assert rows["Inertia"] == ["40.31 kg·mm²", "0.2 kg·mm²", "± at most 1.2 kg·mm²"]
    assert rows["Drag at 1146 rpm"][:2] == ["0.0034 N·m", "0.0001 N·m"]
    assert rows["Drag at 2865 rpm"][:2] == ["0.007 N·m", "0.0002 N·m"]
    text = report.text(Found(drag=LIGHT), small, None)
    assert "inertia: 40.31 kg·mm², ±0.2 kg·mm²" in text and "0.0034 ±0.0001 N·m at 1146 rpm" in text
    assert "e-0" not in text and COUPLED not in text


@pytest.mark.parametrize(("heavier", "is_warned"), [(1.0, False), (5.0, True)])
def test_a_load_on_the_shaft_is_named(heavier: float, is_warned: bool, unknown: Motor, known: Nameplate) -> None:
    """The firmware ends a movement only where 15 % of i_max do not turn the shaft within a second. A load of four times
    the rotor's inertia is measured with it, and both are right together."""
    truth, flux_map, plant = hidden.draw("saturated", 101, unknown, known.i_max_A, connected=False)
    plant["inertia_kgm2"] *= heavier
    drive = SoftwareInTheLoop(Loop(unknown.library, plant, flux_map))
    found = run(drive, chosen(("drag",)), known, lambda _: None)
    assert found.drag is not None
    print(found.drag)
    assert abs(turned(found, truth).inertia) <= INERTIA
    assert (found.drag.inertia_kgm2 > HEAVY * known.inertia_kgm2) is is_warned
    for _, torque_Nm, sigma_Nm in found.drag.shown():
        assert 0.0 < sigma_Nm < 0.1 * torque_Nm
    assert (COUPLED in report.text(found, known, None)) is is_warned
    assert any(COUPLED in row[1] for row in results.rows("drag", found, known, 375.0)) is is_warned
