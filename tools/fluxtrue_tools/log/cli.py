# SPDX-License-Identifier: Apache-2.0
"""`tools/fluxtrue log`: what a recorded drive holds."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

import click
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from fluxtrue_tools import kinds, paths
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.log.decode import signals_of
from fluxtrue_tools.sim.plot import COMMAND, ESTIMATE, SECOND, STYLE, TRUTH

Signals = dict[str, pd.Series]
# Title of a plot; signal, label and style of its lines.
BACK: Final = {"color": COMMAND, "linestyle": "--"}
PANELS: Final[tuple[tuple[str, dict[str, tuple[str, dict[str, str]]]], ...]] = (
    ("Torque", {"INV_Status.TorqueCommanded": ("commanded", BACK), "INV_Status.TorqueEstimated": ("estimated", {})}),
    ("Currents", {"INV_Currents.IdRef": ("i_d*", BACK), "INV_Currents.IqRef": ("i_q*", BACK | {"linestyle": ":"}),
                  "INV_Currents.Id": ("i_d", {"color": TRUTH}), "INV_Currents.Iq": ("i_q", {"color": SECOND})}),
    ("Identified magnet flux", {"INV_Identification.PsiF": ("ψ̂", {})}),
    ("Identified resistance", {"INV_Identification.Resistance": ("R̂", {})}),
    ("Speed", {"INV_Status.Speed": ("speed", {"color": TRUTH})}),
)  # fmt: skip
UNITS: Final = {"Nm": "N·m", "mOhm": "mΩ"}  # the DBC is ASCII
STATE: Final = "INV_Status.State"
GAP_S: Final = 1.0  # a gap of this length was not recorded, so that no line is drawn across it
EXPORTS: Final[dict[str, Callable[[pd.DataFrame, Path], None]]] = {
    ".csv": lambda table, path: table.to_csv(path, index_label="time_s"),
    ".parquet": lambda table, path: table.to_parquet(path),
}


def _wanted(signals: Signals, names: tuple[str, ...]) -> Signals:
    missing = [name for name in names if name not in signals]
    if missing:
        raise FluxtrueError(f"--signal {missing[0]}: not in this file, allowed: {', '.join(signals)}")
    return {name: signals[name] for name in names} if names else signals


def _table(signals: Signals) -> pd.DataFrame:
    """One row per time stamp; a signal keeps its value until its next frame."""
    series = [values[~values.index.duplicated(keep="last")].rename(name) for name, values in signals.items()]
    return pd.concat(series, axis=1).sort_index().ffill()


def _line(values: pd.Series) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of a line, interrupted where nothing was recorded."""
    times, numbers = values.index.to_numpy(dtype=float), values.to_numpy(dtype=float)
    gaps = np.flatnonzero(np.diff(times) > GAP_S) + 1
    return np.insert(times, gaps, times[gaps - 1]), np.insert(numbers, gaps, np.nan)


def _draw_panel(axis: Axes, signals: Signals, title: str, lines: dict[str, tuple[str, dict[str, str]]]) -> None:
    axis.set_title(title, loc="left")
    axis.ticklabel_format(axis="y", useOffset=False)
    for name, (label, look) in lines.items():
        if name in signals:
            axis.plot(*_line(signals[name]), label=label, **{"color": ESTIMATE, "linewidth": "1.0", **look})
            axis.set_ylabel(
                f"{title.rsplit(maxsplit=1)[-1].lower()}, {UNITS.get(unit := signals[name].attrs['unit'], unit)}"
            )
    if axis.get_legend_handles_labels()[0]:
        axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    else:
        axis.text(0.5, 0.5, "not in this file", transform=axis.transAxes, ha="center", color=COMMAND)


def _draw_state(axis: Axes, signals: Signals) -> None:
    axis.set_title("State", loc="left")
    axis.set_ylabel("state")
    if STATE in signals:
        axis.plot(*_line(signals[STATE]), color=TRUTH, drawstyle="steps-post", linewidth=1.0)
        choices = signals[STATE].attrs["choices"]
        seen = sorted({int(value) for value in signals[STATE].unique()})
        axis.set_yticks(seen, [str(choices.get(value, value)).replace("_", " ") for value in seen])


def _draw(signals: Signals, path: Path, title: str) -> None:
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(len(PANELS) + 1, 1, sharex=True, figsize=(11.0, 13.0), layout="constrained")
        for axis, (name, lines) in zip(axes[:-1], PANELS, strict=True):
            _draw_panel(axis, signals, name, lines)
        _draw_state(axes[-1], signals)
        axes[-1].set_xlabel("time, s")
        figure.suptitle(title)
        figure.savefig(path, dpi=120)
        plt.close(figure)


def _tell(signals: Signals) -> None:
    width = max(len(name) for name in signals)
    click.echo(f"{'signal':<{width}}  {'samples':>8}  {'lowest':>11}  {'highest':>11}  {'last':>11}  unit")
    for name, values in signals.items():
        numbers = pd.to_numeric(values, errors="coerce")
        click.echo(f"{name:<{width}}  {len(values):>8}  {numbers.min():>11.5g}  {numbers.max():>11.5g}  "
                   f"{numbers.iloc[-1]:>11.5g}  {values.attrs['unit']}".rstrip())  # fmt: skip


@click.command(cls=paths.Command)
@click.argument("file", type=paths.InputFile())
@click.option("--plot", type=paths.OutputFile(*paths.PICTURES), help="Draw torque, currents, what was "
              "identified and speed: PNG, SVG or PDF.")  # fmt: skip
@click.option("--export", type=paths.OutputFile(*EXPORTS), help="Write the signals: CSV or Parquet.")
@click.option("--signal", "names", type=kinds.Text(), multiple=True, metavar="MESSAGE.SIGNAL",
              help="Tell and export only these.")  # fmt: skip
def log(file: Path, plot: Path | None, export: Path | None, names: tuple[str, ...]) -> None:
    """Decode a recorded drive (MDF4): signals with their ranges; plot and export on request."""
    with paths.outputs() as outputs:
        every = signals_of(file)
        chosen = _wanted(every, names)
        if plot is not None:
            _draw(every, outputs.scratch(plot), file.name)
        if export is not None:
            EXPORTS[export.suffix.lower()](_table(chosen), outputs.scratch(export))
    _tell(chosen)
