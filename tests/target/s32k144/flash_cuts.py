# SPDX-License-Identifier: Apache-2.0
"""The supply fails at every step of a save on the emulated processor: what the next start finds is old or new.

The long campaign, with FLUXTRUE_BUILD_DIR and PYTHONPATH as for the tests: python flash_cuts.py 200
"""

from __future__ import annotations

import random
import sys
from typing import Final

import flash_saves as flash
from flash_saves import Parts

from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.core import Core
from fluxtrue_tools.sim.library import Loop

SHORT: Final = ((900.0, 40.0),)
SHARES: Final = (0.02, 0.5, 0.98)  # of the time of each flash command


def saved_once(parts: Parts, loop: Loop, core: Core) -> None:
    """Everything up to the point where the next save begins."""
    flash.drive(loop, SHORT, 0.15)
    flash.until_saving(loop, core)


def check_cuts(loop: Loop, core: Core, dice: random.Random) -> int:
    """Cut the save that begins now at every step, each time from the same state; then let it complete. Every eighth
    cut is followed by a second one, in the save after it. Returns the number of cuts."""
    start = core.save()
    old = flash.records(core)[-1]
    times = flash.instants(core, SHARES)
    new = flash.records(core)[-1]
    assert new.sequence > old.sequence
    for k, time in enumerate(times):
        core.restore(start)
        core.flash_random(dice.randrange(1, 2**32))
        flash.advance(core, time)
        flash.power_cycle(loop)
        assert flash.is_recalled(core), f"cut {k} at {time} s"
        assert recalled_states(core, old, new), f"cut {k} at {time} s: neither the old record nor the new one"
        if k % 8 == 3:
            flash.drive(loop, SHORT, 0.15)
            flash.until_saving(loop, core)
            flash.advance(core, dice.random() * times[-1])
            flash.power_cycle(loop)
            assert flash.is_recalled(core), f"second cut after {k}"
    core.restore(start)
    core.free(start)
    flash.until_saved(loop, core)
    flash.power_cycle(loop)
    assert recalled_states(core, new, new)
    return len(times)


def recalled_states(core: Core, old: flash.Record, new: flash.Record) -> bool:
    """The filter starts with all states of one of the two records."""
    ram = core.read(0x1FFF_8000, 0xF000)
    return any(record.content[4 : 4 + 4 * flash.STATES] in ram for record in (old, new))


def campaign(parts: Parts, saves: int, last: int | None = None) -> int:
    """This number of saves, each cut at every step; returns the number of cuts. `last`: the slots up to this one hold
    records before the first of them."""
    dice = random.Random(1)
    cuts = 0
    with flash.key_on(parts) as (loop, core):
        saved_once(parts, loop, core)
        flash.until_saved(loop, core)
        if last is not None:
            flash.fill(core, last)
        flash.power_cycle(loop)
        for _ in range(saves):
            saved_once(parts, loop, core)
            cuts += check_cuts(loop, core, dice)
            print(f"{cuts} cuts, slot {flash.records(core)[-1].slot}", flush=True)
    return cuts


if __name__ == "__main__":
    campaign(build.prepare("hsm1", angle="resolver"), int(sys.argv[1]))
