# SPDX-License-Identifier: Apache-2.0
"""report.html and its plots."""

from html import escape
from pathlib import Path

from fluxtrue_tools.motor.motor import Motor

STYLE = (
    "body{font:15px/1.45 sans-serif;max-width:70em;margin:2em auto;padding:0 1em}"
    "pre{overflow:auto;background:#f4f4f4;padding:1em}img{max-width:100%}"
)


def write_plots(motor: Motor, folder: Path) -> None:
    """All figures as PNG."""
    import matplotlib.pyplot as plt

    from fluxtrue_tools.motor.plots import FIGURES

    for name, (_, draw) in FIGURES.items():
        figure = draw(motor)
        figure.savefig(folder / name, dpi=100, metadata={"Software": None})
        plt.close(figure)


def write_report(motor: Motor, text: str, folder: Path) -> None:
    """Plots and the page that shows them."""
    from fluxtrue_tools.motor.plots import FIGURES

    write_plots(motor, folder)
    name = escape(motor.config.machine.name)
    figures = "\n".join(
        f'<h2>{escape(title)}</h2>\n<img src="{file}" alt="{escape(title)}">' for file, (title, _) in FIGURES.items()
    )
    page = (
        f'<!doctype html>\n<html lang="en"><meta charset="utf-8"><title>Motor {name}</title>'
        f"<style>{STYLE}</style>\n<h1>Motor {name}</h1>\n<pre>{escape(text)}</pre>\n{figures}\n</html>\n"
    )
    (folder / "report.html").write_text(page, encoding="utf-8")
