# SPDX-License-Identifier: Apache-2.0
"""The demonstration as a terminal table and as one self-contained HTML page."""

import base64
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import jinja2

from fluxtrue_tools.demo import figures, paper, realtime
from fluxtrue_tools.demo.all import Demonstration
from fluxtrue_tools.demo.experiment import Bound, Result

LOST, OPEN, CLOSED = "#edae49", "#d1495b", "#6a994e"


@dataclass(frozen=True)
class Row:
    """One line of the table of promises."""

    experiment: str
    what: str
    value: str
    allowed: str
    met: bool


def _row(experiment: str, bound: Bound, what: str | None = None) -> Row:
    relation = "≥" if bound.at_least else "≤"
    sign = "" if bound.at_least else "|…| "
    return Row(
        experiment,
        what or bound.what,
        f"{bound.value:.4g} {bound.unit}",
        f"{sign}{relation} {bound.limit:g} {bound.unit}",
        bound.met,
    )


def _worst(result: Result) -> Row:
    """Of many points the one with the smallest margin to its bound."""
    worst = max(result.bounds, key=lambda bound: abs(bound.value) / bound.limit)
    return _row(result.name, worst, f"worst of {len(result.bounds)}: {worst.what}")


def rows(demonstration: Demonstration) -> list[Row]:
    """The table of promises."""
    table = []
    for result in demonstration.results:
        many = len(result.bounds) > 4
        table += [_worst(result)] if many else [_row(result.name, b) for b in result.bounds]
    return [*table, _row("realtime_factor", demonstration.realtime)]


def terminal(demonstration: Demonstration) -> str:
    """The table as plain text."""
    cells = [("experiment", "figure of merit", "simulated", "allowed", "")]
    cells += [(r.experiment, r.what, r.value, r.allowed, "met" if r.met else "MISSED") for r in rows(demonstration)]
    widths = [max(len(line[k]) for line in cells) for k in range(5)]
    lines = ["  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)).rstrip() for line in cells]
    lines.insert(1, "  ".join("-" * width for width in widths[:4]))
    return "\n".join([*lines, "", _grid_line(demonstration), _realtime(demonstration)])


def _result(demonstration: Demonstration, name: str) -> Result:
    return next(r for r in demonstration.results if r.name == name)


def _grid_line(demonstration: Demonstration) -> str:
    points = _result(demonstration, "hsm1-grid").summary["points"]
    opened = [abs(p["torque_error_open_percent"]) for p in points]
    closed = [abs(p["torque_error_closed_percent"]) for p in points]
    return (
        f"{len(points)} operating points of the measured machine, magnets 15 % weaker: "
        f"|torque error| {min(opened):.1f} … {max(opened):.1f} % with tables alone, "
        f"at most {max(closed):.2f} % with the torque loop closed."
    )


def _realtime(demonstration: Demonstration) -> str:
    return (
        f"Simulation at {demonstration.realtime_factor:.3g} times real time on one core (measured flux map, "
        f"every imperfection on, {realtime.SIMULATED_S:g} s simulated); motulator's PMSM drive (constant "
        f"inductances, no imperfections) in the same run: {demonstration.motulator_realtime_factor:.2g} times."
    )


def _image(svg: str) -> str:
    return "data:image/svg+xml;base64," + base64.b64encode(svg.encode()).decode()


def _figures(demonstration: Demonstration) -> dict[str, str]:
    assert demonstration.story is not None
    gains = [_result(demonstration, f"paper-fig3-4 {name}") for name in paper.GAIN_SETS]
    weak = [(0.2, 0.5, "magnets weaken", LOST), (0.5, 0.8, "tables alone", OPEN)]
    drawn = {
        "story": figures.story(demonstration.story, [*weak, (0.8, 1.6, "torque loop closed", CLOSED)]),
        "gains": figures.gain_sets(gains),
        "fig7": figures.fig7(_result(demonstration, "paper-fig7").runs["fig7"]),
        "fig8": figures.story(
            _result(demonstration, "paper-fig8").runs["fig8"],
            [(0.3, 0.7, "magnet weaker, tables alone", OPEN), (0.7, 1.2, "torque loop closed", CLOSED)],
        ),
        "grid": figures.grid(_result(demonstration, "hsm1-grid").summary["points"]),
        "twin": figures.twin(_result(demonstration, "twin").summary["points"]),
        "steps": figures.steps(_result(demonstration, "torque-step")),
    }
    return {name: _image(svg) for name, svg in drawn.items()}


def _headline(demonstration: Demonstration) -> str:
    run = demonstration.story
    assert run is not None
    requested = run.mean("torque_requested_Nm", (0.9, 1.6))
    lost = run.mean("true_torque_Nm", (0.65, 0.8))
    back = run.mean("true_torque_Nm", (1.3, 1.6))
    return (
        f"A measured traction machine at 3000 rpm is asked for {requested:.0f} N·m. Its magnets lose 15 % of their "
        f"flux: the shaft gets {lost:.1f} N·m ({100 * (lost / requested - 1):+.1f} %). At 0.8 s the firmware starts "
        f"to identify the flux and closes its torque loop: {back:.2f} N·m ({100 * (back / requested - 1):+.2f} %)."
    )


def html(demonstration: Demonstration) -> str:
    """The page, with its figures inside."""
    template = files("fluxtrue_tools.demo").joinpath("report.html.j2").read_text(encoding="utf-8")
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    points: list[dict[str, Any]] = _result(demonstration, "hsm1-grid").summary["points"]
    missed = demonstration.missed()
    gains = [
        f"{name} {g['flux_bandwidth_rad_s']:g} and {g['resistance_bandwidth_rad_s']:g} rad/s"
        for name, g in paper.GAIN_SETS.items()
    ]
    return environment.from_string(template).render(
        headline=_headline(demonstration),
        figures=_figures(demonstration),
        rows=rows(demonstration),
        missed=missed,
        verdict=f"{len(missed)} missed: {'; '.join(missed)}" if missed else "Every one is kept.",
        paper_rpm=f"{paper.SPEED_RPM:g}",
        gain_text=", ".join(gains),
        fig8=_result(demonstration, "paper-fig8").summary,
        grid_keys=list(points[0]),
        grid_points=points,
        realtime=_realtime(demonstration),
    )
