# SPDX-License-Identifier: Apache-2.0
"""`tools/fluxtrue log`: what a recorded drive holds."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

import click
import matplotlib.pyplot as plt
import pandas as pd

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.log.decode import signals_of

Signals = dict[str, pd.Series]
# Title, unit, and what is drawn under which name.
PANELS: Final = (
    ("Torque", "N·m", {"INV_Status.TorqueCommand": "command", "INV_Status.TorqueEstimate": "estimate"}),
    ("Currents", "A", {"INV_Currents.Id": "i_d", "INV_Currents.Iq": "i_q"}),
    ("Identified magnet flux", "mVs", {"INV_Identification.PsiF": "ψ̂"}),
    ("Identified resistance", "mΩ", {"INV_Identification.Resistance": "R̂"}),
    ("Speed", "rpm", {"INV_Status.Speed": "speed"}),
)
EXPORTS: Final[dict[str, Callable[[pd.DataFrame, Path], None]]] = {
    ".csv": lambda table, path: table.to_csv(path, index_label="time_s"),
    ".parquet": lambda table, path: table.to_parquet(path),
}
PICTURES: Final = (".png", ".svg", ".pdf")


def _wanted(signals: Signals, names: tuple[str, ...]) -> Signals:
    missing = [name for name in names if name not in signals]
    if missing:
        raise FluxtrueError(f"--signal {missing[0]}: not in this file, allowed: {', '.join(signals)}")
    return {name: signals[name] for name in names} if names else signals


def _table(signals: Signals) -> pd.DataFrame:
    """One row per instant at which anything was said; a signal keeps its value until it is said anew."""
    series = [values[~values.index.duplicated(keep="last")].rename(name) for name, values in signals.items()]
    return pd.concat(series, axis=1).sort_index().ffill()


def _draw(signals: Signals, path: Path, title: str) -> None:
    figure, axes = plt.subplots(len(PANELS), 1, sharex=True, figsize=(10.0, 11.0), layout="constrained")
    for axis, (name, unit, lines) in zip(axes, PANELS, strict=True):
        for signal, label in lines.items():
            if signal in signals:
                axis.plot(signals[signal].index, signals[signal].to_numpy(), label=label, linewidth=1.0)
        axis.set_title(name, loc="left", fontsize=10)
        axis.set_ylabel(unit)
        axis.grid(alpha=0.3)
        if axis.get_legend_handles_labels()[0]:
            axis.legend(loc="upper right", fontsize=8)
    axes[-1].set_xlabel("time, s")
    figure.suptitle(title)
    figure.savefig(path)
    plt.close(figure)


def _tell(signals: Signals) -> None:
    width = max(len(name) for name in signals)
    click.echo(f"{'signal':<{width}}  {'samples':>8}  {'lowest':>11}  {'highest':>11}  {'last':>11}")
    for name, values in signals.items():
        numbers = pd.to_numeric(values, errors="coerce")
        click.echo(f"{name:<{width}}  {len(values):>8}  {numbers.min():>11.5g}  {numbers.max():>11.5g}  "
                   f"{numbers.iloc[-1]:>11.5g}")  # fmt: skip


def _suffix(option: str, path: Path | None, allowed: tuple[str, ...]) -> None:
    if path is not None and path.suffix not in allowed:
        raise FluxtrueError(f"{option} {path}: allowed: a name ending in {', '.join(allowed)}")
    if path is not None and not path.parent.is_dir():
        raise FluxtrueError(f"{option} {path}: {path.parent} is not a folder")


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--plot", type=click.Path(dir_okay=False, path_type=Path), help="Draw torque, currents, what was "
              "identified and speed: PNG, SVG or PDF.")  # fmt: skip
@click.option("--export", type=click.Path(dir_okay=False, path_type=Path), help="Write the signals: CSV or Parquet.")
@click.option("--signal", "names", multiple=True, metavar="MESSAGE.SIGNAL", help="Tell and export only these.")
def log(file: Path, plot: Path | None, export: Path | None, names: tuple[str, ...]) -> None:
    """Decode a recorded drive (MDF4): signals with their ranges; plot and export on request."""
    _suffix("--plot", plot, PICTURES)
    _suffix("--export", export, tuple(EXPORTS))
    every = signals_of(file)
    chosen = _wanted(every, names)
    _tell(chosen)
    if plot is not None:
        _draw(every, plot, file.name)
    if export is not None:
        EXPORTS[export.suffix](_table(chosen), export)
