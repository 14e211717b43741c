# SPDX-License-Identifier: Apache-2.0
"""report.html and its plots."""

from html import escape
from pathlib import Path

from fluxtrue_tools.motor.loop_report import measured_text
from fluxtrue_tools.motor.measured import Measured, measure_loop
from fluxtrue_tools.motor.motor import Motor
from fluxtrue_tools.motor.names import HTML, TEXT

STYLE = (
    "body{font:15px/1.45 sans-serif;max-width:70em;margin:2em auto;padding:0 1em}"
    "pre{overflow:auto;background:#f4f4f4;padding:1em}img{max-width:100%}"
)


def write_plots(motor: Motor, measured: Measured, folder: Path) -> dict[str, str]:
    """All figures as PNG; their titles by file name."""
    import matplotlib.pyplot as plt

    from fluxtrue_tools.motor.plots import figures

    drawn = figures(motor, measured)
    for name, (_, draw) in drawn.items():
        figure = draw(motor)
        figure.savefig(folder / name, dpi=100, metadata={"Software": None})
        plt.close(figure)
    return {name: title for name, (title, _) in drawn.items()}


def write_report(motor: Motor, text: str, folder: Path) -> list[str]:
    """Plots, the page that shows them, and the text with what has been measured; the names of the files."""
    found = measure_loop(motor)
    titles = write_plots(motor, found, folder)
    text += measured_text(motor, found)
    name = escape(motor.config.machine.name)
    figures = "\n".join(
        f'<h2>{escape(title)}</h2>\n<img src="{file}" alt="{escape(title)}">' for file, title in titles.items()
    )
    page = (
        f'<!doctype html>\n<html lang="en"><meta charset="utf-8"><title>Motor {name}</title>'
        f"<style>{STYLE}</style>\n<h1>Motor {name}</h1>\n<pre>{escape(text)}</pre>\n{figures}\n</html>\n"
    )
    (folder / HTML).write_text(page, encoding="utf-8")
    (folder / TEXT).write_text(text, encoding="utf-8")
    return [HTML, *titles]
