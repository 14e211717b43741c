# SPDX-License-Identifier: Apache-2.0
"""The supply fails at every step of a save on the emulated processor: what the next start finds is old or new.

The long campaign, with FLUXTRUE_BUILD_DIR and PYTHONPATH as for the tests: python flash_cuts.py 200
"""

from __future__ import annotations

import random
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import flash_saves as flash
from flash_saves import Parts

from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.core import Core
from fluxtrue_tools.sim.library import Loop

SHORT: Final = ((900.0, 40.0),)
SHARES: Final = (0.02, 0.5, 0.98)  # of the time of each flash command


def drive_until_saving(loop: Loop, core: Core) -> None:
    """Everything up to the point where the next save begins."""
    flash.drive(loop, SHORT, 0.15)
    flash.until_saving(loop, core)


@dataclass
class Cuts:
    """How often the supply failed: once in a save, and once more in the save after that."""

    first: int = 0
    second: int = 0


def taken(parts: Parts, core: Core, possible: Iterable[flash.Record], cut: str) -> flash.Record:
    """The record that this start has taken: all of the drive's values are those of one of the possible records."""
    assert flash.is_recalled(core), f"{cut}: nothing is recalled"
    values = flash.kept(parts, core)
    found = next((record for record in possible if record.recalled == values), None)
    assert found is not None, f"{cut}: neither the old record nor the new one"
    return found


def check_second_cut(parts: Parts, loop: Loop, core: Core, before: flash.Record, dice: random.Random) -> None:
    """Drive, and cut the save after that: the next start has what this one had, or what was to be saved."""
    drive_until_saving(loop, core)
    start = core.save()
    times = flash.instants(core, ())
    new = flash.records(core)[-1]
    core.restore(start)
    core.free(start)
    assert new.recalled != before.recalled
    flash.advance(core, dice.random() * times[-1])
    flash.power_cycle(loop)
    taken(parts, core, (before, new), "second cut")


def check_cuts(parts: Parts, loop: Loop, core: Core, dice: random.Random) -> Cuts:
    """Cut the save that begins now at every step, each time from the same state; then let it complete. Every eighth
    cut is followed by a second one, in the save after it."""
    cuts = Cuts()
    start = core.save()
    old = flash.records(core)[-1]
    times = flash.instants(core, SHARES)
    new = flash.records(core)[-1]
    assert new.sequence > old.sequence and new.recalled != old.recalled
    for k, time in enumerate(times):
        core.restore(start)
        core.flash_random(dice.randrange(1, 2**32))
        flash.advance(core, time)
        flash.power_cycle(loop)
        cuts.first += 1
        found = taken(parts, core, (old, new), f"cut {k} at {time} s")
        if k % 8 == 3:
            check_second_cut(parts, loop, core, found, dice)
            cuts.second += 1
    core.restore(start)
    core.free(start)
    flash.until_saved(loop, core)
    flash.power_cycle(loop)
    taken(parts, core, (new,), "without a cut")
    return cuts


def campaign(parts: Parts, saves: int, last: int | None = None) -> Cuts:
    """This number of saves, each cut at every step. `last`: the slots up to this one hold records before the first of
    them."""
    dice = random.Random(1)
    cuts = Cuts()
    with flash.key_on(parts) as (loop, core):
        drive_until_saving(loop, core)
        flash.until_saved(loop, core)
        if last is not None:
            flash.fill(core, last)
        flash.power_cycle(loop)
        for _ in range(saves):
            drive_until_saving(loop, core)
            made = check_cuts(parts, loop, core, dice)
            cuts = Cuts(cuts.first + made.first, cuts.second + made.second)
            print(f"{cuts.first} cuts, {cuts.second} second ones, slot {flash.records(core)[-1].slot}", flush=True)
    return cuts


if __name__ == "__main__":
    campaign(build.prepare("hsm1", angle="resolver"), int(sys.argv[1]))
