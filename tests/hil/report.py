# SPDX-License-Identifier: Apache-2.0
"""The HTML report: every test's outcome, figures of merit with their bounds, and a plot of every torque test."""

import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jinja2 import Environment
from numpy.typing import ArrayLike

from fluxtrue_tools.demo.experiment import Bound

TEMPLATE = Path(__file__).with_name("report.html.j2")
POINTS = 50  # measured point by point, and drawn as points
Line = tuple[str, ArrayLike, ArrayLike]


def _svg(title: str, axes: Sequence[tuple[str, Sequence[Line]]], x_label: str) -> str:
    import matplotlib.pyplot as plt  # imported here because it takes a second, which a run without plots saves

    from fluxtrue_tools.sim.plot import STYLE

    with plt.rc_context(STYLE | {"svg.hashsalt": title}):
        figure, rows = plt.subplots(
            len(axes), 1, figsize=(9, 1.0 + 2.2 * len(axes)), layout="constrained", squeeze=False, sharex=True
        )
        for row, (y_label, lines) in zip(rows[:, 0], axes, strict=True):
            for label, x, y in lines:
                few = {"marker": "o", "markersize": 3.5} if len(np.asarray(x)) <= POINTS else {}
                row.plot(x, y, label=label, lw=1.1, **few)
            row.set_ylabel(y_label)
            row.ticklabel_format(axis="y", useOffset=False)
            row.legend(loc="best", fontsize=8)
        rows[0, 0].set_title(title, loc="left")
        rows[-1, 0].set_xlabel(x_label)
        stream = io.StringIO()
        figure.savefig(stream, format="svg")
        plt.close(figure)
    return stream.getvalue().partition("<svg")[2]


@dataclass
class Figures:
    """Plots and figures of merit of one test."""

    name: str
    outcome: str = "not run"
    seconds: float = 0.0
    reason: str = ""
    bounds: list[Bound] = field(default_factory=list)
    plots: list[str] = field(default_factory=list)
    tables: list[tuple[str, list[str], list[list[str]]]] = field(default_factory=list)

    def plot(self, title: str, axes: Sequence[tuple[str, Sequence[Line]]], x_label: str = "time, s") -> None:
        """One axis per (label, lines); a line is (label, x, y)."""
        self.plots.append("<svg" + _svg(title, axes, x_label))

    def table(self, title: str, head: list[str], rows: list[list[Any]]) -> None:
        """Numbers with four digits."""
        shown = [[f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in row] for row in rows]
        self.tables.append((title, head, shown))

    def promise(self, what: str, value: float, limit: float, unit: str) -> None:
        """A figure of merit whose magnitude must not exceed the limit; otherwise the test fails at once."""
        bound = Bound(what, float(value), limit, unit)
        self.bounds.append(bound)
        assert bound.met, bound.text()


class Report:
    """The report of one session."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.about: dict[str, str] = {}  # what was tested, when, and over which interface
        self._tests: dict[str, Figures] = {}

    def figures(self, node: str) -> Figures:
        """A test's page."""
        name = node.rpartition("/")[2].replace(".py::", ": ").replace("test_", "").replace("_", " ")
        return self._tests.setdefault(node, Figures(name))

    def outcome(self, node: str, result: pytest.TestReport) -> None:
        """Record the outcome of a phase of a test; a failure in any phase is a failure of the test."""
        test = self.figures(node)
        test.seconds += result.duration
        if result.failed or (result.when == "call" and test.outcome != "failed") or result.skipped:
            test.outcome = result.outcome
        if result.skipped and isinstance(result.longrepr, tuple):
            test.reason = result.longrepr[2]
        elif result.failed:
            test.reason = str(getattr(result.longrepr, "reprcrash", "")).strip()

    def write(self) -> None:
        """report.html."""
        if not self._tests:
            return
        tests = list(self._tests.values())
        outcomes = [test.outcome for test in tests]
        counts = {outcome: outcomes.count(outcome) for outcome in ("passed", "failed", "skipped")}
        page = Environment(autoescape=True).from_string(TEMPLATE.read_text(encoding="utf-8"))
        self._folder.mkdir(parents=True, exist_ok=True)
        target = self._folder / "report.html"
        target.write_text(page.render(tests=tests, counts=counts, about=self.about), encoding="utf-8")
