# SPDX-License-Identifier: Apache-2.0
"""The report's figures over speed and over the current plane: units, legends, contours that can be labelled."""

from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

from fluxtrue_tools.motor.loci_plots import loci_figure, round_speeds
from fluxtrue_tools.motor.motor import load_motor
from fluxtrue_tools.motor.speed_plots import envelope_figure, losses_figure, power_unit, short_circuit_figure

DRAWN = (loci_figure, envelope_figure, losses_figure, short_circuit_figure)
TESTED = Path(__file__).resolve().parents[2] / "motors"
UNITS = ("A", "N·m", "W", "kW", "rpm")


@pytest.mark.parametrize("draw", DRAWN)
def test_each_axis_has_a_unit_and_no_legend_covers_data(write: Callable[..., Path], draw: Callable) -> None:
    figure = draw(load_motor(write()))
    plots = [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]
    named = [text for axes in plots for text in (axes.get_xlabel(), axes.get_ylabel()) if text]
    assert len(named) >= 2 and all(text.partition("(")[0].strip().endswith(UNITS) for text in named), named
    assert all(axes.get_legend() is None for axes in plots)
    (legend,) = figure.legends
    assert all(text.get_text() for text in legend.get_texts())
    plt.close(figure)


@pytest.mark.parametrize(("name", "unit"), [("servo", "W"), ("truck", "kW")])
def test_a_small_machine_has_its_losses_in_watts(name: str, unit: str) -> None:
    figure = losses_figure(load_motor(TESTED / name))
    assert figure.axes[1].get_title() == f"losses, {unit}"
    plt.close(figure)


def test_power_is_in_kilowatts_from_two_on() -> None:
    assert power_unit(1999.0) == (1.0, "W")
    assert power_unit(2000.0) == (1e3, "kW")


@pytest.mark.parametrize(("low", "high"), [(4440.0, 4500.0), (3900.0, 4500.0), (100.0, 4500.0)])
def test_voltage_limits_are_so_far_apart_that_they_can_be_labelled(low: float, high: float) -> None:
    speeds = round_speeds(low, high, 180.0)
    assert speeds[-1] == high and np.all(np.diff(speeds) >= 180.0) and np.all(speeds >= low)
    assert len(speeds) == 1 or low < 4440.0
    assert len(speeds) <= 8
