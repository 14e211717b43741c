# SPDX-License-Identifier: Apache-2.0
"""A campaign's outcome as text."""

import math

import pandas as pd

from fluxtrue_tools import faults
from fluxtrue_tools.campaign.score import BANDS, CRAWL, Score, bounds
from fluxtrue_tools.campaign.spec import Campaign
from fluxtrue_tools.demo.experiment import Bound


def columns(cells: list[tuple[str, ...]]) -> str:
    """A table with its head underlined."""
    widths = [max(len(line[k]) for line in cells) for k in range(len(cells[0]))]
    lines = ["  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)).rstrip() for line in cells]
    return "\n".join([lines[0], "  ".join("-" * width for width in widths), *lines[1:]])


def _figure(value: float) -> str:
    """Two digits; a dash where there is nothing to state, such as the bound of a controller that identifies nothing."""
    return f"{value:.2f}" if math.isfinite(value) else "-"


def band_name(campaign: Campaign, band: str) -> str:
    """The name of a band in words."""
    crawl, split = campaign.check.crawl_rpm, campaign.check.band_rpm
    names = {"low": f"{crawl:g}…{split:g} rpm", "high": f"above {split:g} rpm", CRAWL: f"below {crawl:g} rpm"}
    return names[band]


def figures_table(campaign: Campaign, scores: list[Score]) -> str:
    """Torque errors of every controller and band."""
    cells: list[tuple[str, ...]] = [("controller", "band", "windows", "rms %", "p99 %", "worst %", "bound %", "ratio")]
    for scored in scores:
        for band in (*BANDS, CRAWL):
            f = scored.bands[band]
            cells.append((scored.controller, band_name(campaign, band), str(f.windows),
                          *map(_figure, (f.rms, f.p99, f.worst, f.bound_rms, f.ratio))))  # fmt: skip
    return columns(cells)


def trouble_table(campaign: Campaign, scores: list[Score]) -> str:
    """Harm, trips, saturation."""
    cells: list[tuple[str, ...]] = [("controller", "no harm %", "crawl worse by", "trips", "unstable",
                                     *campaign.check.count_nonzero)]  # fmt: skip
    for scored in scores:
        t = scored.trouble
        harm = ("-", "-")
        if scored.harm is not None:
            harm = (f"{scored.harm.harmless_share:.2f}", f"{scored.harm.crawl_excess:+.2f} %")
        cells.append((scored.controller, *harm, str(t.trips), str(t.unstable), *map(str, t.saturated.values())))
    return columns(cells)


def bounds_table(promised: list[tuple[str, Bound]]) -> str:
    """Every bound of the checked controllers, met or missed."""
    cells: list[tuple[str, ...]] = [("controller", "figure of merit", "simulated", "allowed", "")]
    for name, bound in promised:
        relation = "≥" if bound.at_least else "≤"
        cells.append((name, bound.what, f"{bound.value:.4g} {bound.unit}", f"{relation} {bound.limit:g} {bound.unit}",
                      "met" if bound.met else "MISSED"))  # fmt: skip
    return columns(cells)


def promises(campaign: Campaign, scores: list[Score]) -> list[tuple[str, Bound]]:
    """The bounds of the checked controllers."""
    checked = campaign.check.controllers
    return [(s.controller, bound) for s in scores if s.controller in checked for bound in bounds(campaign, s)]


def case_table(table: pd.DataFrame) -> str:
    """One case: its plant, then every window with the controllers that run in it side by side, in ten digits for exact
    comparison."""
    first = table.iloc[0]
    plant = "\n".join(f"{name.removeprefix('plant_')} = {first[name]:.10g}"
                      for name in table.columns if name.startswith("plant_"))  # fmt: skip
    names = list(table["controller"].unique())
    cells: list[tuple[str, ...]] = [("window", "rpm", "requested N·m", *(f"{name} N·m" for name in names),
                                     *(f"{name} %" for name in names), "bound %")]  # fmt: skip
    for window, rows in table.set_index("controller").groupby("window"):
        bound = rows["bound_percent"].max()
        cells.append((str(window), f"{rows['speed_rpm'].iloc[0]:.1f}", f"{rows['torque_requested_Nm'].iloc[0]:.3f}",
                      *(f"{rows['torque_Nm'][name]:.10g}" for name in names),
                      *(f"{rows['error_percent'][name]:+.2f}" for name in names), _figure(bound)))  # fmt: skip
    words = table.groupby("controller", sort=False)["run_fault_word"].first()
    said = [f"{name}: {', '.join(faults.named(int(word)))}" for name, word in words.items() if word]
    tripped = "; ".join(said) or "no trip"
    return f"{plant}\n\n{columns(cells)}\n\n{tripped}"
