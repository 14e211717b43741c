# SPDX-License-Identifier: Apache-2.0
"""All steps last at most a minute and heat the windings by less than 0.7 of the largest current would."""

import pytest

from fluxtrue_tools.commission import hidden
from fluxtrue_tools.commission.heating import measure
from fluxtrue_tools.commission.metered import Metered
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.steps import ALL, NEEDS
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

SHARE_MAX, SECONDS_MAX = 0.7, 60.0


def test_the_meter_adds_up_the_square_of_the_machine_s_current(unknown: Motor, known: Nameplate) -> None:
    _, flux_map, plant = hidden.draw("linear", 103, unknown, known.i_max_A)
    exact = {f"current_offset_A_{phase}": 0.0 for phase in "abc"} | {f"current_gain_{phase}": 1.0 for phase in "abc"}
    held = {"imposed_speed": 1.0, "speed_rad_s": 0.0}
    drive = Metered(Loop(unknown.library, plant | exact | held, flux_map))
    drive.rest(0.1)
    assert drive.seconds == pytest.approx(0.1) and drive.square_A2s < 1e-3
    drive.set("enable", 1.0)
    drive.push(30.0 + 40.0j)
    drive.rest(1.0)
    assert drive.seconds == pytest.approx(1.1)
    assert drive.square_A2s == pytest.approx(50.0**2, rel=0.02)


@pytest.mark.parametrize(("name", "seed"), [("hsm1", 110), ("pmasynrm", 127)])
def test_time_and_heating_of_all_steps(name: str, seed: int, unknown: Motor, known: Nameplate) -> None:
    found = measure(name, seed, unknown, known)
    print(found)
    assert list(found) == [*NEEDS, ALL]
    assert max(share for _, share in found.values()) <= SHARE_MAX
    assert found["resistance"][1] > 0.1  # direct currents up to 0.85 i_max are in it
    assert found[ALL][0] <= SECONDS_MAX
