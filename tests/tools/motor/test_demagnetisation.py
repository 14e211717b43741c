# SPDX-License-Identifier: Apache-2.0
"""The demagnetisation limit in the report: contours over the current plane and lines of text."""

from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fluxtrue_tools.motor.demagnetisation import demagnetisation_lines, hottest_C, limit_A, withstands_C
from fluxtrue_tools.motor.loci_plots import demagnetisation_limits, loci_figure
from fluxtrue_tools.motor.motor import load_motor

Write = Callable[..., Path]
# 280 A at 20 °C, 215 A at 150 °C: inside the circle of 250 A from 80 °C on.
MAGNETS = {"i_d_demag_A": 280.0, "i_d_demag_A_per_K": 0.5}


def places(axes: Axes, width: float | None = None) -> list[float]:
    """i_d of the dash-dotted contours: each is a straight line parallel to the q axis."""
    found = []
    for lines in axes.collections:
        for path, lw in zip(lines.get_paths(), lines.get_linewidths(), strict=False):
            dashed = lines.get_linestyles()[0][1] is not None
            if dashed and len(path.vertices) and (width is None or lw == width):
                i_d = path.vertices[:, 0]
                assert i_d.max() - i_d.min() < 1e-6
                found.append(float(i_d[0]))
    return sorted(found)


def legend(figure: Figure) -> str:
    return "\n".join(text.get_text() for text in figure.legends[0].get_texts())


def test_the_limit_falls_along_a_straight_line_and_never_below_zero(write: Write) -> None:
    config = load_motor(write(magnet=MAGNETS)).config
    assert [limit_A(config, c) for c in (20.0, 80.0, 150.0)] == pytest.approx([280.0, 250.0, 215.0])
    assert limit_A(config, 1000.0) == 0.0
    assert withstands_C(config, 250.0) == pytest.approx(80.0)
    assert hottest_C(config) == 180.0  # the winding's trip lies above the assumed 150 °C


def test_the_contours_are_where_the_firmware_limits_i_d(write: Write) -> None:
    """Of the temperatures from 80 to 180 °C; the assumed one is thick. 250 A is the circle itself."""
    motor = load_motor(write(magnet=MAGNETS))
    limits = demagnetisation_limits(motor.config)
    assert limits[215.0] == "150 °C" and limits[200.0] == "180 °C"
    assert min(limits) == 200.0 and max(limits) < 250.0 and len(limits) >= 5
    figure = loci_figure(motor)
    assert places(figure.axes[0]) == pytest.approx(sorted(-x for x in limits))
    assert places(figure.axes[0], 2.0) == pytest.approx([-215.0])
    assert "demagnetisation limit of i_d at a magnet temperature" in legend(figure)
    plt.close(figure)


def test_an_assumed_temperature_of_20_degrees_has_its_contour_where_the_limit_lies_inside_the_circle(
    write: Write,
) -> None:
    magnets = {"i_d_demag_A": 200.0, "i_d_demag_A_per_K": 0.5, "assumed_C": 20.0}
    assert demagnetisation_limits(load_motor(write(magnet=magnets)).config)[200.0] == "20 °C"


def test_without_a_coefficient_there_is_one_contour(write: Write) -> None:
    motor = load_motor(write(magnet={"i_d_demag_A": 200.0}))
    figure = loci_figure(motor)
    assert demagnetisation_limits(motor.config) == {200.0: "any temperature"}
    assert places(figure.axes[0]) == pytest.approx([-200.0])
    plt.close(figure)


@pytest.mark.parametrize("magnet", [{}, {"i_d_demag_A": 600.0, "i_d_demag_A_per_K": 1.5}, {"i_d_demag_A": 250.0}])
def test_without_a_limit_inside_the_circle_there_is_no_contour(write: Write, magnet: dict[str, float]) -> None:
    figure = loci_figure(load_motor(write(magnet=magnet)))
    assert places(figure.axes[0]) == []
    said = "not within i_max_A up to 180 °C" in legend(figure)
    assert said == bool(magnet) and ("demagnetisation" in legend(figure)) == said
    plt.close(figure)


def test_a_limit_that_hot_magnets_do_not_have_at_all_ends_at_zero(write: Write) -> None:
    """300 A less 3 A/K: nothing is left at 120 °C, so no contour is hotter."""
    limits = demagnetisation_limits(load_motor(write(magnet={"i_d_demag_A": 300.0, "i_d_demag_A_per_K": 3.0})).config)
    assert 100.0 <= max(float(name.split()[0]) for name in limits.values()) <= 120.0


def test_the_text_says_how_much_is_left(write: Write) -> None:
    text = "\n".join(demagnetisation_lines(load_motor(write(magnet=MAGNETS)).config))
    assert "i_d from -280 A at 20 °C, 0.5 A less per K" in text
    assert "magnets at 150 °C   -215 A" in text and "magnets at 180 °C   -200 A" in text
    assert "withstood up to 80 °C" in text
    text = "\n".join(demagnetisation_lines(load_motor(write()).config))
    assert text == "demagnetisation limit: magnet.i_d_demag_A is not given, only i_max_A limits i_d"
