# SPDX-License-Identifier: Apache-2.0
"""The report's figures over speed and over the current plane: units, legends, contours that can be labelled."""

from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

from fluxtrue_tools.motor.loci_plots import loci_figure, round_speeds
from fluxtrue_tools.motor.measured import Measured
from fluxtrue_tools.motor.motor import load_motor
from fluxtrue_tools.motor.plots import figures
from fluxtrue_tools.motor.speed_plots import envelope_figure, losses_figure, power_unit, short_circuit_figure

DRAWN = (loci_figure, envelope_figure, losses_figure, short_circuit_figure)
FIRMWARE = Path(__file__).resolve().parents[3] / "firmware" / "motors"
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


def labels(figure: Figure) -> set[str]:
    return {text.get_text() for legend in figure.legends for text in legend.get_texts()}


def test_the_envelope_has_both_quadrants_with_and_without_the_limits_of_generating() -> None:
    figure = envelope_figure(load_motor(FIRMWARE / "hsm1"))
    lines = {line.get_label(): np.asarray(line.get_ydata()) for line in figure.axes[0].lines}
    driving = lines["also limited by torque_max_Nm"]
    assert driving.max() == pytest.approx(132.0) and driving.min() > 0.0
    # Braking, the drop adds to the voltage: less at no speed, 3 N·m more at 10,000 rpm.
    braking = [values for values in lines.values() if values.min() == pytest.approx(-132.0) and values[-1] < -66.0]
    assert any(values.shape == driving.shape and np.all(-values >= driving) for values in braking)
    limited = [values for name, values in lines.items() if "generating, battery takes at most" in str(name)]
    assert len(limited) == 2
    for values in limited:  # all torque where the machine is slow, less at speed
        assert values.min() == pytest.approx(-132.0, rel=0.01) and -132.0 < values[-1] < 0.0
    plt.close(figure)


def test_the_loci_are_named_with_their_contours() -> None:
    """A machine whose short-circuit current lies inside the circle has MTPV."""
    figure = loci_figure(load_motor(TESTED / "prius"))
    assert {"MTPA", "MTPV", "constant torque", "current limit i_max_A"} <= labels(figure)
    assert any(name.startswith("stored references, field weakening") for name in labels(figure))
    assert any(name.startswith("voltage limit at a speed, up to 13500 rpm") for name in labels(figure))
    plt.close(figure)


def test_the_losses_name_what_they_contain() -> None:
    figure = losses_figure(load_motor(FIRMWARE / "hsm1"))
    title = figure.get_suptitle()
    assert title.startswith("Losses contained: copper at 20 °C, iron, device drop of the inverter.")
    assert [axes.get_title() for axes in figure.axes[:2]] == ["efficiency, %", "losses, kW"]
    plt.close(figure)


@pytest.mark.parametrize("name", ["hsm1", "paper"])
def test_every_other_panel_has_a_title_with_its_unit_and_something_in_it(name: str) -> None:
    """Of the flux linkages, inductances and table errors; two constants have no panels of inductances."""
    motor = load_motor(FIRMWARE / name)
    drawn = figures(motor, Measured({}, {}, []))
    assert ("plot_inductances.png" in drawn) == (name == "hsm1") and "plot_steps.png" not in drawn
    for file in {"plot_flux.png", "plot_inductances.png", "plot_error.png"} & set(drawn):
        figure = drawn[file][1](motor)
        panels = [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]
        for axes in panels:
            assert axes.get_title().endswith((", mV·s", ", µV·s", ", µH", ", N·m")), axes.get_title()
            assert (axes.get_xlabel(), axes.get_ylabel()) == ("i_d, A", "i_q, A")
            assert axes.collections or "everywhere" in axes.texts[0].get_text()
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
