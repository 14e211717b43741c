# SPDX-License-Identifier: Apache-2.0
"""The DMA controller: programs that copy with it, and an idle one while a test accesses the descriptors."""

import ctypes
import struct
from collections.abc import Iterator

import pytest
from conftest import Program

from fluxtrue_tools.emulate.core import Core, EmulationStoppedError

CYCLE_S = 1 / 48e6  # after reset the system clock is the fast internal one
START, LINK, ACTIVE, DONE = 1, 1 << 5, 1 << 6, 1 << 7
SOURCE, DESTINATION = 0x1FFF_9000, 0x1FFF_A000
COUNT = 10
COPY_S = (16 + 8 * COUNT) * CYCLE_S  # as dma.c assumes
VALUES = tuple(range(100, 100 + COUNT))
FIELDS = {
    "SADDR": SOURCE, "SOFF": 2, "ATTR": 0x0101, "NBYTES_MLNO": 2 * COUNT, "SLAST": 0, "DADDR": DESTINATION, "DOFF": 2,
    "CITER_ELINKNO": 1, "DLASTSGA": 0, "CSR": 0, "BITER_ELINKNO": 1,
}  # fmt: skip


@pytest.fixture
def core(library: ctypes.CDLL, program: Program) -> Iterator[Core]:
    with Core.of_program(library, program("idle")) as core:
        core.run(1e-4)
        core.write(SOURCE, struct.pack(f"<{COUNT}H", *VALUES))
        core.write(DESTINATION, bytes(2 * COUNT))
        yield core


def prepare(core: Core, channel: int = 0, **changes: int) -> None:
    """Write the whole descriptor of a channel."""
    for name, value in (FIELDS | changes).items():
        core.store(f"DMA.TCD{channel}_{name}", value)


def start(core: Core, channel: int = 0, link: int = 0) -> None:
    core.store(f"DMA.TCD{channel}_CSR", START | link)


def link_to(channel: int) -> int:
    return LINK | channel << 8


def csr(core: Core, channel: int = 0) -> int:
    return core.load(f"DMA.TCD{channel}_CSR")


def half_words(core: Core, address: int = DESTINATION, count: int = COUNT) -> tuple[int, ...]:
    return struct.unpack(f"<{count}H", core.read(address, 2 * count))


# ---- a copy


def test_a_program_starts_a_copy_and_waits_for_it(library: ctypes.CDLL, program: Program) -> None:
    count = 40
    with Core.of_program(library, program("dma", "-DCASE=0")) as core:
        core.run(1e-3)
        assert core.word("finished") == 2
        for run in range(2):
            for channel, step in enumerate((2, 3)):
                at = core.symbol("copied") + 2 * count * (2 * run + channel)
                assert half_words(core, at, count) == tuple(1000 * run + step * k for k in range(count))


def test_a_channel_is_active_until_it_is_done(core: Core) -> None:
    prepare(core)
    start(core)
    assert csr(core) == ACTIVE
    core.run(COPY_S - CYCLE_S)
    assert csr(core) == ACTIVE
    core.run(CYCLE_S)
    assert csr(core) == DONE


def test_a_copy_arrives_at_the_end_of_its_time(core: Core) -> None:
    """Until then the destination is old, and a change of the source is in the copy."""
    prepare(core)
    start(core)
    core.run(COPY_S - CYCLE_S)
    assert half_words(core) == (0,) * COUNT
    core.write(SOURCE, struct.pack("<H", 7))
    core.run(CYCLE_S)
    assert half_words(core) == (7, *VALUES[1:])


def test_a_slower_clock_lengthens_a_copy(core: Core) -> None:
    prepare(core)
    start(core)
    core.run(COPY_S / 2)
    core.store("SCG.RCCR", 3 << 24 | 1 << 16 | 1)  # half of the fast internal clock
    core.run(COPY_S - 2 * CYCLE_S)
    assert csr(core) == ACTIVE
    core.run(2 * CYCLE_S)
    assert csr(core) == DONE


def test_offsets_are_signed(core: Core) -> None:
    """Backwards from the last half word, to every second place backwards."""
    prepare(core, SADDR=SOURCE + 2 * COUNT - 2, SOFF=0xFFFE, DADDR=DESTINATION + 4 * COUNT - 4, DOFF=0xFFFC)
    core.write(DESTINATION, bytes(4 * COUNT))
    start(core)
    core.run(COPY_S)
    assert half_words(core, count=2 * COUNT)[::2] == VALUES
    assert half_words(core, count=2 * COUNT)[1::2] == (0,) * COUNT


def test_a_copy_may_overlap_its_source(core: Core) -> None:
    """Each half word is read after the one before it has been written: the first one spreads."""
    prepare(core, DADDR=SOURCE + 2)
    start(core)
    core.run(COPY_S)
    assert half_words(core, SOURCE, COUNT + 1) == (VALUES[0],) * (COUNT + 1)


def test_the_flash_is_copied_too(core: Core) -> None:
    prepare(core, SADDR=0)
    start(core)
    core.run(COPY_S)
    assert half_words(core) == half_words(core, 0)


def test_the_addresses_move_to_the_end_of_the_copy(core: Core) -> None:
    """A second start continues there."""
    prepare(core, SOFF=0, DOFF=4, NBYTES_MLNO=COUNT)
    for run in (1, 2):
        start(core)
        core.run(COPY_S)
        assert core.load("DMA.TCD0_SADDR") == SOURCE
        assert core.load("DMA.TCD0_DADDR") == DESTINATION + 2 * COUNT * run
    assert half_words(core, count=2 * COUNT)[::2] == (VALUES[0],) * COUNT


def test_the_last_adjustments_are_added(core: Core) -> None:
    prepare(core, SLAST=2**32 - 2 * COUNT, DLASTSGA=100)
    start(core)
    core.run(COPY_S)
    assert core.load("DMA.TCD0_SADDR") == SOURCE
    assert core.load("DMA.TCD0_DADDR") == DESTINATION + 2 * COUNT + 100


def test_copied_code_runs(library: ctypes.CDLL, program: Program) -> None:
    """The second function has an instruction less, in the same number of bytes; it is called twice, and the second time
    the emulator knows it. An instruction takes 1.5 cycles."""
    with Core.of_program(library, program("dma", "-DCASE=2")) as core:
        core.run(1e-3)
        assert [core.word("answer", k) for k in range(2)] == [1, 2]
        assert core.word("cycles", 0) - core.word("cycles", 1) in (1, 2)


def test_a_reset_ends_a_copy(core: Core) -> None:
    prepare(core)
    start(core)
    core.reset(0x20)
    before = core.read(DESTINATION, 2 * COUNT)
    core.run(2 * COPY_S)
    assert core.read(DESTINATION, 2 * COUNT) == before
    with pytest.raises(EmulationStoppedError, match="undefined"):
        csr(core)


def test_a_snapshot_keeps_a_copy_that_runs(core: Core) -> None:
    prepare(core)
    prepare(core, 1, DADDR=DESTINATION + 0x100)
    start(core, 0, link_to(1))
    core.run(COPY_S / 2)
    snapshot = core.save()
    for _ in range(2):
        core.run(COPY_S)
        assert half_words(core) == VALUES
        assert (csr(core), csr(core, 1)) == (DONE | link_to(1), ACTIVE)
        core.run(COPY_S)
        assert csr(core, 1) == DONE
        core.restore(snapshot)
        assert half_words(core) == (0,) * COUNT
    core.free(snapshot)


# ---- links


def test_the_end_of_a_channel_starts_the_linked_one(core: Core) -> None:
    """Three channels of sixteen, one after the other, not in the order of their numbers; each takes its time."""
    order = (2, 15, 7)
    for k, channel in enumerate(order):
        prepare(core, channel, DADDR=DESTINATION + 0x100 * k)
        core.write(DESTINATION + 0x100 * k, bytes(2 * COUNT))
    core.store("DMA.TCD15_CSR", link_to(7))
    start(core, 2, link_to(15))
    for k in range(3):
        core.run(COPY_S - CYCLE_S)
        assert [csr(core, channel) & (ACTIVE | DONE) for channel in order] == [DONE] * k + [ACTIVE] + [0] * (2 - k)
        assert half_words(core, DESTINATION + 0x100 * k) == (0,) * COUNT
        core.run(CYCLE_S)
        assert half_words(core, DESTINATION + 0x100 * k) == VALUES
    core.run(10 * COPY_S)
    assert [csr(core, channel) for channel in order] == [DONE | link_to(15), DONE | link_to(7), DONE]


def test_done_is_cleared_by_software_and_by_a_start(core: Core) -> None:
    """A link starts the second channel, whose DONE of the run before is kept until then: a program that waits for it
    must clear it first."""
    for channel in (0, 1):
        prepare(core, channel, SLAST=2**32 - 2 * COUNT, DLASTSGA=2**32 - 2 * COUNT)
    start(core, 0, link_to(1))
    core.run(2 * COPY_S)
    assert (csr(core), csr(core, 1)) == (DONE | link_to(1), DONE)
    core.store("DMA.TCD0_CSR", 0)
    assert csr(core) == 0
    start(core, 0, link_to(1))
    core.run(COPY_S - CYCLE_S)
    assert (csr(core), csr(core, 1)) == (ACTIVE | link_to(1), DONE)
    core.run(CYCLE_S)
    assert (csr(core), csr(core, 1)) == (DONE | link_to(1), ACTIVE)
    core.run(COPY_S)
    assert csr(core, 1) == DONE


@pytest.mark.parametrize("cleared", [True, False])
def test_a_link_is_lost_while_done_is_set(core: Core, cleared: bool) -> None:
    """The write that clears DONE still finds it set: the link needs a second one."""
    prepare(core)
    prepare(core, 1, DADDR=DESTINATION + 0x100)
    start(core)
    core.run(COPY_S)
    core.store("DMA.TCD0_SADDR", SOURCE)
    if cleared:
        core.store("DMA.TCD0_CSR", 0)
    start(core, 0, link_to(1))
    assert csr(core) == ACTIVE | (link_to(1) if cleared else 1 << 8)
    core.run(10 * COPY_S)
    assert csr(core, 1) == (DONE if cleared else 0)


@pytest.mark.parametrize("cleared", [True, False])
def test_a_link_is_lost_while_done_is_undefined(core: Core, cleared: bool) -> None:
    prepare(core, 1, DADDR=DESTINATION + 0x100)
    for name, value in FIELDS.items():
        if cleared or name != "CSR":
            core.store(f"DMA.TCD0_{name}", value)
    start(core, 0, link_to(1))
    core.run(10 * COPY_S)
    assert csr(core, 1) == (DONE if cleared else 0)


# ---- what is refused


def refused(core: Core, message: str, name: str, value: int) -> None:
    with pytest.raises(EmulationStoppedError, match=message):
        core.store(f"DMA.{name}", value)


@pytest.mark.parametrize("missing", [name for name in FIELDS if name != "CSR"])
def test_an_incomplete_descriptor_is_refused(core: Core, missing: str) -> None:
    for name, value in FIELDS.items():
        if name != missing:
            core.store(f"DMA.TCD3_{name}", value)
    refused(core, "channel 3 starts: a field of its descriptor has not been written", "TCD3_CSR", START)


def test_an_incomplete_descriptor_of_a_linked_channel_is_refused(core: Core) -> None:
    prepare(core)
    start(core, 0, link_to(1))
    with pytest.raises(EmulationStoppedError, match="channel 1 starts: a field of its descriptor"):
        core.run(2 * COPY_S)


@pytest.mark.parametrize("name", ["SADDR", "BITER_ELINKNO", "CSR"])
def test_an_undefined_field_is_not_read(core: Core, name: str) -> None:
    core.store(f"DMA.TCD0_{name}", 0)
    assert core.load(f"DMA.TCD0_{name}") == 0
    with pytest.raises(EmulationStoppedError, match="undefined"):
        core.load(f"DMA.TCD1_{name}")


@pytest.mark.parametrize("name", list(FIELDS))
@pytest.mark.parametrize("channel", [0, 1, 2])
def test_a_descriptor_in_use_is_not_written(core: Core, channel: int, name: str) -> None:
    """Channel 0 is active, its link leads to 1, and that one's to 2."""
    for each in range(4):
        prepare(core, each, DADDR=DESTINATION + 0x100 * each)
    core.store("DMA.TCD1_CSR", link_to(2))
    start(core, 0, link_to(1))
    core.store(f"DMA.TCD3_{name}", FIELDS[name])
    refused(core, f"channel {channel} is active or will be started", f"TCD{channel}_{name}", FIELDS[name])


def test_a_descriptor_is_free_again_when_its_channel_is_done(core: Core) -> None:
    prepare(core)
    prepare(core, 1, DADDR=DESTINATION + 0x100)
    start(core, 0, link_to(1))
    core.run(COPY_S)
    prepare(core)
    refused(core, "channel 1 is active", "TCD1_SADDR", SOURCE)


@pytest.mark.parametrize("name", ["SADDR", "DADDR", "NBYTES_MLNO"])
def test_the_addresses_of_an_active_channel_are_not_read(core: Core, name: str) -> None:
    prepare(core)
    start(core)
    assert core.load("DMA.TCD0_SOFF") == 2
    with pytest.raises(EmulationStoppedError, match="while the channel is active"):
        core.load(f"DMA.TCD0_{name}")


def test_a_second_channel_is_refused(core: Core) -> None:
    prepare(core)
    prepare(core, 1)
    start(core)
    refused(core, "channel 1 starts while channel 0 is active", "TCD1_CSR", START)


def refused_start(core: Core, message: str, **changes: int) -> None:
    prepare(core, **changes)
    refused(core, message, "TCD0_CSR", START)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [("SADDR", SOURCE + 1, "odd"), ("DADDR", DESTINATION + 1, "odd"), ("SOFF", 1, "odd"), ("DOFF", 0xFFFF, "odd"),
     ("NBYTES_MLNO", 0, "NBYTES"), ("NBYTES_MLNO", 3, "NBYTES"), ("NBYTES_MLNO", 0xF002, "NBYTES"),
     ("CITER_ELINKNO", 0, "one minor loop"), ("BITER_ELINKNO", 0, "one minor loop"),
     ("CITER_ELINKNO", 2, "one minor loop"), ("BITER_ELINKNO", 2, "one minor loop")],
)  # fmt: skip
def test_configuration_errors_are_refused(core: Core, name: str, value: int, message: str) -> None:
    refused_start(core, message, **{name: value})


RAM, RAM_END, FLASH_END, LAST = 0x1FFF_8000, 0x2000_7000, 0x8_0000, 2 * COUNT - 2


@pytest.mark.parametrize(
    ("changes", "where"),
    [({"SADDR": FLASH_END - LAST}, "source"), ({"SADDR": RAM - 2}, "source"), ({"SADDR": RAM_END - LAST}, "source"),
     ({"SADDR": RAM + LAST - 2, "SOFF": 0xFFFE}, "source"), ({"SADDR": 0x1000_0000}, "source"),
     ({"SADDR": 0x4000_9000}, "source"), ({"DADDR": 0}, "destination"), ({"DADDR": RAM - 2}, "destination"),
     ({"DADDR": RAM_END - LAST}, "destination"), ({"DADDR": RAM + LAST - 2, "DOFF": 0xFFFE}, "destination")],
)  # fmt: skip
def test_a_copy_outside_the_memory_is_refused(core: Core, changes: dict[str, int], where: str) -> None:
    refused_start(core, f"the {where}", **changes)


@pytest.mark.parametrize(
    "changes",
    [{"SADDR": FLASH_END - LAST - 2}, {"SADDR": RAM}, {"SADDR": RAM_END - LAST - 2}, {"DADDR": RAM},
     {"DADDR": RAM_END - LAST - 2}, {"DADDR": RAM + LAST, "DOFF": 0xFFFE}],
)  # fmt: skip
def test_a_copy_at_the_edge_of_the_memory_arrives(core: Core, changes: dict[str, int]) -> None:
    prepare(core, **changes)
    fields = FIELDS | changes
    expected = half_words(core, fields["SADDR"])
    start(core)
    core.run(COPY_S)
    down = fields["DOFF"] == 0xFFFE
    at = fields["DADDR"] - (LAST if down else 0)
    assert half_words(core, at) == (expected[::-1] if down else expected)


UPPER = 0x2000_0000


@pytest.mark.parametrize("changes", [{"SADDR": UPPER - LAST}, {"DADDR": UPPER + 0x100}])
@pytest.mark.parametrize("closed", ["before", "while it runs"])
def test_a_copy_of_retained_ram_is_refused(core: Core, changes: dict[str, int], closed: str) -> None:
    prepare(core, **changes)
    if closed == "before":
        core.store("SIM.CHIPCTL", 0x20_0000)
        refused(core, "SRAMU_RETEN", "TCD0_CSR", START)
    else:
        start(core)
        core.store("SIM.CHIPCTL", 0x20_0000)
        with pytest.raises(EmulationStoppedError, match="SRAMU_RETEN"):
            core.run(COPY_S)


def test_a_copy_beside_retained_ram_arrives(core: Core) -> None:
    core.store("SIM.CHIPCTL", 0x20_0000)
    prepare(core, DADDR=UPPER - LAST - 2)
    start(core)
    core.run(COPY_S)
    assert half_words(core, UPPER - LAST - 2) == VALUES


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [("ATTR", 0x0000, "only half words"), ("ATTR", 0x0202, "only half words"), ("ATTR", 0x0102, "only half words"),
     ("ATTR", 0x0901, "only half words"), ("ATTR", 0x0109, "only half words"),
     ("CITER_ELINKNO", 0x8001, "one minor loop"), ("BITER_ELINKNO", 0x8001, "one minor loop")],
)  # fmt: skip
def test_other_transfers_are_refused(core: Core, name: str, value: int, message: str) -> None:
    refused_start(core, message, **{name: value})


def test_several_minor_loops_are_refused(core: Core) -> None:
    refused_start(core, "one minor loop", CITER_ELINKNO=2, BITER_ELINKNO=2)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [*(("TCD0_CSR", bit, "only START and the link") for bit in (2, 4, 8, 16, ACTIVE, DONE, 0x4000, 0x8000)),
     ("ERQ", 1, "hardware requests"), ("CR", 1 << 7, "EMLM"), ("CR", 1 << 2, "priorities"),
     *((name, 0, "not modelled") for name in ("CDNE", "SSRT", "SERQ", "EEI", "INT", "DCHPRI0"))],
)  # fmt: skip
def test_other_controls_are_refused(core: Core, name: str, value: int, message: str) -> None:
    refused(core, message, name, value)


def test_two_fields_are_not_written_at_once(library: ctypes.CDLL, program: Program) -> None:
    with (
        Core.of_program(library, program("dma", "-DCASE=1")) as core,
        pytest.raises(EmulationStoppedError, match="TCD0_CSR offset 0x101c: 4 bytes, the register has 2"),
    ):
        core.run(1e-3)


def test_no_error_is_reported(core: Core) -> None:
    prepare(core)
    start(core)
    core.run(COPY_S)
    core.store("DMA.ERR", 1)
    assert (core.load("DMA.ES"), core.load("DMA.ERR"), core.load("DMA.ERQ"), core.load("DMA.CR")) == (0, 0, 0, 0)
