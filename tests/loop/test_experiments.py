# SPDX-License-Identifier: Apache-2.0
"""Every experiment of tools/demo within its bounds, which are stated here independently."""

from pathlib import Path

import pytest

from fluxtrue_tools.demo import grid, paper, step
from fluxtrue_tools.demo.experiment import Bench, Result

README = Path(__file__).resolve().parents[2] / "README.md"
QUADRANTS = {(s, t) for s in (-3000, -1000, 1000, 3000) for t in (-120, -80, -40, -20, 20, 40, 80, 120)}


def stated(row: str) -> str:
    """The figure of Fluxtrue in the README's table of the demonstration, in the row that begins so."""
    (line,) = (line for line in README.read_text(encoding="utf-8").splitlines() if line.startswith(f"| {row}"))
    return line.split("|")[3].strip()


@pytest.mark.parametrize("gains", ["slow", "medium", "fast"])
def test_flux_and_resistance_are_found_after_the_magnet_changes(machines: Bench, gains: str) -> None:
    found = paper.fig3_4(machines, gains).summary
    assert abs(found["psi_error_percent"]) <= 0.3
    assert abs(found["r_error_percent"]) <= 2.0
    if gains == "fast":
        assert found["psi_settle_ms"] <= 20.0
        assert stated("time until the flux is found") == f"{found['psi_settle_ms']:.0f} ms"


def test_faster_gains_settle_faster(machines: Bench) -> None:
    settle = [paper.fig3_4(machines, g).summary["psi_settle_ms"] for g in ("slow", "medium", "fast")]
    assert settle == sorted(settle, reverse=True)


def test_at_80_newton_metres_flux_and_resistance_follow_magnet_and_winding(machines: Bench) -> None:
    found = paper.fig7(machines).summary
    assert abs(found["psi_error_percent"]) <= 0.3
    assert abs(found["r_error_percent"]) <= 2.0


def test_the_torque_lost_by_the_weak_magnet_is_restored(machines: Bench) -> None:
    found = paper.fig8(machines).summary
    assert found["torque_error_open_percent"] == pytest.approx(-8.75, abs=0.05)
    assert abs(found["torque_error_closed_percent"]) <= 0.3
    assert stated("torque error left after the magnet") == f"{abs(found['torque_error_closed_percent']):.2f} %"


@pytest.fixture(scope="module")
def on_grid(machines: Bench) -> list[Result]:
    return grid.grid(machines)


def test_the_measured_machine_keeps_its_torque_in_four_quadrants(on_grid: list[Result]) -> None:
    points = on_grid[0].summary["points"]
    assert {(p["speed_rpm"], p["torque_requested_Nm"]) for p in points} == QUADRANTS
    for p in points:
        allowed = max(0.5, 15.0 / abs(p["torque_requested_Nm"]))  # 0.15 N·m in percent
        assert abs(p["torque_error_closed_percent"]) <= allowed, p
        # Without the loop the weaker magnets cost 5 to 11 % of the torque.
        assert -11.0 <= p["torque_error_open_percent"] <= -5.0, p
    worst = max(abs(p["torque_error_closed_percent"]) for p in points)
    assert stated("torque error with a weak magnet, a warm winding, dead time and noise") == f"≤ {worst:.2f} %"


def test_the_firmware_does_what_its_double_precision_twin_does(on_grid: list[Result]) -> None:
    twin = on_grid[1].summary
    assert len(twin["points"]) == len(QUADRANTS)
    for p in twin["points"]:
        assert abs(p["torque_difference_open_percent_of_rated"]) <= 0.1, p
        assert abs(p["torque_difference_closed_percent_of_rated"]) <= 0.1, p
    both = ("torque_difference_open_percent_of_rated", "torque_difference_closed_percent_of_rated")
    worst = max(abs(p[key]) for p in twin["points"] for key in both)
    assert stated("fixed point against the same controller") == f"{worst:.3f} % of rated torque"


def test_torque_and_current_step_are_fast_and_hardly_overshoot(machines: Bench) -> None:
    found = step.torque_step(machines).summary
    assert found["rise_ms"] <= 3.0
    assert found["overshoot_percent"] <= 5.0
    assert stated("torque step") == f"{found['rise_ms']:.1f} ms / {found['overshoot_percent']:.1f} %"
    assert found["current_rise_ms"] <= 1.0
    assert found["current_overshoot_percent"] <= 10.0
