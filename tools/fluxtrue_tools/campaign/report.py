# SPDX-License-Identifier: Apache-2.0
"""The campaign as one self-contained HTML page and as summary.json."""

import base64
from dataclasses import asdict
from importlib.resources import files
from typing import Any, Final

import jinja2
import pandas as pd

from fluxtrue_tools import faults
from fluxtrue_tools.campaign import figures
from fluxtrue_tools.campaign.score import BANDS, CRAWL, Score, band_of
from fluxtrue_tools.campaign.spec import Campaign, Nominal
from fluxtrue_tools.campaign.terminal import band_name
from fluxtrue_tools.demo.experiment import Bound, number

WORST: Final = 10


def worst_cases(table: pd.DataFrame, controller: str, command: str) -> list[dict[str, Any]]:
    """The ten cases with the largest error of a controller, each with what reproduces it."""
    rows = table[(table["controller"] == controller) & (table["band"] != CRAWL)]
    worst = rows.loc[rows["error_percent"].abs().groupby(rows["case"]).idxmax()]
    worst = worst.reindex(worst["error_percent"].abs().sort_values(ascending=False).index).head(WORST)
    return [
        {
            "case": int(row["case"]),
            "error_percent": float(row["error_percent"]),
            "speed_rpm": float(row["speed_rpm"]),
            "torque_requested_Nm": float(row["torque_requested_Nm"]),
            "faults": ", ".join(faults.named(int(row["run_fault_word"]))) or "none",
            "voltage_limited": float(row["voltage_limited"]),
            "command": command.format(case=int(row["case"])),
        }
        for _, row in worst.iterrows()
    ]


def _image(svg: str) -> str:
    return "data:image/svg+xml;base64," + base64.b64encode(svg.encode()).decode()


def summary(campaign: Campaign, table: pd.DataFrame, scores: list[Score],
            promised: list[tuple[str, Bound]]) -> dict[str, Any]:  # fmt: skip
    """The summary for scripts; null where there is no figure."""

    def plain(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: plain(item) for key, item in value.items()}
        return (None if value != value else number(value)) if isinstance(value, float) else value

    return {
        "motor": campaign.motor,
        "seed": campaign.seed,
        "cases": int(table["case"].nunique()),
        "digest": campaign.digest(),
        "controllers": [
            plain(asdict(s)) | {"ratio": {band: plain(f.ratio) for band, f in s.bands.items()}} for s in scores
        ],
        "bounds": [{"controller": name, "what": b.what, "value": plain(float(b.value)), "limit": b.limit,
                    "at_least": b.at_least, "unit": b.unit, "met": b.met} for name, b in promised],
    }  # fmt: skip


def html(campaign: Campaign, table: pd.DataFrame, scores: list[Score], promised: list[tuple[str, Bound]],
         nominal: Nominal, command: str) -> str:  # fmt: skip
    """The page, with its figures inside."""
    table = table.assign(band=band_of(table["speed_rpm"], campaign.check))
    shown = campaign.check.controllers or [c.name for c in campaign.controller if c.warm_up]
    template = files("fluxtrue_tools.campaign").joinpath("report.html.j2").read_text(encoding="utf-8")
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    missed = [f"{name}: {bound.text()}" for name, bound in promised if not bound.met]
    drawn = {"maps": figures.maps, "over_speed": figures.over_speed, "histograms": figures.histograms}
    return environment.from_string(template).render(
        campaign=campaign,
        cases=table["case"].nunique(),
        windows=len(table.drop_duplicates(["case", "window"])),
        scores=scores,
        bands={band: band_name(campaign, band) for band in (*BANDS, CRAWL)},
        promised=promised,
        missed=missed,
        figures={name: _image(draw(campaign, table)) for name, draw in drawn.items()},
        worst={name: worst_cases(table, name, command) for name in shown},
        spread=campaign.spread.model_dump(),
        nominal=nominal.model_dump(),
    )
