# SPDX-License-Identifier: Apache-2.0
"""C from the DBC: cantools' pack and unpack, and on top what it leaves out.

cantools writes bus.[ch]; its encoder neither saturates nor checks for NaN. signals.h adds for every
signal the node sends a function that clamps to the DBC's range and refuses what is no number, for
every message it receives the check of all ranges, and the cycle times, time-outs and data ids that
the DBC holds as attributes. exports.c makes all of it callable from the tests.

One firmware serves every motor, so the code has raw values only: signals with a quantity that scales
with the motor take their factor from the motor data (bus_scales_t).
"""

from collections.abc import Iterator
from math import gcd
from pathlib import Path

import cantools
import click
from cantools.database.can import Database, Message, c_source
from cantools.database.can.c_source import camel_to_snake_case
from cantools.database.can.signal import Signal

from fluxtrue_tools import paths
from fluxtrue_tools.bus.scales import QUANTITIES, in_raw_values
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.outputs import write_text

PREFIX = "bus"
EXACT = 2**24  # the largest integers that a float holds

# One copy for all signals: inlined into each of them it took more than a kilobyte of an image.
COUNT = f"""static inline __attribute__((noinline)) bool {PREFIX}_count(float x, float factor, float low, float high,
    int32_t *counts)
{{
    const bool finite = isfinite(x);
    const float wanted = finite ? x / factor : 0.0F;
    *counts = (int32_t)roundf((wanted < low) ? low : (wanted > high) ? high : wanted);
    return finite;
}}
"""


def snake(name: str) -> str:
    """The name cantools gives a message or signal in C."""
    return str(camel_to_snake_case(name))


def attribute(message: Message, name: str) -> int:
    """An integer attribute of the message, 0 if the DBC does not set it."""
    found = message.dbc.attributes.get(name) if message.dbc else None
    return int(found.value) if found else 0


def is_count(signal: Signal) -> bool:
    """A signal without scale and unit is a number of things: it never becomes a float."""
    return signal.scale == 1 and signal.offset == 0 and not signal.unit


def quantity(signal: Signal) -> str | None:
    """The member of bus_scales_t that has the signal's factor, if it scales with the motor."""
    return QUANTITIES.get(signal.unit or "")


def limits(signal: Signal) -> tuple[float, float]:
    """Smallest and largest value."""
    if signal.minimum is None or signal.maximum is None:
        raise FluxtrueError(f"signal {signal.name}: the DBC must give a range [min|max]")
    return float(signal.minimum), float(signal.maximum)


def put(message: Message, signal: Signal) -> str:
    """The function that writes one signal, clamped."""
    struct, name = f"{PREFIX}_{snake(message.name)}", snake(signal.name)
    low, high = limits(signal)
    head = f"(struct {struct}_t *m, "
    if is_count(signal):
        kind = "int32_t" if signal.is_signed else "uint32_t"
        suffix = "" if signal.is_signed else "U"
        tests = [f"(x > {int(high)}{suffix}) ? {int(high)}{suffix} : "] if high < 2**32 - 1 else []
        tests += [f"(x < {int(low)}{suffix}) ? {int(low)}{suffix} : "] if low != 0 or signal.is_signed else []
        return (f"static inline void {struct}_put_{name}{head}{kind} x)\n{{\n"
                f"    m->{name} = (__typeof__(m->{name}))({''.join(tests)}x);\n}}\n")  # fmt: skip
    scale = quantity(signal)
    scales = ", const bus_scales_t *scales" if scale else ""
    factor = f"scales->{scale}" if scale else f"{float(signal.scale)!r}F"
    if signal.offset or max(-low, high) > abs(signal.scale) * EXACT:
        raise FluxtrueError(f"signal {signal.name}: its counts need an offset or more than {EXACT}")
    ends = ", ".join(f"{float(round(end / signal.scale))!r}F" for end in (low, high))
    return (f"static inline bool {struct}_put_{name}{head}float x{scales})\n{{\n"
            f"    int32_t counts;\n"
            f"    const bool finite = {PREFIX}_count(x, {factor}, {ends}, &counts);\n"
            f"    m->{name} = (__typeof__(m->{name}))counts;\n"
            f"    return finite;\n}}\n")  # fmt: skip


def get(message: Message, signal: Signal) -> str:
    """The function that reads one signal that scales with the motor."""
    struct, name = f"{PREFIX}_{snake(message.name)}", snake(signal.name)
    return (f"static inline float {struct}_get_{name}(const struct {struct}_t *m, const bus_scales_t *scales)\n{{\n"
            f"    return (float)m->{name} * scales->{quantity(signal)};\n}}\n")  # fmt: skip


def poison(message: Message, signal: Signal) -> str:
    """The function that cantools writes for such a signal has no factor: its use must not compile."""
    struct = f"{PREFIX}_{snake(message.name)}_{snake(signal.name)}"
    return f"#pragma GCC poison {struct}_encode {struct}_decode\n"


def in_range(message: Message) -> str:
    """The function that checks every signal of a received message."""
    struct = f"{PREFIX}_{snake(message.name)}"
    tests = " &&\n           ".join(
        f"{struct}_{snake(signal.name)}_is_in_range(m->{snake(signal.name)})" for signal in message.signals
    )
    return f"static inline bool {struct}_in_range(const struct {struct}_t *m)\n{{\n    return {tests};\n}}\n"


def constants(message: Message) -> str:
    """What the DBC says about a message beside its signals."""
    name = f"{PREFIX}_{snake(message.name)}".upper()
    return "".join(f"#define {name}_{key} {attribute(message, value)}U\n" for key, value in (
        ("CYCLE_MS", "GenMsgCycleTime"), ("TIME_OUT_MS", "TimeOut"), ("DATA_ID", "E2EDataId")))  # fmt: skip


def phases(messages: list[Message]) -> dict[str, int]:
    """When in its cycle each message is due: the fastest first, each in the first millisecond that no other takes."""
    found: dict[str, int] = {}
    taken: list[tuple[int, int]] = []  # phase and cycle
    for message in sorted(messages, key=lambda message: attribute(message, "GenMsgCycleTime")):
        cycle = attribute(message, "GenMsgCycleTime")
        free = (ms for ms in range(cycle) if all((ms - phase) % gcd(cycle, other) for phase, other in taken))
        found[message.name] = next(free, -1)
        if found[message.name] < 0:
            raise FluxtrueError(f"message {message.name}: no millisecond of its cycle of {cycle} ms is left")
        taken.append((found[message.name], cycle))
    return found


def phase_constants(messages: list[Message]) -> str:
    """The phases for C."""
    return "".join(f"#define {PREFIX.upper()}_{snake(name).upper()}_PHASE_MS {phase}U\n"
                   for name, phase in phases(messages).items())  # fmt: skip


def x_macro(name: str, messages: list[Message]) -> str:
    """A list of messages to expand: X(lower-case name, upper-case name)."""
    rows = "".join(f" \\\n    X({snake(message.name)}, {snake(message.name).upper()})" for message in messages)
    return f"#define {name}(X){rows}\n"


def signals_header(sent: list[Message], received: list[Message]) -> str:
    """The text of the file signals.h."""
    parts = ["/* Generated from the DBC by fluxtrue_tools.bus.generate. */\n#ifndef BUS_SIGNALS_H\n"
             "#define BUS_SIGNALS_H\n#include <math.h>\n\n#include \"bus/bus.h\"\n"
             "#include \"types/bus_scales.h\"\n"]  # fmt: skip
    parts += [constants(message) for message in (*sent, *received)]
    parts.append(phase_constants(sent))
    protected = [message for message in (*sent, *received) if attribute(message, "E2EDataId")]
    parts += [x_macro("BUS_SENT", sent), x_macro("BUS_PROTECTED", protected)]
    parts.append(COUNT)
    parts += [put(message, signal) for message in sent for signal in message.signals]
    parts += [in_range(message) for message in received]
    parts += [get(message, signal) for message in received for signal in message.signals if quantity(signal)]
    every = (*sent, *received)
    parts.append(
        "".join(poison(message, signal) for message in every for signal in message.signals if quantity(signal))
    )
    return "\n".join([*parts, "#endif\n"])


def exported_sent(message: Message) -> str:
    """exports.c: test_<message>(values, data, scales) packs all signals in the DBC's order."""
    struct = f"{PREFIX}_{snake(message.name)}"
    head = f"int test_{snake(message.name)}(const double *v, uint8_t *data, const bus_scales_t *scales)"
    text = f"API {head};\n{head}\n{{\n    int taken = 0;\n    struct {struct}_t m = {{0}};\n    (void)scales;\n"
    for index, signal in enumerate(message.signals):
        call = f"{struct}_put_{snake(signal.name)}(&m, "
        kind = "int32_t" if signal.is_signed else "uint32_t"
        scales = ", scales" if quantity(signal) else ""
        text += (f"    {call}({kind})v[{index}]);\n    taken++;\n" if is_count(signal)
                 else f"    taken += {call}(float)v[{index}]{scales});\n")  # fmt: skip
    return f"{text}    {struct}_pack(data, &m, 8);\n    return taken;\n}}\n"


def exported_received(message: Message) -> str:
    """exports.c: test_<message>(values, data, scales) unpacks all signals in the DBC's order."""
    struct = f"{PREFIX}_{snake(message.name)}"
    head = f"int test_{snake(message.name)}(double *v, const uint8_t *data, const bus_scales_t *scales)"
    text = f"API {head};\n{head}\n{{\n    struct {struct}_t m;\n    (void)scales;\n    {struct}_unpack(&m, data, 8);\n"
    for index, signal in enumerate(message.signals):
        name = snake(signal.name)
        value = f"get_{name}(&m, scales)" if quantity(signal) else f"{name}_decode(m.{name})"
        text += f"    v[{index}] = (double){struct}_{value};\n"
    return f"{text}    return {struct}_in_range(&m);\n}}\n"


def exports(sent: list[Message], received: list[Message]) -> Iterator[str]:
    """The text of the file exports.c."""
    yield '/* Generated for the tests. */\n#include "bus/signals.h"\n#include <stdint.h>\n'
    yield '#define API __attribute__((visibility("default")))\n'
    yield from map(exported_sent, sent)
    yield from map(exported_received, received)


# The conversion that cantools writes, and one that is enough for 32-bit signals. Without double-precision hardware
# the first needs two kilobytes of the compiler's library.
WIDE = "static uint64_t cantools_unsigned_from_double(double value)"
NARROW = "static uint32_t cantools_unsigned_from_double(float value)"
CASTS = ("    return (uint64_t)value;", "    return (uint32_t)value;")


def narrow(source: Path, database: Database) -> None:
    """Let the conversion of floats be single precision and 32 bits, which hold every signal exactly as before."""
    longest = max(signal.length for message in database.messages for signal in message.signals)
    text = source.read_text(encoding="utf-8")
    if longest > 32:
        raise FluxtrueError(f"the DBC has a signal of {longest} bits, at most 32 are allowed")
    if WIDE in text:
        write_text(source, text.replace(WIDE, NARROW).replace(*CASTS))


def _packing(source: Path, node: str) -> tuple[str, str]:
    """Header and source as `cantools generate_c_source --use-float --use-round` writes them.

    Its command line would load all its commands first, among them one that draws with Matplotlib.
    """
    database = cantools.database.load_file(source)
    header, code, *_fuzzer = c_source.generate(
        database, PREFIX, f"{PREFIX}.h", f"{PREFIX}.c", "", True, False, True, node, True
    )
    return header, code


def generate(dbc: Path, out: Path, node: str) -> None:
    """Writes bus.[ch], signals.h and exports.c to out/bus, and there the DBC they are made from."""
    raw = in_raw_values(dbc.read_text(encoding="utf-8"))
    database = cantools.database.load_string(raw, "dbc")
    if not isinstance(database, Database) or node not in [entry.name for entry in database.nodes]:
        raise FluxtrueError(f"{dbc}: no CAN database with a node '{node}'")
    folder = out / PREFIX
    folder.mkdir(parents=True, exist_ok=True)
    source = folder / "raw.dbc"
    write_text(source, raw)
    packed, packing = _packing(source, node)
    write_text(folder / "bus.h", packed)
    write_text(folder / "bus.c", packing)
    narrow(folder / "bus.c", database)
    sent = [message for message in database.messages if node in message.senders]
    received = [message for message in database.messages if node in message.receivers]
    write_text(folder / "signals.h", signals_header(sent, received))
    write_text(folder / "exports.c", "".join(exports(sent, received)))


@click.command(cls=paths.Command)
@click.argument("dbc", type=paths.InputFile())
@click.argument("out", type=paths.BuildFolder())
@click.option("--node", default="INV", show_default=True, help="The node the code is for.")
def main(dbc: Path, out: Path, node: str) -> None:
    """Write the C code of NODE for the messages of DBC to OUT."""
    generate(dbc, out, node)


if __name__ == "__main__":
    main()
