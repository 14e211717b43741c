# SPDX-License-Identifier: Apache-2.0
"""The bridge's timer, its fault control and its outputs: an idle program runs, and the test accesses the registers."""

import ctypes
from collections.abc import Iterator

import pytest
from conftest import Program

from fluxtrue_tools.emulate.core import CENTRE, Core, EmulationStoppedError, State

CORE_S = 1 / 48e6  # after reset the core runs from the fast internal clock
PERIOD_S = 1000 * CORE_S
ALL, EVEN = 0x3F, 0x15
FTMEN, WPDIS, FAULTIE = 1, 4, 1 << 7
PAIR = 1 | 2 | 16 | 32 | 64  # COMBINE, COMP, DTEN, SYNCEN, FAULTEN
FAULTEN = 64
FILTER_4 = 4 << 8 | 1 << 4 | 1  # FFVAL, FFLTR0EN, FAULT0EN
FILTER_S = 8 * CORE_S  # 4 + FFVAL
FAULTF, FAULTIN, WPEN = 0x80, 0x20, 0x40
FAULT_IRQ = 103
RUNS = 0x3F << 16 | 1 << 3
PINS = ("PORTD.PCR15", "PORTD.PCR16", "PORTD.PCR0", "PORTD.PCR1", "PORTB.PCR4", "PORTB.PCR5", "PORTE.PCR8",
        "PORTA.PCR14")  # fmt: skip


def set_up(core: Core, **changed: int) -> None:
    """Three complementary pairs at half duty, with the fault control of the port; `changed` replaces single values."""
    core.run(1e-4)
    for port in "ABDE":
        core.store(f"PCC.PCC_PORT{port}", 1 << 30)
    for pin in PINS:
        core.store(pin, 2 << 8)
    core.store("PCC.PCC_FTM0", 1 << 30)
    registers = {"MODE": FTMEN | WPDIS, "CONF": 0, "MOD": 999, "COMBINE": PAIR | PAIR << 8 | PAIR << 16,
                 "DEADTIME": 20, "POL": 0, "FLTPOL": 1, "OUTMASK": 0, "SWOCTRL": 0}  # fmt: skip
    registers |= {f"C{n}SC": 8 for n in range(6)} | {f"C{n}V": 750 if n % 2 else 250 for n in range(6)}
    mode = {"MODE": changed.pop("MODE", FTMEN | WPDIS | 2 << 5)}
    control = {"FLTCTRL": changed.pop("FLTCTRL", FILTER_4)}
    start = {"SC": changed.pop("SC", RUNS)}
    for name, value in [*(registers | changed).items(), *mode.items(), *control.items(), *start.items()]:
        core.store(f"FTM0.{name}", value)


@pytest.fixture
def bare(library: ctypes.CDLL, program: Program) -> Iterator[Core]:
    with Core.of_program(library, program("idle")) as core:
        yield core


@pytest.fixture
def core(bare: Core) -> Core:
    set_up(bare)
    assert bare.outputs == ALL
    return bare


def advance(core: Core, seconds: float) -> None:
    """Run for this time, over any number of periods."""
    end = core.now_s + seconds
    while end - core.now_s > CORE_S / 100:
        core.run(end - core.now_s)


def to_next_period(core: Core) -> None:
    assert core.run(1.1 * PERIOD_S) == CENTRE


def fault(core: Core, seconds: float) -> None:
    core.board(gate_fault=True)
    advance(core, seconds)
    core.board(gate_fault=False)


@pytest.mark.parametrize(
    ("control", "prescaler", "cycles"),
    [(1, 0, 3), (FILTER_4, 0, 8), (0xF11, 0, 19), (FILTER_4, 1, 12), (1 << 4 | 1, 0, 3), (4 << 8 | 1, 0, 3)],
)
def test_the_filter_delays_and_ignores_pulses(bare: Core, control: int, prescaler: int, cycles: int) -> None:
    set_up(bare, FLTCTRL=control, SC=RUNS | prescaler << 24)
    fault(bare, (cycles - 1) * CORE_S)
    advance(bare, 3 * PERIOD_S)
    assert bare.outputs == ALL
    assert bare.load("FTM0.FMS") & (FAULTF | FAULTIN) == 0
    bare.board(gate_fault=True)
    advance(bare, (cycles - 1) * CORE_S)
    assert bare.outputs == ALL
    advance(bare, CORE_S)
    assert bare.outputs == 0
    assert bare.load("FTM0.FMS") & (FAULTF | FAULTIN) == FAULTF | FAULTIN


def test_the_level_of_fltpol_is_the_fault(bare: Core) -> None:
    """The line is high without a fault. If high is set as the active level, the outputs are switched off."""
    set_up(bare, FLTPOL=0)
    advance(bare, FILTER_S)
    assert bare.outputs == 0


def test_an_input_that_is_not_enabled_does_nothing(bare: Core) -> None:
    set_up(bare, FLTCTRL=FILTER_4 & ~1)
    fault(bare, PERIOD_S)
    assert bare.outputs == ALL


@pytest.mark.parametrize(("mode", "left"), [(0, ALL), (1, ALL & ~EVEN), (2, 0)])
def test_the_fault_mode_chooses_the_channels(bare: Core, mode: int, left: int) -> None:
    set_up(bare, MODE=FTMEN | WPDIS | mode << 5)
    fault(bare, 10 * CORE_S)
    assert bare.outputs == left


@pytest.mark.parametrize("pair", range(3))
def test_only_pairs_with_faulten_are_switched_off(bare: Core, pair: int) -> None:
    set_up(bare, COMBINE=(PAIR | PAIR << 8 | PAIR << 16) & ~(FAULTEN << 8 * pair))
    fault(bare, 10 * CORE_S)
    assert bare.outputs == 3 << 2 * pair


def test_a_bridge_with_only_some_outputs_on_is_refused(bare: Core) -> None:
    set_up(bare, MODE=FTMEN | WPDIS | 1 << 5)
    fault(bare, 10 * CORE_S)
    with pytest.raises(EmulationStoppedError, match="drives the outputs 0x2a of 0x3f"):
        to_next_period(bare)


def test_a_pair_without_dead_time_is_refused(bare: Core) -> None:
    with pytest.raises(EmulationStoppedError, match="a pair without COMBINE, COMP and DTEN"):
        set_up(bare, COMBINE=(PAIR | PAIR << 8 | PAIR << 16) & ~16)


def test_a_fault_before_fault_control_sets_no_flag(bare: Core) -> None:
    """An edge sets the flag: a line that is active before FAULTM is set appears in FAULTIN only."""
    bare.board(gate_fault=True)
    set_up(bare, MODE=FTMEN | WPDIS)
    advance(bare, PERIOD_S)
    bare.store("FTM0.MODE", FTMEN | WPDIS | 2 << 5)
    advance(bare, PERIOD_S)
    assert bare.outputs == ALL
    assert bare.load("FTM0.FMS") & (FAULTF | FAULTIN) == FAULTIN


def test_the_flag_is_cleared_by_read_then_write(core: Core) -> None:
    fault(core, FILTER_S)
    assert core.load("FTM0.FMS") & FAULTF
    core.store("FTM0.FMS", 0)  # the fault is still at the filter's output
    assert core.load("FTM0.FMS") & (FAULTF | FAULTIN) == FAULTF | FAULTIN
    advance(core, FILTER_S)
    core.store("FTM0.FMS", FAULTF)  # a one clears nothing
    assert core.load("FTM0.FMS") & (FAULTF | FAULTIN) == FAULTF
    core.store("FTM0.FMS", 0)
    assert core.load("FTM0.FMS") & FAULTF == 0


def test_a_flag_that_was_never_read_is_not_cleared(core: Core) -> None:
    fault(core, FILTER_S)
    advance(core, FILTER_S)
    core.store("FTM0.FMS", 0)
    assert core.load("FTM0.FMS") & FAULTF


def test_outputs_return_with_the_next_period(core: Core) -> None:
    fault(core, FILTER_S)
    advance(core, FILTER_S)
    to_next_period(core)
    to_next_period(core)
    assert core.outputs == 0  # the fault is over, but its flag is not
    advance(core, PERIOD_S / 2)
    core.load("FTM0.FMS")
    core.store("FTM0.FMS", 0)
    assert core.outputs == 0
    to_next_period(core)
    assert core.outputs == ALL


def test_the_fault_interrupts_while_its_flag_is_set(bare: Core) -> None:
    set_up(bare, MODE=FTMEN | WPDIS | 2 << 5 | FAULTIE)
    fault(bare, FILTER_S)
    advance(bare, 1e-6)
    assert bare.word("taken", FAULT_IRQ) == 1


def test_without_its_enable_a_fault_does_not_interrupt(core: Core) -> None:
    fault(core, FILTER_S)
    advance(core, 1e-6)
    assert core.word("taken", FAULT_IRQ) == 0


@pytest.mark.parametrize("name", ["FLTCTRL", "FLTPOL", "COMBINE", "MODE"])
def test_the_fault_settings_are_write_protected(core: Core, name: str) -> None:
    core.store("FTM0.FMS", WPEN)
    with pytest.raises(EmulationStoppedError, match="write protected"):
        core.store(f"FTM0.{name}", 0)


@pytest.mark.parametrize(
    ("name", "value"), [("MODE", FTMEN | WPDIS | 3 << 5), ("FLTCTRL", 2), ("FLTCTRL", 1 << 15), ("FLTPOL", 2)]
)
def test_other_fault_settings_are_refused(core: Core, name: str, value: int) -> None:
    with pytest.raises(EmulationStoppedError, match="not modelled"):
        core.store(f"FTM0.{name}", value)


@pytest.mark.parametrize(("name", "value"), [("POL", 1), ("SWOCTRL", 1 << 8 | 1)])
def test_other_output_settings_are_refused(core: Core, name: str, value: int) -> None:
    with pytest.raises(EmulationStoppedError, match="not modelled"):
        core.store(f"FTM0.{name}", value)


LOWER = 0b10_1010
FORCED = LOWER << 8 | ALL


def levels(core: Core) -> int:
    """The levels of outputs 0 ... 5, as the program reads them at the pins."""
    ports = {"B": core.load("PTB.PDIR"), "D": core.load("PTD.PDIR")}
    pins = (("D", 15), ("D", 16), ("D", 0), ("D", 1), ("B", 4), ("B", 5))
    return sum((ports[port] >> pin & 1) << k for k, (port, pin) in enumerate(pins))


def test_a_pin_reads_what_the_timer_drives(core: Core) -> None:
    """Pulses from 250 to 750, dead times of 20 after each edge."""
    to_next_period(core)
    at = 0
    for tick, expected in ((100, LOWER), (249, LOWER), (252, 0), (268, 0), (272, EVEN), (748, EVEN), (760, 0),
                           (772, LOWER), (990, LOWER)):  # fmt: skip
        core.run((tick - at) * CORE_S)
        at = tick
        assert levels(core) == expected, tick
    core.store("FTM0.OUTMASK", 3)
    assert levels(core) == LOWER & ~3
    core.store("PORTB.PCR5", 1 << 8)  # no longer given to the timer
    assert levels(core) == 0b1000


def test_the_lower_outputs_are_forced_high_together(bare: Core) -> None:
    set_up(bare, SC=RUNS & ~8)  # without its counter
    bare.store("FTM0.SWOCTRL", FORCED)
    assert bare.outputs == levels(bare) == LOWER
    assert [bare.duty(pair) for pair in range(3)] == [0.0, 0.0, 0.0]
    bare.store("FTM0.OUTMASK", 0b11)
    assert bare.outputs == LOWER & ~0b11


@pytest.mark.parametrize("state", [State.RUNS, State.STUCK])
def test_a_fault_overrides_outputs_that_are_forced(core: Core, state: State) -> None:
    core.store("FTM0.SWOCTRL", FORCED)
    core.core_state(state)
    fault(core, FILTER_S)
    assert core.outputs == 0


def test_mask_and_software_control_switch_off(core: Core) -> None:
    core.store("FTM0.SWOCTRL", 0b11)
    assert core.outputs == ALL & ~0b11
    core.store("FTM0.OUTMASK", 0b1100)
    assert core.outputs == ALL & ~0b1111


@pytest.mark.parametrize("changed", [{"SC": RUNS & ~(1 << 18)}, {"C2SC": 0}])
def test_an_output_requires_its_enable_and_its_edge(bare: Core, changed: dict[str, int]) -> None:
    with pytest.raises(EmulationStoppedError, match="drives the outputs 0x3b of 0x3f"):
        set_up(bare, **changed)


@pytest.mark.parametrize(("bdm", "left", "counts"), [(0, ALL, False), (1, 0, False), (2, ALL, False), (3, ALL, True)])
def test_a_halted_core_leaves_outputs_as_bdmmode_says(bare: Core, bdm: int, left: int, counts: bool) -> None:
    set_up(bare, CONF=bdm << 6)
    advance(bare, PERIOD_S / 4)
    bare.core_state(State.HALTED)
    before = bare.load("FTM0.CNT")
    advance(bare, PERIOD_S / 4)
    assert bare.outputs == left
    assert (bare.load("FTM0.CNT") != before) == counts
    bare.core_state(State.RUNS)
    advance(bare, PERIOD_S / 4)
    assert bare.outputs == (ALL if bdm != 1 else bare.outputs)
    assert bare.load("FTM0.CNT") == pytest.approx(before + (500 if counts else 250), abs=1)


def test_a_fault_switches_off_while_the_core_is_stuck(core: Core) -> None:
    core.core_state(State.STUCK)
    before = core.instructions
    core.board(gate_fault=True)
    advance(core, FILTER_S)
    assert core.outputs == 0
    assert core.instructions == before
