# SPDX-License-Identifier: Apache-2.0
"""The emulated processor alone: any ELF file for the S32K144, run, read, snapshot."""

import ctypes
from enum import Enum
from pathlib import Path
from typing import Final

from fluxtrue_tools.emulate.library import COUNTING, ERROR_SIZE, FAST
from fluxtrue_tools.errors import FluxtrueError

TICKS_PER_S: Final = 3_360_000_000
LIMIT, CENTRE, BREAK = 0, 1, 2
NO_REGISTER: Final = 2**64 - 1

_U64, _U32, _INT, _BOOL = ctypes.c_uint64, ctypes.c_uint32, ctypes.c_int, ctypes.c_bool
_HERE, _TEXT = ctypes.c_void_p, ctypes.c_char_p


class Bridge(ctypes.Structure):
    """The C type emu_bridge_t."""

    _fields_ = (("duty", ctypes.c_double * 3), ("driven", ctypes.c_uint8), ("gates", _BOOL),
                ("dead_time_s", ctypes.c_double), ("period_s", ctypes.c_double))  # fmt: skip


class Pins(ctypes.Structure):
    """The C type emu_pins_t."""

    _fields_ = (("adc", ctypes.c_uint16 * 32 * 2), ("angle", _U32), ("angle_rate", ctypes.c_int32),
                ("resolver_fault", _BOOL), ("gate_fault", _BOOL))  # fmt: skip


class State(Enum):
    """State of the core: running, stuck with all interrupts masked, or halted by a debugger."""

    RUNS = 0
    STUCK = 1
    HALTED = 2


class EmulationStoppedError(FluxtrueError):
    """The program did something that the emulator refuses; the processor stays stopped."""


class Counts(ctypes.Structure):
    """Instructions of one handler, without those of handlers that interrupted it."""

    _fields_ = (("runs", _U64), ("sum", _U64), ("least", _U32), ("most", _U32))


ON_EXCEPTION = ctypes.CFUNCTYPE(None, _HERE, _INT, _BOOL)
_SIGNATURES = {
    "emu_create": (_HERE, [_TEXT, _INT, _TEXT, ctypes.c_size_t]),
    "emu_destroy": (None, [_HERE]),
    "emu_run": (_INT, [_HERE, _U64]),
    "emu_error": (_TEXT, [_HERE]),
    "emu_now": (_U64, [_HERE]),
    "emu_instructions": (_U64, [_HERE]),
    "emu_resets": (_U32, [_HERE]),
    "emu_read": (_BOOL, [_HERE, _U32, _HERE, _U32]),
    "emu_write": (_BOOL, [_HERE, _U32, _HERE, _U32]),
    "emu_symbol": (_U32, [_HERE, _TEXT]),
    "emu_register": (_U64, [_HERE, _TEXT]),
    "emu_register_set": (_BOOL, [_HERE, _TEXT, _U32]),
    "emu_register_load": (_U64, [_HERE, _TEXT]),
    "emu_register_store": (_BOOL, [_HERE, _TEXT, _U32]),
    "emu_on_exception": (None, [_HERE, ON_EXCEPTION, _HERE]),
    "emu_active_vector": (_INT, [_HERE]),
    "emu_pend": (None, [_HERE, _INT]),
    "emu_save": (_HERE, [_HERE]),
    "emu_restore": (None, [_HERE, _HERE]),
    "emu_snapshot_free": (None, [_HERE]),
    "emu_counts": (Counts, [_HERE, _INT]),
    "emu_counts_clear": (None, [_HERE]),
    "emu_break_after": (None, [_HERE, _U64]),
    "emu_bridge": (None, [_HERE, ctypes.POINTER(Bridge)]),
    "emu_pins": (ctypes.POINTER(Pins), [_HERE]),
    "emu_outputs": (_U32, [_HERE]),
    "emu_core_state": (None, [_HERE, _INT]),
    "emu_core_faults": (None, [_HERE, _BOOL]),
    "emu_adc_calibration": (None, [_HERE, _U32]),
    "emu_power_cycle": (None, [_HERE]),
    "emu_reset_now": (None, [_HERE, _U32]),
    "emu_flash_slow": (None, [_HERE, _BOOL]),
    "emu_flash_worn": (None, [_HERE, _U32, _BOOL]),
    "emu_flash_weak": (None, [_HERE, _U32, _BOOL]),
    "emu_flash_random": (None, [_HERE, _U32]),
    "emu_flash_erases": (_U32, [_HERE, _U32]),
    "emu_flash_spoil": (None, [_HERE, _U32]),
    "emu_board_pins": (None, [_HERE, _BOOL, _BOOL]),
    "sim_emulator": (_HERE, [_HERE]),
}


def declare(library: ctypes.CDLL) -> ctypes.CDLL:
    """Prototypes of the processor's functions."""
    for name, (result, arguments) in _SIGNATURES.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


class Core:
    """One processor: one of its own that runs an ELF file, or the one inside a simulation."""

    def __init__(self, library: ctypes.CDLL, handle: int, owned: bool) -> None:
        self._library, self._handle, self._owned = declare(library), handle, owned
        self._callback: object = None

    @classmethod
    def of_program(cls, library: ctypes.CDLL, elf: Path, counting: bool = False) -> "Core":
        """A processor out of reset with this program in its flash."""
        error = ctypes.create_string_buffer(ERROR_SIZE)
        mode = COUNTING if counting else FAST
        handle = declare(library).emu_create(bytes(elf), mode, error, ERROR_SIZE)
        if not handle:
            raise FluxtrueError(error.value.decode(errors="replace"))
        return cls(library, handle, owned=True)

    @classmethod
    def of_simulation(cls, library: ctypes.CDLL, sim: int) -> "Core":
        """The processor of a running simulation."""
        return cls(library, declare(library).sim_emulator(sim), owned=False)

    def close(self) -> None:
        """Release the memory."""
        if self._handle and self._owned:
            self._library.emu_destroy(self._handle)
        self._handle = 0

    def __enter__(self) -> "Core":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def run(self, seconds: float) -> int:
        """Run for at most this time; LIMIT, CENTRE or BREAK. A stopped emulation is an exception, never an answer:
        a caller that waits for something else would wait for ever, because time no longer advances."""
        stopped = int(self._library.emu_run(self._handle, round(seconds * TICKS_PER_S)))
        self._raise_if_stopped()
        return stopped

    def _raise_if_stopped(self) -> None:
        if self.error is not None:
            raise EmulationStoppedError(f"the emulation stopped: {self.error}")

    @property
    def error(self) -> str | None:
        """What stopped the emulation."""
        text = self._library.emu_error(self._handle)
        return None if text is None else text.decode(errors="replace")

    @property
    def now_s(self) -> float:
        """Emulated time since creation."""
        return float(self._library.emu_now(self._handle)) / TICKS_PER_S

    @property
    def instructions(self) -> int:
        """Number of instructions executed so far."""
        return int(self._library.emu_instructions(self._handle))

    @property
    def resets(self) -> int:
        """Number of resets since creation."""
        return int(self._library.emu_resets(self._handle))

    @property
    def active_vector(self) -> int:
        """Exception being handled, 0: none."""
        return int(self._library.emu_active_vector(self._handle))

    def symbol(self, name: str) -> int:
        """The address of a symbol."""
        address = int(self._library.emu_symbol(self._handle, name.encode()))
        if address == 0:
            raise KeyError(name)
        return address

    def read(self, address: int, size: int) -> bytes:
        """Read memory as a debugger does."""
        content = ctypes.create_string_buffer(size)
        if not self._library.emu_read(self._handle, address, content, size):
            raise ValueError(f"nothing is at {address:#x}")
        return content.raw

    def write(self, address: int, content: bytes) -> None:
        """Write memory as a debugger does."""
        if not self._library.emu_write(self._handle, address, content, len(content)):
            raise ValueError(f"nothing is at {address:#x}")

    def word(self, symbol: str, index: int = 0) -> int:
        """A 32-bit variable, or an element of an array."""
        return int.from_bytes(self.read(self.symbol(symbol) + 4 * index, 4), "little")

    def register(self, name: str) -> int:
        """ "FTM0.MOD", without side effects."""
        value = int(self._library.emu_register(self._handle, name.encode()))
        if value == NO_REGISTER:
            raise KeyError(name)
        return value

    def set_register(self, name: str, value: int) -> None:
        """Change the content of a register, without side effects."""
        if not self._library.emu_register_set(self._handle, name.encode(), value):
            raise KeyError(name)

    def load(self, name: str) -> int:
        """The register as the core would read it."""
        value = int(self._library.emu_register_load(self._handle, name.encode()))
        if value == NO_REGISTER:
            raise KeyError(name)
        self._raise_if_stopped()
        return value

    def store(self, name: str, value: int) -> None:
        """Write the register as the core would."""
        if not self._library.emu_register_store(self._handle, name.encode(), value):
            raise KeyError(name)
        self._raise_if_stopped()

    def board(self, *, gate_fault: bool = False, resolver_fault: bool = False) -> None:
        """Lines of the board."""
        self._library.emu_board_pins(self._handle, gate_fault, resolver_fault)

    @property
    def outputs(self) -> int:
        """Outputs of the bridge that may switch on in this period, one bit each, the even ones the upper switches."""
        return int(self._library.emu_outputs(self._handle))

    def duty(self, pair: int) -> float:
        """Share of this period for which the upper switch's pulse lasts."""
        bridge = Bridge()
        self._library.emu_bridge(self._handle, ctypes.byref(bridge))
        return float(bridge.duty[pair])

    def turn(self, turns: float) -> None:
        """Turn the shaft to this angle, where it stays."""
        pins = self._library.emu_pins(self._handle).contents
        pins.angle, pins.angle_rate = round(turns % 1.0 * 2**32) % 2**32, 0

    def core_state(self, state: State) -> None:
        """Change the state of the core; timers and peripherals continue."""
        self._library.emu_core_state(self._handle, state.value)

    def take_faults(self, taken: bool = True) -> None:
        """Let a fault of the core be an exception, as on the chip, instead of the end of the emulation."""
        self._library.emu_core_faults(self._handle, taken)

    def adc_calibration(self, clocks: int) -> None:
        """Let the calibration of a converter take so many of its clocks."""
        self._library.emu_adc_calibration(self._handle, clocks)

    def reset(self, cause: int) -> None:
        """Reset the processor now; the bits of RCM_SRS say why. With POR (0x80) the supply has failed."""
        self._library.emu_reset_now(self._handle, cause)

    def power_cycle(self) -> None:
        """Let the supply fail and return: RAM is lost, a running flash command is left half done."""
        self._library.emu_power_cycle(self._handle)

    def flash_slow(self, slow: bool) -> None:
        """Let flash commands take the data sheet's longest times instead of its typical ones."""
        self._library.emu_flash_slow(self._handle, slow)

    def flash_worn(self, sector: int, worn: bool) -> None:
        """Let every erase of this sector of the data flash fail."""
        self._library.emu_flash_worn(self._handle, sector, worn)

    def flash_weak(self, sector: int, weak: bool) -> None:
        """Let this sector of the data flash erase, but one bit of each of its bytes never be programmed."""
        self._library.emu_flash_weak(self._handle, sector, weak)

    def flash_random(self, seed: int) -> None:
        """Choose what half done commands leave."""
        self._library.emu_flash_random(self._handle, seed)

    def flash_erases(self, sector: int) -> int:
        """How often this sector of the data flash has been erased."""
        return int(self._library.emu_flash_erases(self._handle, sector))

    def flash_spoil(self, address: int) -> None:
        """Make the phrase at this address one that a read cannot rely on."""
        self._library.emu_flash_spoil(self._handle, address)

    def pend(self, vector: int) -> None:
        """Make an exception pending."""
        self._library.emu_pend(self._handle, vector)

    def on_exception(self, call: object) -> None:
        """Tell `call(vector, entered)` of every entry and return."""
        self._callback = ON_EXCEPTION(lambda _user, vector, entered: call(vector, entered))  # type: ignore[operator]
        self._library.emu_on_exception(self._handle, self._callback, None)

    def break_after(self, instructions: int) -> None:
        """Let run() stop with BREAK after so many instructions (in counting mode)."""
        self._library.emu_break_after(self._handle, instructions)

    def counts(self, vector: int) -> Counts:
        """The counts of a handler's runs so far; in counting mode without instructions that an IT block skipped."""
        counts: Counts = self._library.emu_counts(self._handle, vector)
        return counts

    def clear_counts(self) -> None:
        """Set all counts to zero."""
        self._library.emu_counts_clear(self._handle)

    def save(self) -> int:
        """A snapshot for restore(); free() it."""
        return int(self._library.emu_save(self._handle))

    def restore(self, snapshot: int) -> None:
        """Restore everything but the program from a snapshot."""
        self._library.emu_restore(self._handle, snapshot)

    def free(self, snapshot: int) -> None:
        """Release a snapshot."""
        self._library.emu_snapshot_free(snapshot)
