# SPDX-License-Identifier: Apache-2.0
"""A capture as CSV, as MDF4, and drawn."""

from pathlib import Path
from typing import Final

import matplotlib.pyplot as plt
import numpy as np
from asammdf import MDF, Signal

from fluxtrue_tools.scope.scope import Capture
from fluxtrue_tools.sim.plot import COMMAND, STYLE, TRUTH

SHOWN: Final = {"deg": "°", "Nm": "N·m", "Vs": "Vs"}


def write_csv(capture: Capture, path: Path) -> None:
    """One row for each sample; the trigger's has the time 0."""
    table = np.column_stack([capture.time_s, *capture.columns.values()])
    header = ",".join(["time_s", *capture.columns])
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.9g")


def write_mdf(capture: Capture, path: Path) -> None:
    """One group of channels; their time begins at the first sample, the comment says when the trigger came."""
    times = capture.time_s - capture.time_s[0]
    channels = [Signal(samples=column, timestamps=times, name=name, unit=capture.units[name],
                       comment=capture.texts[name]) for name, column in capture.columns.items()]  # fmt: skip
    with MDF(version="4.10") as mdf:
        warning = f"; {capture.warning}" if capture.warning else ""
        mdf.append(channels, comment=f"trigger at {times[capture.trigger]:.6f} s{warning}")
        mdf.save(path, overwrite=True, compression=2)


def draw(capture: Capture, path: Path, title: str) -> None:
    """One panel for each unit, with a line at the trigger."""
    panels: dict[str, list[str]] = {}
    for name, unit in capture.units.items():
        panels.setdefault(unit, []).append(name)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(len(panels), 1, sharex=True, squeeze=False, layout="constrained",
                                    figsize=(11.0, 1.0 + 2.2 * len(panels)))  # fmt: skip
        for axis, (unit, names) in zip(axes[:, 0], panels.items(), strict=True):
            for k, name in enumerate(names):
                axis.plot(1e3 * capture.time_s, capture.columns[name], linewidth=1.0, label=name,
                          color=TRUTH if k == 0 else None)  # fmt: skip
            axis.axvline(0.0, color=COMMAND, linestyle="--", linewidth=1.0)
            axis.set_ylabel(SHOWN.get(unit, unit))
            axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        axes[-1, 0].set_xlabel("time from the trigger, ms")
        figure.suptitle(title)
        figure.savefig(path, dpi=120)
        plt.close(figure)
