# SPDX-License-Identifier: Apache-2.0
"""The report and the bounds of tools/demo, on invented results and on one run of the demonstration."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from fluxtrue_tools.demo import report, step
from fluxtrue_tools.demo.all import Demonstration, demonstrate
from fluxtrue_tools.demo.experiment import Bench, Bound, Result
from fluxtrue_tools.demo.paper import weaken_until
from fluxtrue_tools.sim.output import json_text


def test_a_bound_is_met_at_its_limit_and_missed_beyond_it_or_without_a_number() -> None:
    bound = Bound("error", 0.3, 0.3, "%")
    assert bound.met
    assert replace(bound, value=-0.3).met
    assert not replace(bound, value=-0.3001).met
    assert not replace(bound, value=math.nan).met
    least = Bound("factor", 20.0, 20.0, "x", at_least=True)
    assert least.met
    assert not replace(least, value=19.9).met
    assert not replace(least, value=math.nan).met


def test_a_missed_bound_is_named_with_its_experiment() -> None:
    result = Result({"id": "paper-fig3-4", "gain_set": "fast"}, [Bound("settles in", 30.0, 20.0, "ms")])
    demonstration = Demonstration([result], realtime_factor=40.0, motulator_realtime_factor=0.3)
    assert demonstration.missed() == ["paper-fig3-4 fast: settles in: 30 ms, allowed ≤ 20 ms"]
    assert demonstration.summary()["bounds_missed"] == demonstration.missed()


def test_what_could_not_be_measured_is_null_in_the_summary() -> None:
    summary = Demonstration([Result({"id": "x", "a": math.nan, "points": [{"b": math.inf}]}, [])]).summary()
    assert summary["experiments"] == [{"id": "x", "a": None, "points": [{"b": None}]}]
    assert summary["realtime_factor"] is None
    assert json.loads(json_text(summary)) == summary


def test_rise_is_interpolated_between_samples() -> None:
    now = np.arange(0.0, 1.0, 0.1)
    ramp = np.minimum(now / 0.5, 1.0) * 100.0  # 10 to 90 % of a 0.5 s ramp: 0.4 s
    assert step.rise_ms(now, ramp, 100.0) == pytest.approx(400.0)
    assert math.isnan(step.rise_ms(now, ramp, 200.0))
    assert step.overshoot_percent(np.array([0.0, 110.0, 100.0]), 100.0) == pytest.approx(10.0)
    assert step.overshoot_percent(np.array([0.0, 90.0]), 100.0) == 0.0


def test_the_magnet_is_weakened_to_the_wanted_loss() -> None:
    # The torque falls by 0.9 of the flux change: -8.75 % at a magnet of 1 - 0.0875/0.9.
    found = weaken_until(lambda scale: -90.0 * (1.0 - scale), -8.75)
    assert found == pytest.approx(1.0 - 0.0875 / 0.9, abs=1e-4)


@pytest.fixture(scope="module")
def whole(machines: Bench) -> Demonstration:
    with pytest.MonkeyPatch.context() as patch:
        # Measuring the speed of the other simulator takes seconds and tests nothing of this project.
        patch.setattr("fluxtrue_tools.demo.realtime.motulator", lambda: 0.3)
        return demonstrate(machines, lambda _: None, lambda: None)


def test_the_summary_has_every_experiment_with_its_fields(whole: Demonstration) -> None:
    summary = whole.summary()
    assert set(summary) >= {"experiments", "realtime_factor", "motulator_realtime_factor"}
    ids = [experiment["id"] for experiment in summary["experiments"]]
    assert ids == ["paper-fig3-4"] * 3 + ["paper-fig7", "paper-fig8", "hsm1-grid", "torque-step", "twin"]
    wanted = {
        "paper-fig3-4": {"gain_set", "psi_error_percent", "r_error_percent", "psi_settle_ms"},
        "paper-fig7": {"psi_error_percent", "r_error_percent"},
        "paper-fig8": {"torque_error_open_percent", "torque_error_closed_percent"},
        "hsm1-grid": {"points"},
        "torque-step": {"rise_ms", "overshoot_percent", "current_rise_ms", "current_overshoot_percent"},
        "twin": {"torque_difference_percent_of_rated"},
    }
    for experiment in summary["experiments"]:
        assert wanted[experiment["id"]] <= set(experiment)
    for point in next(e for e in summary["experiments"] if e["id"] == "hsm1-grid")["points"]:
        assert {"speed_rpm", "torque_requested_Nm", "torque_error_open_percent",
                "torque_error_closed_percent", "psi_error_percent", "r_error_percent"} <= set(point)  # fmt: skip


def test_the_report_needs_no_other_file_and_shows_every_figure(whole: Demonstration) -> None:
    page = report.html(whole)
    sources = re.findall(r'src="([^"]{0,40})', page)
    assert len(sources) == 7
    assert all(source.startswith("data:image/svg+xml;base64,") for source in sources)
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert "nan" not in re.sub(r"base64,[^\"]*", "", page).lower()


def test_the_terminal_table_states_for_every_bound_whether_it_is_met(whole: Demonstration) -> None:
    table = report.terminal(whole)
    rows = report.rows(whole)
    assert len(re.findall(r"\b(met|MISSED)$", table, re.MULTILINE)) == len(rows)
    assert ("MISSED" in table) == any(not row.met for row in rows)
