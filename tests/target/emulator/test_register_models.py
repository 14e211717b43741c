# SPDX-License-Identifier: Apache-2.0
"""The other peripherals by themselves: an idle program runs, and the test accesses the registers from outside."""

import ctypes
from collections.abc import Iterator

import pytest
from conftest import Program

from fluxtrue_tools.bench.image import Frame
from fluxtrue_tools.emulate.core import CENTRE, Core, EmulationStoppedError

CORE_S = 1 / 48e6  # after reset the core runs from the fast internal clock
CLOCK_S = 1 / 12e6  # of the converter and the interval timer, as set up here
CALIBRATION_S = 14_000 * CLOCK_S  # assumed, adc.c
CONVERSION_S = 43 * CLOCK_S  # SMPLTS 12: 13 + 30 clocks
COCO, AIEN, ADTRG = 0x80, 0x40, 0x40
ADC0_IRQ, LPIT0_IRQ, CAN0_IRQ = 39, 48, 81
GATE, SOURCE_FIRC = 1 << 30, 3 << 24


@pytest.fixture
def core(library: ctypes.CDLL, program: Program) -> Iterator[Core]:
    with Core.of_program(library, program("idle")) as core:
        core.run(1e-4)
        core.store("SCG.FIRCDIV", 0x301)
        yield core


def clock(core: Core, *names: str) -> None:
    """Switch the clocks on; peripherals with a choice get 12 MHz from the internal clock."""
    for name in names:
        register = f"PCC.PCC_{name}"
        if core.register(register) & 0x4000_0000 == 0 and name[:3] in {"ADC", "LPI", "LPS"}:
            core.store(register, SOURCE_FIRC)
            core.store(register, SOURCE_FIRC | GATE)
        else:
            core.store(register, GATE)


def refused(core: Core, name: str, value: int, message: str) -> None:
    with pytest.raises(EmulationStoppedError, match=message):
        core.store(name, value)


# ---- converter


@pytest.fixture
def adc(core: Core) -> Core:
    clock(core, "ADC0")
    for name, value in (("CFG1", 4), ("CFG2", 12), ("CLPS", 0), ("CLP3", 0), ("CLP2", 0), ("CLP1", 0), ("CLP0", 0),
                        ("CLPX", 0), ("CLP9", 0), ("SC3", 0x87)):  # fmt: skip
        core.store(f"ADC0.{name}", value)
    core.run(CALIBRATION_S)
    core.store("ADC0.SC3", 0)
    core.store("ADC0.SC10", 31)
    return core


def test_a_written_sc1a_converts_at_once(adc: Core) -> None:
    adc.store("ADC0.SC10", 3)
    adc.run(CONVERSION_S - CLOCK_S)
    assert adc.register("ADC0.SC10") & COCO == 0
    adc.run(CLOCK_S)
    assert adc.register("ADC0.SC10") & COCO


def test_averaging_takes_as_many_conversions(adc: Core) -> None:
    adc.store("ADC0.SC3", 4 | 1)  # eight
    adc.store("ADC0.SC10", 3)
    adc.run(8 * CONVERSION_S - CLOCK_S)
    assert adc.register("ADC0.SC10") & COCO == 0
    adc.run(CLOCK_S)
    assert adc.register("ADC0.SC10") & COCO


@pytest.mark.parametrize("by", ["result", "control"])
def test_complete_is_cleared_by_result_or_control(adc: Core, by: str) -> None:
    adc.store("ADC0.SC10", 3)
    adc.run(CONVERSION_S)
    assert adc.register("ADC0.SC10") & COCO
    if by == "result":
        adc.load("ADC0.R0")
    else:
        adc.store("ADC0.SC10", 31)
    assert adc.register("ADC0.SC10") & COCO == 0


@pytest.mark.parametrize("enable", [0, AIEN])
def test_a_complete_conversion_interrupts_if_enabled(adc: Core, enable: int) -> None:
    adc.store("ADC0.SC10", 3 | enable)
    adc.run(CONVERSION_S + 1e-6)
    assert adc.word("taken", ADC0_IRQ) == (1 if enable else 0)


def test_the_disabled_input_is_not_converted(adc: Core) -> None:
    adc.store("ADC0.SC10", 31)
    adc.run(2 * CONVERSION_S)
    assert adc.register("ADC0.SC10") & COCO == 0


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [("SC2", 1 << 5, "comparison and DMA"), ("SC2", 1 << 2, "comparison and DMA")],
)
def test_other_converter_modes_are_refused(adc: Core, name: str, value: int, message: str) -> None:
    refused(adc, f"ADC0.{name}", value, message)


@pytest.mark.parametrize("mode", [0, 2])
def test_other_resolutions_are_refused(adc: Core, mode: int) -> None:
    adc.store("ADC0.CFG1", mode << 2)
    refused(adc, "ADC0.SC10", 3, "only 12-bit conversions")


# ---- interval timer


@pytest.fixture
def lpit(core: Core) -> Core:
    clock(core, "LPIT")
    core.store("LPIT0.MCR", 1)
    core.run(5 * CLOCK_S)
    core.store("LPIT0.MIER", 1)
    return core


def test_a_channel_expires_periodically(lpit: Core) -> None:
    lpit.store("LPIT0.TVAL0", 99)
    lpit.store("LPIT0.TCTRL0", 1)
    for _ in range(3):
        lpit.run(99 * CLOCK_S)
        assert lpit.register("LPIT0.MSR") & 1 == 0
        lpit.run(CLOCK_S)
        assert lpit.register("LPIT0.MSR") & 1
        lpit.store("LPIT0.MSR", 1)
    assert lpit.word("taken", LPIT0_IRQ) == 1  # then the program disables it


def test_a_new_value_acts_after_the_next_expiry(lpit: Core) -> None:
    lpit.store("LPIT0.TVAL0", 99)
    lpit.store("LPIT0.TCTRL0", 1)
    lpit.run(10 * CLOCK_S)
    lpit.store("LPIT0.TVAL0", 199)
    lpit.run(90 * CLOCK_S)
    assert lpit.register("LPIT0.MSR") & 1
    lpit.store("LPIT0.MSR", 1)
    lpit.run(199 * CLOCK_S)
    assert lpit.register("LPIT0.MSR") & 1 == 0
    lpit.run(CLOCK_S)
    assert lpit.register("LPIT0.MSR") & 1


@pytest.mark.parametrize(("name", "value"), [("TCTRL0", 1 << 2 | 1), ("TCTRL0", 3), ("SETTEN", 1), ("CLRTEN", 1)])
def test_other_channel_modes_are_refused(lpit: Core, name: str, value: int) -> None:
    refused(lpit, f"LPIT0.{name}", value, "modelled")


# ---- serial interface


@pytest.fixture
def spi(core: Core) -> Core:
    """LPSPI1 without a device: it receives ones."""
    clock(core, "LPSPI1")
    core.store("LPSPI1.CFGR1", 1)
    core.store("LPSPI1.CCR", 1 << 24 | 1 << 16 | 1 << 8 | 2)  # four clocks a bit
    core.store("LPSPI1.CR", 1)
    core.store("LPSPI1.TCR", 15)
    return core


def test_a_frame_arrives_when_its_bits_have_been_clocked(spi: Core) -> None:
    frame_s = (16 * 4 + 3 + 4) * CLOCK_S
    spi.store("LPSPI1.TDR", 0)
    spi.run(frame_s - CLOCK_S)
    assert spi.load("LPSPI1.RSR") & 2  # empty
    assert spi.load("LPSPI1.SR") & 1 << 24  # busy
    spi.run(CLOCK_S)
    assert spi.load("LPSPI1.RSR") & 2 == 0
    assert spi.load("LPSPI1.RDR") == 0xFFFF
    assert spi.load("LPSPI1.RSR") & 2


def test_a_frame_with_a_full_fifo_is_refused(spi: Core) -> None:
    for _ in range(4):
        spi.store("LPSPI1.TDR", 0)
    refused(spi, "LPSPI1.TDR", 0, "4 words waiting do not fit")


PULSE_OF_PDB0 = 36
UP, FRAME = 480, (16 * 4 + 3 + 4 + 3) * CLOCK_S  # ticks of 48 MHz; three clocks more for the request


@pytest.fixture
def requested(core: Core) -> Core:
    """LPSPI1 with two words that wait for the pulse of PDB0."""
    clock(core, "LPSPI1")
    for name, value in (
        ("LPSPI1.CFGR1", 1), ("LPSPI1.CCR", 1 << 24 | 1 << 16 | 1 << 8 | 2), ("LPSPI1.CFGR0", 7), ("LPSPI1.CR", 1),
        ("LPSPI1.TCR", 15), ("LPSPI1.TDR", 1), ("LPSPI1.TDR", 2), ("TRGMUX.TRGMUX_LPSPI1", PULSE_OF_PDB0),
        ("PCC.PCC_PDB0", 1 << 30), ("PDB0.MOD", 2000), ("PDB0.POEN", 1),
    ):  # fmt: skip
        core.store(name, value)
    return core


def pulse(core: Core, ticks: int) -> None:
    core.store("PDB0.PODLY", UP << 16 | UP + ticks)
    for more in (1, 1 << 16):  # load, trigger
        core.store("PDB0.SC", 0x80 | 15 << 8 | more)


def test_a_request_starts_one_frame_per_pulse(requested: Core) -> None:
    for left in (1, 0):
        pulse(requested, 48)
        requested.run(UP / 48e6 + FRAME - CLOCK_S)
        assert requested.load("LPSPI1.FSR") == left
        requested.run(2 * CLOCK_S)
        assert requested.load("LPSPI1.FSR") == 1 << 16 | left
        assert requested.load("LPSPI1.RDR") == 0xFFFF


def test_a_request_that_outlasts_a_frame_starts_the_next(requested: Core) -> None:
    pulse(requested, 1000)
    requested.run(1e-4)
    assert requested.load("LPSPI1.FSR") == 2 << 16


def test_a_request_that_is_too_short_is_refused(requested: Core) -> None:
    pulse(requested, 1)
    with pytest.raises(EmulationStoppedError, match="not longer than a clock of the module"):
        requested.run(1e-4)


@pytest.mark.parametrize("value", [1, 3, 5])
def test_a_request_by_the_pin_or_active_low_is_refused(core: Core, value: int) -> None:
    clock(core, "LPSPI1")
    refused(core, "LPSPI1.CFGR0", value, "only a request by the input trigger")


def test_reading_an_empty_fifo_is_refused(spi: Core) -> None:
    with pytest.raises(EmulationStoppedError, match="nothing has been received"):
        spi.load("LPSPI1.RDR")


@pytest.mark.parametrize(("name", "value"), [("IER", 2), ("DER", 2), ("TCR", 1 << 21 | 15), ("TCR", 1 << 16 | 15)])
def test_other_transfer_modes_are_refused(spi: Core, name: str, value: int) -> None:
    refused(spi, f"LPSPI1.{name}", value, "modelled|only single frames")


# ---- timer


@pytest.fixture
def ftm(core: Core) -> Core:
    """FTM0 set up to count from 100 to 1099, with its pins connected and no output enabled."""
    clock(core, "PORTA", "PORTB", "PORTD", "PORTE", "FTM0", "FTM2")
    for pin in ("D.PCR15", "D.PCR16", "D.PCR0", "D.PCR1", "B.PCR4", "B.PCR5", "E.PCR8", "A.PCR14"):
        core.store(f"PORT{pin}", 2 << 8)
    for name, value in (("MODE", 5), ("CNTIN", 100), ("MOD", 1099), ("COMBINE", 0x37), ("SYNCONF", 0x40280),
                        ("SYNC", 0x0A)):  # fmt: skip
        core.store(f"FTM0.{name}", value)
    return core


def test_the_counter_wraps_at_its_modulus(ftm: Core) -> None:
    ftm.store("FTM0.SC", 1 << 3 | 1)  # half of the clock
    ftm.run(0)  # start of the period
    assert ftm.run(CORE_S) != CENTRE
    ftm.run(1997 * CORE_S)
    assert ftm.load("FTM0.CNT") == 1099
    assert ftm.run(3 * CORE_S) == CENTRE
    assert ftm.load("FTM0.CNT") == 100


def acting_duty(core: Core) -> float:
    """The duty of the first pair that acts in this period."""
    return core.duty(0)


def test_compare_values_wait_for_their_trigger(ftm: Core) -> None:
    ftm.store("FTM0.C0V", 100)
    ftm.store("FTM0.C1V", 600)
    ftm.store("FTM0.SC", 1 << 3)
    ftm.run(0)
    assert acting_duty(ftm) == pytest.approx(0.5)
    ftm.store("FTM0.C1V", 350)
    for _ in range(2):
        assert ftm.run(1e-3) == CENTRE
        assert acting_duty(ftm) == pytest.approx(0.5)  # no trigger
    ftm.store("FTM0.SYNC", 0x8A)
    assert acting_duty(ftm) == pytest.approx(0.5)
    assert ftm.run(1e-3) == CENTRE
    assert acting_duty(ftm) == pytest.approx(0.25)
    assert ftm.register("FTM0.SYNC") & 0x80 == 0


def test_the_mask_waits_for_the_hardware_trigger(ftm: Core) -> None:
    """All six channels drive their pins. TRGMUX connects FTM0's own initialisation trigger, which EXTTRIG enables."""
    ftm.store("FTM0.SYNC", 0)
    ftm.store("FTM0.OUTMASK", 0x3F)
    ftm.store("FTM0.SYNC", 0x0A)
    for name, value in (("COMBINE", 0x373737), ("C0SC", 8), ("C1SC", 8), ("C2SC", 8), ("C3SC", 8), ("C4SC", 8),
                        ("C5SC", 8), ("EXTTRIG", 0x40)):  # fmt: skip
        ftm.store(f"FTM0.{name}", value)
    ftm.store("FTM0.SC", 0x3F << 16 | 1 << 3)
    ftm.run(0)
    ftm.store("FTM0.OUTMASK", 0)
    ftm.store("FTM0.SYNC", 0x1A)  # armed, but nothing is connected
    assert ftm.run(1e-3) == CENTRE
    assert ftm.outputs == 0
    ftm.store("TRGMUX.TRGMUX_FTM0", 22)
    assert ftm.outputs == 0
    assert ftm.run(1e-3) == CENTRE
    assert ftm.outputs == 0x3F
    assert ftm.register("FTM0.SYNC") & 0x10 == 0
    ftm.store("FTM0.OUTMASK", 0x3F)
    assert ftm.run(1e-3) == CENTRE
    assert ftm.outputs == 0x3F  # no longer armed


def test_the_counter_follows_the_encoder(ftm: Core) -> None:
    """The shaft starts at the encoder's zero; a value that is written to the counter is its position from then on."""
    for pin in ("D.PCR10", "D.PCR11"):
        ftm.store(f"PORT{pin}", 3 << 8)
    ftm.store("FTM2.MOD", 16383)
    ftm.store("FTM2.QDCTRL", 1)
    ftm.store("FTM2.SC", 1 << 3)
    assert ftm.load("FTM2.CNT") == 0
    ftm.turn(0.25)
    assert ftm.load("FTM2.CNT") == 4096
    ftm.store("FTM2.CNT", 0)
    assert ftm.load("FTM2.CNT") == 0
    ftm.turn(0.125)
    assert ftm.load("FTM2.CNT") == 16384 - 2048


def test_the_decoder_does_not_know_the_angle_at_its_start(ftm: Core) -> None:
    """After a reset of the processor the shaft stands anywhere, and the counter begins at its initial value."""
    ftm.turn(0.375)
    for pin in ("D.PCR10", "D.PCR11"):
        ftm.store(f"PORT{pin}", 3 << 8)
    for name, value in (("MOD", 16383), ("CNT", 0), ("QDCTRL", 1), ("SC", 1 << 3)):
        ftm.store(f"FTM2.{name}", value)
    assert ftm.load("FTM2.CNT") == 0
    ftm.turn(0.5)
    assert ftm.load("FTM2.CNT") == 2048


CAPTURED = 0x80


@pytest.mark.parametrize("way", [(0.875, 0.125), (0.25, 0.9375)], ids=["forwards", "backwards"])
def test_the_counter_is_captured_where_the_index_rises(ftm: Core, way: tuple[float, float]) -> None:
    """The index is high for one count at the shaft's zero; the counter began at another angle. The flag is cleared by
    writing 0."""
    ftm.turn(0.5)
    for pin, function in (("10", 3), ("11", 3), ("12", 2)):
        ftm.store(f"PORTD.PCR{pin}", function << 8)
    for name, value in (("MOD", 16383), ("CNT", 0), ("C2SC", 4), ("QDCTRL", 1), ("SC", 1 << 3)):
        ftm.store(f"FTM2.{name}", value)
    ftm.turn(way[0])
    assert ftm.load("FTM2.C2SC") == 4
    assert ftm.load("PTD.PDIR") >> 12 & 1 == 0
    ftm.turn(way[1])
    assert ftm.load("FTM2.C2SC") == 4 | CAPTURED
    assert ftm.load("FTM2.C2V") == 8192
    ftm.store("FTM2.C2SC", 4)
    ftm.turn(way[1] + 0.03125)
    assert ftm.load("FTM2.C2SC") == 4
    ftm.turn(0.0)
    assert ftm.load("PTD.PDIR") >> 12 & 1 == 1


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("SC", 1 << 5, "not modelled"),
        ("SC", 1 << 8, "not modelled"),
        ("INVCTRL", 1, "not modelled"),
        ("HCR", 1, "not modelled"),
    ],
)
def test_other_timer_modes_are_refused(ftm: Core, name: str, value: int, message: str) -> None:
    refused(ftm, f"FTM0.{name}", value, message)


# ---- clocks, run modes, reset, cache


def test_clocks_beyond_the_data_sheet_are_refused(core: Core) -> None:
    """48 MHz for the flash, which may run at up to 26.7 MHz."""
    refused(core, "SCG.RCCR", 3 << 24 | 0 << 16 | 0 << 4 | 0, "flash 48000 kHz are too fast for RUN")


def test_a_running_source_keeps_its_settings(core: Core) -> None:
    core.store("SCG.SOSCCFG", 0x24)
    core.store("SCG.SOSCCSR", 1)
    refused(core, "SCG.SOSCCFG", 0x34, "while the oscillator runs")


def test_other_run_modes_are_refused(core: Core) -> None:
    refused(core, "SMC.PMCTRL", 2 << 5, "run mode 2 is not modelled")


def test_a_cache_command_is_done_at_once(core: Core) -> None:
    core.store("LMEM.LMEM_PCCCR", 0x8500_0000)
    assert core.load("LMEM.LMEM_PCCCR") == 0x0500_0000


def test_other_trigger_sources_are_refused(core: Core) -> None:
    refused(core, "SIM.ADCOPT", 1, "only the PDB triggers")


# ---- pins


def test_writing_a_locked_pin_is_refused(core: Core) -> None:
    clock(core, "PORTC")
    core.store("PORTC.PCR3", 1 << 15 | 1 << 8)
    refused(core, "PORTC.PCR3", 1 << 8, "the pin is locked")


def test_pin_interrupts_are_refused(core: Core) -> None:
    clock(core, "PORTC")
    refused(core, "PORTC.PCR4", 9 << 16, "interrupts of pins")


def test_many_pins_are_set_at_once(core: Core) -> None:
    clock(core, "PORTC")
    core.store("PORTC.GPCLR", 0b101 << 16 | 0x102)
    assert [core.register(f"PORTC.PCR{n}") & 0xFFFF for n in range(3)] == [0x102, 0, 0x102]


def test_lines_are_set_cleared_and_toggled(core: Core) -> None:
    clock(core, "PORTC")
    for pin in range(3):
        core.store(f"PORTC.PCR{pin}", 1 << 8)
    core.store("PTC.PDDR", 0b111)
    core.store("PTC.PSOR", 0b011)
    assert core.load("PTC.PDOR") == 0b011
    core.store("PTC.PCOR", 0b001)
    assert core.load("PTC.PDOR") == 0b010
    core.store("PTC.PTOR", 0b110)
    assert core.load("PTC.PDOR") == 0b100
    assert core.load("PTC.PDIR") == 0b100


def test_a_locked_trigger_keeps_its_source(core: Core) -> None:
    core.store("TRGMUX.TRGMUX_PDB0", 1 << 31 | 22)
    refused(core, "TRGMUX.TRGMUX_PDB0", 21, "locked")


def test_other_trigger_targets_are_refused(core: Core) -> None:
    refused(core, "TRGMUX.TRGMUX_LPIT0", 1, "not modelled")


# ---- watchdog


def unlock(core: Core) -> None:
    core.store("WDOG.CNT", 0xD928_C520)


def test_the_watchdog_locks_again(core: Core) -> None:
    unlock(core)
    core.run(128 * 2 * CORE_S)
    refused(core, "WDOG.TOVAL", 100, "the watchdog is locked")


def test_without_update_the_watchdog_stays_configured(core: Core) -> None:
    unlock(core)
    core.store("WDOG.TOVAL", 1280)
    core.store("WDOG.CS", 0x2180)  # on, no UPDATE
    refused(core, "WDOG.CNT", 0xD928_C520, "may not be configured again")


@pytest.mark.parametrize(("after_s", "resets"), [(2e-3, 1), (5e-3, 0)])
def test_a_refresh_in_the_closed_window_resets(core: Core, after_s: float, resets: int) -> None:
    unlock(core)
    core.store("WDOG.WIN", 512)  # 4 ms of 128 kHz
    core.store("WDOG.TOVAL", 1280)
    core.store("WDOG.CS", 0xA1A0)
    core.run(after_s)
    core.store("WDOG.CNT", 0xB480_A602)
    core.run(1e-4)
    assert core.resets == resets


def test_a_watchdog_interrupt_is_refused(core: Core) -> None:
    unlock(core)
    refused(core, "WDOG.CS", 0x2160, "interrupt before the reset")


# ---- interrupts


def test_a_level_that_stays_active_interrupts_again(adc: Core) -> None:
    """The result, which is the cause of the interrupt, is never read."""
    adc.write(adc.symbol("taken_max"), (3).to_bytes(4, "little"))
    adc.store("ADC0.SC10", 3 | AIEN)
    adc.run(CONVERSION_S + 1e-5)
    assert adc.word("taken", ADC0_IRQ) == 3


# ---- bus


def can_frame_arrives(core: Core, frame: Frame) -> None:
    arrives = core._library.can_frame_arrives
    arrives.restype, arrives.argtypes = None, [ctypes.c_void_p, ctypes.POINTER(Frame)]
    arrives(core._handle, ctypes.byref(frame))


@pytest.fixture
def can(core: Core) -> Core:
    """500 kbit/s from 8 MHz, as the port sets it up."""
    for name, value in (("SCG.SOSCDIV", 0x101), ("SCG.SOSCCFG", 0x24), ("SCG.SOSCCSR", 1)):
        core.store(name, value)
    clock(core, "FlexCAN0", "PORTE")
    core.store("PORTE.PCR4", 5 << 8)
    core.store("PORTE.PCR5", 5 << 8)
    core.store("CAN0.MCR", 0x5080_000F)
    for word in range(128):
        core.store(f"CAN0.EmbeddedRAM{word}", 0)
    core.store("CAN0.MCR", 0x7080_000F)  # FIFO
    core.store("CAN0.CTRL1", 7 | 1 << 16 | 4 << 19 | 1 << 22)
    core.store("CAN0.RXFGMASK", 0)
    core.store("CAN0.IMASK1", 1 << 5)
    core.store("CAN0.MCR", 0x2080_000F)
    return core


def test_received_frames_queue_for_the_program(can: Core) -> None:
    for n in range(7):
        can_frame_arrives(can, Frame(0x100 + n, False, 8, (ctypes.c_uint8 * 8)(*[n] * 8)))
    assert can.load("CAN0.IFLAG1") == 1 << 5 | 1 << 6 | 1 << 7  # a frame, nearly full, one lost
    can.run(1e-6)
    assert can.word("taken", CAN0_IRQ) == 1
    for n in range(6):
        assert can.load("CAN0.EmbeddedRAM1") >> 18 == 0x100 + n
        assert can.load("CAN0.EmbeddedRAM2") == 0x0101_0101 * n
        can.store("CAN0.IFLAG1", 1 << 5)
    assert can.load("CAN0.IFLAG1") & 1 << 5 == 0


def test_mailboxes_are_sent_lowest_identifier_first(can: Core) -> None:
    """A frame has 47 + 64 bits of 2 us each. The first mailbox is being sent already when the others are filled."""
    frame_s = 111 * 2e-6
    for box, identifier in ((8, 0x300), (9, 0x200), (10, 0x100)):
        can.store(f"CAN0.EmbeddedRAM{4 * box + 1}", identifier << 18)
    for box in (8, 9, 10):
        can.store(f"CAN0.EmbeddedRAM{4 * box}", 12 << 24 | 8 << 16)
    done = []
    for _ in range(3):
        can.run(frame_s - 1e-6)
        before = can.load("CAN0.IFLAG1")
        can.run(1e-6)
        done.append((can.load("CAN0.IFLAG1") ^ before).bit_length() - 1)
    assert done == [8, 10, 9]
    assert can.load("CAN0.EmbeddedRAM36") >> 24 == 8


@pytest.mark.parametrize(("name", "value"), [("RXFGMASK", 1), ("MCR", 1 << 25 | 0x2080_000F)])
def test_other_bus_modes_are_refused(can: Core, name: str, value: int) -> None:
    can.store("CAN0.MCR", 0x7080_000F)  # frozen
    refused(can, f"CAN0.{name}", value, "not modelled")


# ---- clock sources, reset


@pytest.mark.parametrize(
    ("source", "start_s"), [("SOSC", 1.5e-3), ("SPLL", 150e-6 + 1075 / 8e6)], ids=["oscillator", "pll"]
)
def test_a_source_is_valid_after_its_start_up_time(core: Core, source: str, start_s: float) -> None:
    core.store("SCG.SOSCCSR", 1)
    if source == "SPLL":
        core.run(2e-3)
        core.store("SCG.SPLLCFG", 12 << 16)
        core.store("SCG.SPLLCSR", 1)
    register = f"SCG.{source}CSR"
    core.run(start_s - CORE_S)
    assert core.load(register) >> 24 & 1 == 0
    core.run(2 * CORE_S)
    assert core.load(register) >> 24 & 1 == 1


SRAM_L, SRAM_U = 0x1FFF_9000, 0x2000_2000
BOTH, LOWER_ONLY = 0x30_0000, 0x20_0000  # SIM_CHIPCTL: no retention at all; not of SRAM_L
WATCHDOG, POWER_ON = 0x20, 0x82


@pytest.mark.parametrize(
    ("chipctl", "cause", "kept"), [(BOTH, WATCHDOG, False), (LOWER_ONLY, WATCHDOG, True), (LOWER_ONLY, POWER_ON, False)]
)
def test_ram_is_kept_over_a_reset_only_where_it_is_retained(core: Core, chipctl: int, cause: int, kept: bool) -> None:
    for address in (SRAM_L, SRAM_U):
        core.write(address, b"kept")
    core.store("SIM.CHIPCTL", chipctl)
    core.reset(cause)
    assert core.register("RCM.SRS") == cause
    assert core.read(SRAM_L, 4) != b"kept"
    assert (core.read(SRAM_U, 4) == b"kept") == kept
    assert core.register("SIM.CHIPCTL") == BOTH


def test_retention_of_the_stack_is_refused(core: Core) -> None:
    refused(core, "SIM.CHIPCTL", 0, "retention of SRAM_L, in which the stack lies, is not modelled")
