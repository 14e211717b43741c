# SPDX-License-Identifier: Apache-2.0
"""The machines of tests/loop/campaign one after another: their campaigns and their steps, as a table of the page.

python -m fluxtrue_tools.campaign.machines                 all of them: about half an hour of one core
python -m fluxtrue_tools.campaign.machines prius truck     only these; the other rows of the page stay
"""

import json
import math
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import click

from fluxtrue_tools.campaign import spec
from fluxtrue_tools.campaign.machine import data_sheet
from fluxtrue_tools.campaign.steps import OVERSHOOT_MAX, Step, steps, worst
from fluxtrue_tools.cli import run_module
from fluxtrue_tools.outputs import write_text
from fluxtrue_tools.sim.build import prepare

ROOT: Final = Path(__file__).resolve().parents[3]
FILES: Final = ROOT / "tests" / "loop" / "campaign"
PAGE: Final = ROOT / "docs" / "howto" / "campaign.md"
MARKED: Final = re.compile(r"(<!-- machines -->\n(?:\|.*\n){2})((?:\|.*\n)*)(\n<!-- machines end -->\n)")
CASES: Final = 10
KINDS: Final = {
    "hsm1-500": "measured traction machine",
    "prius": "interior magnets, 2010",
    "leaf": "interior magnets, 2012",
    "pmasynrm": "reluctance with few magnets, traction",
    "pmsyrm": "reluctance with magnets, 5.5 kW",
    "ebike": "hub motor, 48 V",
    "spm_12V": "surface magnets, 12 V",
    "compressor": "surface magnets, 60,000 rpm",
    "servo": "servo, 5 A",
    "truck": "truck, 800 V",
    "saturated": "strong saturation",
    "linear": "hardly any saturation",
    "ipmsm_2kW": "interior magnets, 2.2 kW",
    "estun": "servo, 400 W",
    "anaheim": "surface magnets, 48 V",
    "teknic": "servo, 24 V",
    "hub": "hub motor, 8 pole pairs",
    "racing": "wheel motor, 20,000 rpm",
}
"""The machines of the page, by the names of their campaigns."""


@dataclass(frozen=True)
class Row:
    """What the page says about one machine."""

    name: str
    turn_rad: float  # of the field, per PWM period at top speed
    pwm_hz: float
    summary: dict[str, Any]
    largest: Step

    @property
    def met(self) -> bool:
        return all(bound["met"] for bound in self.summary["bounds"]) and self.largest.met

    def __str__(self) -> str:
        scored = next(s for s in self.summary["controllers"] if s["controller"] == "robust")
        low, high = (scored["bands"][band] for band in ("low", "high"))
        step = self.largest
        answer = f"trip at {step.speed_rpm:.0f} rpm" if step.fault_word else f"{100 * step.overshoot:.1f} %"
        return (
            f"| `{self.name}` | {KINDS[self.name]} | {self.pwm_hz / 1000:g} kHz, {self.turn_rad:.2f} rad "
            f"| {self.summary['cases']} | {low['rms']:.2f} / {low['p99']:.2f} % | {high['rms']:.2f} / "
            f"{high['p99']:.2f} % | {scored['harm']['harmless_share']:.3g} % | {scored['trouble']['trips']} "
            f"| {answer} |"
        )


def _campaign(name: str, cases: int, out: Path) -> dict[str, Any]:
    """The summary of a campaign; a missed bound is in it, too. Exit code 1 without a new summary is an error."""
    written = out / "summary.json"
    written.unlink(missing_ok=True)
    command = [sys.executable, "-m", "fluxtrue_tools", "campaign", str(FILES / f"{name}.toml"), "--cases", str(cases),
               "--out", str(out), "--fresh", "--workers", "1"]  # fmt: skip
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode not in (0, 1) or not written.exists():
        raise click.ClickException(f"{name}: {done.stderr}")
    summary: dict[str, Any] = json.loads(written.read_text(encoding="utf-8"))
    return summary


def measure(name: str, cases: int, out: Path) -> Row:
    """One machine: its campaign, and its steps with small inductances."""
    summary = _campaign(name, cases, out)
    campaign = spec.read(FILES / f"{name}.toml")
    machine = data_sheet(prepare(campaign.motor, None, FILES, name), campaign.nominal)
    pwm_hz = machine.motor.plant["pwm_hz"]
    turn_rad = machine.pole_pairs * machine.speed_max_rpm / 60.0 * 2.0 * math.pi / pwm_hz
    return Row(name, turn_rad, pwm_hz, summary, worst(steps(machine)))


def rows_of(page: str) -> dict[str, str]:
    """The rows of the page's table, by machine."""
    found = MARKED.search(page)
    assert found is not None
    return {line.split("`")[1]: line for line in found[2].splitlines()}


def with_rows(page: str, rows: dict[str, str]) -> str:
    """The page with these rows, in the order of KINDS."""
    ordered = "".join(f"{rows[name]}\n" for name in KINDS if name in rows)
    return MARKED.sub(lambda found: found[1] + ordered + found[3], page)


@click.command()
@click.argument("names", nargs=-1, type=click.Choice(sorted(KINDS)))
@click.option("--cases", type=click.IntRange(min=1, max=CASES), default=CASES, show_default=True)
@click.option("--write/--no-write", default=True, help="Write the rows into docs/howto/campaign.md.  [default: write]")
def main(names: tuple[str, ...], cases: int, write: bool) -> None:
    """Measure the machines NAMES, all of them by default. Simulation."""
    missed = []
    for name in names or KINDS:
        row = measure(name, cases, ROOT / "build" / "campaign" / f"machine-{name}")
        click.echo(f"{row}\n  {row.largest}")
        missed += [f"{name}: {b['what']} = {b['value']:.3g}" for b in row.summary["bounds"] if not b["met"]]
        missed += [] if row.largest.met else [f"{name}: {row.largest} (allowed: {100 * OVERSHOOT_MAX:g} %, no fault)"]
        if write:
            page = PAGE.read_text(encoding="utf-8")
            write_text(PAGE, with_rows(page, rows_of(page) | {name: str(row)}))
    for text in missed:
        click.echo(f"missed: {text}")
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    run_module(main)
