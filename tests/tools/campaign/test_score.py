# SPDX-License-Identifier: Apache-2.0
"""Figures of merit calculated from given errors."""

import math

import pandas as pd
import pytest
from conftest import SMALL

from fluxtrue_tools.campaign.score import Score, bounds, score
from fluxtrue_tools.campaign.spec import Campaign, parse
from fluxtrue_tools.campaign.terminal import figures_table
from fluxtrue_tools.errors import FluxtrueError

CHECKED = SMALL + '[check]\ncontrollers = ["paper"]\n'


def row(controller: str, case: int, window: int, speed: float, error: float, **more: float) -> dict[str, object]:
    plain = {"controller": controller, "case": case, "window": window, "speed_rpm": speed, "error_percent": error,
             "bound_percent": 0.5, "oscillates": False, "run_fault_word": 0, "run_finite": True,
             "run_psi_clamped": 0, "run_r_clamped": 0}  # fmt: skip
    return plain | more


def table(tables: list[tuple[float, float]], paper: list[tuple[float, float]], **more: float) -> pd.DataFrame:
    """(speed, error) for each window of one case."""
    rows = [row("tables", 0, k, *point) for k, point in enumerate(tables)]
    return pd.DataFrame(rows + [row("paper", 0, k, *point, **more) for k, point in enumerate(paper)])


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    return parse(CHECKED, "hand.toml")


def scored(campaign: Campaign, data: pd.DataFrame) -> Score:
    return next(s for s in score(campaign, data) if s.controller == "paper")


def missed(campaign: Campaign, data: pd.DataFrame) -> list[str]:
    return [b.what for b in bounds(campaign, scored(campaign, data)) if not b.met]


def test_errors_are_pooled_by_band_with_both_directions_together(campaign: Campaign) -> None:
    data = table([(400, 1)] * 5, [(400, 3), (-5000, -4), (5001, 6), (-9000, 8), (150, 50)])
    got = scored(campaign, data).bands
    assert (got["low"].windows, got["high"].windows, got["crawl"].windows) == (2, 2, 1)
    assert got["low"].rms == pytest.approx(math.sqrt((9 + 16) / 2))
    assert got["high"].rms == pytest.approx(math.sqrt((36 + 64) / 2))
    assert got["low"].worst == 4.0
    assert got["low"].ratio == pytest.approx(math.sqrt(12.5) / 0.5)


def test_a_figure_that_does_not_exist_is_a_dash_in_the_table(campaign: Campaign) -> None:
    data = table([(400, 1)], [(400, 3)], bound_percent=math.nan)
    lines = figures_table(campaign, [scored(campaign, data)]).splitlines()
    low, high, _ = (line.split() for line in lines[2:])
    assert low[-6:] == ["1", "3.00", "3.00", "3.00", "-", "-"]
    assert high[-6:] == ["0", "-", "-", "-", "-", "-"]


def test_a_slow_machine_is_held_to_the_bounds_from_its_own_crawl_rpm_on() -> None:
    slow = parse(CHECKED.replace("[check]\n", "[check]\ncrawl_rpm = 30\nband_rpm = 210\n"), "slow.toml")
    data = table([(30, 1)] * 4, [(29, 3), (30, 1), (-210, 1), (211, 1)])
    got = scored(slow, data)
    assert [got.bands[band].windows for band in ("crawl", "low", "high")] == [1, 2, 1]
    assert "below 30 rpm worse than the tables by" in [bound.what for bound in bounds(slow, got)]
    with pytest.raises(FluxtrueError, match=r"check\.crawl_rpm: 300, allowed: below check\.band_rpm, 210"):
        parse(CHECKED.replace("[check]\n", "[check]\nband_rpm = 210\n"), "slow.toml")


def test_three_hundred_rpm_belongs_to_the_low_band(campaign: Campaign) -> None:
    got = scored(campaign, table([(300, 1)], [(-300, 1)])).bands
    assert (got["low"].windows, got["crawl"].windows) == (1, 0)


def test_the_percentile_is_of_the_magnitude(campaign: Campaign) -> None:
    # 101 magnitudes 0, 1 ... 100 with alternating signs: the 99th percentile is 99.
    errors = [(1000.0, k * (-1.0) ** k) for k in range(101)]
    assert scored(campaign, table(errors, errors)).bands["low"].p99 == pytest.approx(99.0)


@pytest.mark.parametrize(
    ("tables", "error", "harmless"),
    [
        (0.0, 2.0, True),
        (0.0, -2.01, False),
        (5.0, -5.5, True),
        (-5.0, 5.6, False),
        (1.6, 2.05, True),
        (1.6, 2.2, False),
    ],
)
def test_harm_is_what_exceeds_the_tables_by_half_a_percent_and_two_percent(
    campaign: Campaign, tables: float, error: float, harmless: bool
) -> None:
    got = scored(campaign, table([(1000, tables)], [(1000, error)])).harm
    assert got is not None
    assert got.harmless_share == (100.0 if harmless else 0.0)


def test_harm_is_checked_window_by_window_whatever_the_order_of_the_rows(campaign: Campaign) -> None:
    data = table([(1000, 10), (2000, 0), (3000, 0)], [(1000, 9), (2000, 9), (3000, 1)]).iloc[::-1]
    got = scored(campaign, data).harm
    assert got is not None
    assert got.harmless_share == pytest.approx(100.0 * 2 / 3)


def test_below_300_rpm_the_worst_window_counts(campaign: Campaign) -> None:
    data = table([(50, 3), (-150, 3), (1000, 0)], [(50, -3.4), (-150, 4.2), (1000, 0)])
    got = scored(campaign, data).harm
    assert got is not None
    assert got.crawl_excess == pytest.approx(1.2)
    assert missed(campaign, data) == [b.what for b in bounds(campaign, scored(campaign, data)) if "above" in b.what] + [
        "below 300 rpm worse than the tables by"
    ]


GOOD = [(1000.0, 0.5), (8000.0, 0.5), (150.0, 3.0)]


def test_a_good_controller_meets_every_bound(campaign: Campaign) -> None:
    assert missed(campaign, table(GOOD, GOOD)) == []


@pytest.mark.parametrize(
    ("more", "what"),
    [
        ({"run_fault_word": 4}, "trips"),
        ({"oscillates": True}, "instabilities"),
        ({"run_finite": False}, "instabilities"),
        ({"run_psi_clamped": 17}, "cases with psi_clamped"),
    ],
)
def test_one_window_of_trouble_misses_its_bound(campaign: Campaign, more: dict[str, float], what: str) -> None:
    assert missed(campaign, table(GOOD, GOOD, **more)) == [what]


@pytest.mark.parametrize("error", [math.nan, 0.81])
def test_an_error_that_is_too_large_or_no_number_misses_the_bound(campaign: Campaign, error: float) -> None:
    assert "rms, 300 to 5000 rpm" in missed(campaign, table(GOOD, [(1000, error), *GOOD[1:]]))
