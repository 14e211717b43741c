# SPDX-License-Identifier: Apache-2.0
"""Errors into figures of merit and bounds."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from fluxtrue_tools.campaign.spec import Campaign, Check, Limits
from fluxtrue_tools.demo.experiment import Bound

LOW, HIGH, CRAWL = "low", "high", "crawl"
BANDS: Final = (LOW, HIGH)
ROUNDING_RPM: Final = 1e-3


def band_of(speed_rpm: pd.Series, check: Check) -> pd.Series:
    """Which bounds a window belongs to; below crawl_rpm only harm is evaluated."""
    speed = speed_rpm.abs()
    crawls = speed < check.crawl_rpm - ROUNDING_RPM
    return pd.Series(np.select([crawls, speed <= check.band_rpm], [CRAWL, LOW], HIGH), index=speed.index)


def rms(values: Sequence[float] | pd.Series) -> float:
    """NaN without values; NaN meets no bound."""
    array = np.asarray(values, dtype=float)
    return float(np.sqrt(np.mean(array**2))) if array.size else float("nan")


def p99(values: pd.Series) -> float:
    """99th percentile of the magnitude."""
    return float(np.percentile(np.abs(values), 99.0)) if len(values) else float("nan")


@dataclass(frozen=True)
class Figures:
    """One controller in one band."""

    windows: int
    rms: float
    p99: float
    worst: float
    bound_rms: float

    @property
    def ratio(self) -> float:
        """Error over its information bound."""
        return self.rms / self.bound_rms if self.bound_rms > 0.0 else float("nan")


def figures(rows: pd.DataFrame) -> Figures:
    """The figures of the windows of one controller and band."""
    error = rows["error_percent"]
    worst = float(error.abs().max()) if len(error) else float("nan")
    return Figures(len(rows), rms(error), p99(error), worst, rms(rows["bound_percent"]))


@dataclass(frozen=True)
class Harm:
    """One controller against the tables alone."""

    harmless_share: float  # percent of the windows from crawl_rpm on
    crawl_excess: float  # largest |error| - |tables' error| below, percentage points


def harm(rows: pd.DataFrame, reference: pd.DataFrame, limits: Limits) -> Harm:
    """Compare two controllers whose tables contain the same windows of the same cases."""
    both = rows.merge(reference[["case", "window", "error_percent"]], on=["case", "window"],
                      suffixes=("", "_reference"), validate="one_to_one")  # fmt: skip
    error, tables = both["error_percent"].abs(), both["error_percent_reference"].abs()
    crawl = both["band"] == CRAWL
    allowed = np.maximum(tables + limits.no_harm_slack, limits.no_harm_floor)
    harmless = (error <= allowed)[~crawl]
    excess = (error - tables)[crawl]
    return Harm(100.0 * float(harmless.mean()) if len(harmless) else float("nan"),
                float(excess.max()) if len(excess) else 0.0)  # fmt: skip


@dataclass(frozen=True)
class Trouble:
    """Trips and instabilities in cases and windows of one controller."""

    trips: int
    unstable: int
    saturated: dict[str, int]


def trouble(rows: pd.DataFrame, counted: Sequence[str]) -> Trouble:
    """A case trips when a fault bit was ever set; it is unstable with NaN, infinity or oscillating torque."""
    cases = rows.groupby("case")
    trips = int((cases["run_fault_word"].max() != 0).sum())
    unstable = int((~cases["run_finite"].min() | cases["oscillates"].max()).sum())
    return Trouble(trips, unstable, {name: int((cases[f"run_{name}"].max() > 0).sum()) for name in counted})


@dataclass(frozen=True)
class Score:
    """Everything about one controller."""

    controller: str
    bands: dict[str, Figures]
    harm: Harm | None
    trouble: Trouble


def score(campaign: Campaign, table: pd.DataFrame) -> list[Score]:
    """All controllers, in the campaign's order."""
    table = table.assign(band=band_of(table["speed_rpm"], campaign.check))
    reference = table[table["controller"] == campaign.check.reference]
    scores = []
    for controller in campaign.controller:
        rows = table[table["controller"] == controller.name]
        bands = {band: figures(rows[rows["band"] == band]) for band in (*BANDS, CRAWL)}
        against = None
        if len(reference) and controller.name != campaign.check.reference:
            against = harm(rows, reference, campaign.check.limits)
        scores.append(Score(controller.name, bands, against, trouble(rows, campaign.check.count_nonzero)))
    return scores


def bounds(campaign: Campaign, scored: Score) -> list[Bound]:
    """Bounds of a checked controller."""
    limits, crawl, split = campaign.check.limits, campaign.check.crawl_rpm, campaign.check.band_rpm
    low, high = scored.bands[LOW], scored.bands[HIGH]
    promised = []
    if low.windows:
        promised += [Bound(f"rms, {crawl:g} to {split:g} rpm", low.rms, limits.rms_low, "%"),
                     Bound(f"99th percentile, {crawl:g} to {split:g} rpm", low.p99, limits.p99_low, "%")]  # fmt: skip
    if high.windows:
        promised += [Bound(f"rms, above {split:g} rpm", high.rms, limits.rms_high, "%"),
                     Bound(f"99th percentile, above {split:g} rpm", high.p99, limits.p99_high, "%")]  # fmt: skip
    promised += [
        Bound("trips", scored.trouble.trips, 0.0, "cases"),
        Bound("instabilities", scored.trouble.unstable, 0.0, "cases"),
    ]
    if scored.harm is not None and (low.windows or high.windows):
        promised.append(
            Bound("windows without harm", scored.harm.harmless_share, limits.no_harm_share, "%", at_least=True)
        )
    if scored.harm is not None and scored.bands[CRAWL].windows:
        promised += [
            Bound(f"below {crawl:g} rpm worse than the tables by", max(0.0, scored.harm.crawl_excess),
                  limits.low_speed_slack, "%"),
        ]  # fmt: skip
    promised += [Bound(f"cases with {name}", n, 0.0, "cases") for name, n in scored.trouble.saturated.items()]
    return promised
