# SPDX-License-Identifier: Apache-2.0
"""How each file of each command is mutated: its content, and whether the command must refuse it."""

import json
import re
from collections.abc import Callable
from typing import Any

import port_samples
import samples
from abused import (
    LINES,
    MAP,
    MOTOR,
    ODD_CELLS,
    Blob,
    Content,
    mutated,
    mutated_table,
    with_other_bytes,
    with_other_cells,
)
from hypothesis import strategies as st

Changed = st.SearchStrategy[tuple[Content, bool]]
HEADER = 64  # bytes: of an ELF file, and of an MDF4 file's identification


def unsure(strategy: st.SearchStrategy[Any]) -> Changed:
    """Contents that may still be meant."""
    return strategy.map(lambda content: (content, False))


@st.composite
def mutated_map(draw: Callable[..., Any]) -> Content:
    """A flux map with one mutation."""
    kinds = ["cell", "cell", "drop", "twice", "column", "separator", "scale", "sign", "offset", "bytes"]
    kind = draw(st.sampled_from(kinds))
    rows = with_other_cells(draw, [line.split(",") for line in MAP.splitlines()], kind, ODD_CELLS)
    if kind in ("scale", "sign", "offset"):
        column = draw(LINES) % 4
        number = draw(st.sampled_from((1e3, 1e-3, 1e6))) if kind == "scale" else -1.0 if kind == "sign" else 0.0
        for cells in rows[1:]:
            cells[column] = repr(float(cells[column]) + 0.5 if kind == "offset" else number * float(cells[column]))
    text = "\n".join((draw(st.sampled_from(";\t |")) if kind == "separator" else ",").join(r) for r in rows) + "\n"
    return with_other_bytes(draw, text) if kind == "bytes" else text


@st.composite
def mutated_words(draw: Callable[..., Any], good: str) -> Content:
    """A text (XML, JSON, DBC) with another word, without a line or its end, or with a line twice."""
    kind = draw(st.sampled_from(["word", "word", "word", "drop", "twice", "cut", "bytes", "encoding"]))
    lines = good.splitlines(keepends=True)
    at = draw(LINES) % len(lines)
    if kind == "word":
        words = list(re.finditer(r"[\w.]+", good))
        word = words[draw(LINES) % len(words)]
        other = draw(st.sampled_from((*ODD_CELLS, "0x", "-0x7fffffffffffffff", "9" * 30, '"', "<", "&x;", "null")))
        return good[: word.start()] + other + good[word.end() :]
    if kind == "encoding":
        return good.encode(draw(st.sampled_from(["utf-16", "utf-32", "cp500"])))
    if kind == "cut":
        return good[: draw(LINES) % len(good)]
    if kind == "bytes":
        return with_other_bytes(draw, good)
    lines[at : at + 1] = [] if kind == "drop" else [lines[at], lines[at]]
    return "".join(lines)


@st.composite
def mutated_bytes(draw: Callable[..., Any], good: Callable[[], bytes]) -> tuple[Blob, bool]:
    """A binary file that is cut, is something else, or has other bytes: most of them where its structure is."""
    data = bytearray(good())
    kind = draw(st.sampled_from(["bytes", "bytes", "bytes", "cut", "other", "longer"]))
    if kind == "cut":
        end = draw(LINES) % len(data)
        return Blob(data[:end]), end < HEADER
    if kind == "other":
        return Blob(
            draw(st.sampled_from([b"", b"x", b"\0" * 1000, b"PK\3\4", MAP.encode(), MAP.encode("utf-16")]))
        ), True
    if kind == "longer":
        return Blob(bytes(data) + draw(st.binary(max_size=9))), False
    for _ in range(draw(st.integers(1, 4))):
        within = draw(st.sampled_from([HEADER, len(data), len(data)]))
        at = draw(LINES) % within if draw(st.booleans()) else len(data) - 1 - draw(LINES) % min(2048, len(data))
        new = draw(st.binary(min_size=1, max_size=6))
        data[at : at + len(new)] = new
    return Blob(data), False


def means_another(content: Content, good: str) -> bool:
    """Whether a JSON file does not say what the good one says."""
    try:
        return bool(json.loads(content if isinstance(content, str) else content.decode()) != json.loads(good))
    except (ValueError, RecursionError):
        return True


def mutated_json(good: str) -> Changed:
    """A JSON file with a checksum: whatever changes its meaning must be refused."""
    return mutated_words(good).map(lambda content: (content, means_another(content, good)))


NOISE = mutated_words(samples.dbc()).map(lambda text: text if isinstance(text, str) else text.decode("latin-1"))
RECORDINGS = mutated_bytes(samples.recording) | unsure(
    NOISE.map(lambda text: Blob(samples.recording.__wrapped__(text)))
)
ELF = mutated_bytes(samples.elf)
IMAGES = mutated_bytes(samples.image)
BOUNDS = mutated(samples.PORT)
MOTORS: dict[str, Changed] = {"m/motor.toml": mutated(MOTOR), "m/flux_map.csv": unsure(mutated_map())}
MAPS = mutated_map() | mutated_table("# made\nId;Iq;Psi d;Psi q\nA;A;Vs;Vs\n" + MAP.partition("\n")[2])
# Command: file: mutations.
FILES: dict[str, dict[str, Changed]] = {
    "campaign": {"in.toml": mutated(samples.CAMPAIGN)},
    "faults": {"in.toml": mutated(samples.FAULTS), "fmea.csv": unsure(mutated_table(samples.FMEA))},
    "sim": {"in.toml": mutated(samples.SCENARIO)},
    "vecu": MOTORS, "motor check": MOTORS, "motor build": MOTORS, "live": MOTORS, "commission": MOTORS,
    # What comes with the work, here: the emulator's loader refuses an image, its simulation the names in a scenario.
    "emulate": {"in.toml": unsure(mutated(samples.SCENARIO).map(lambda changed: changed[0])),
                "image.elf": unsure(IMAGES.map(lambda changed: changed[0]))},
    "motor import": {"m/motor.toml": mutated(MOTOR), "map.csv": unsure(MAPS)},
    "scope": {"image.elf": ELF}, "a2l": {"image.elf": ELF}, "target version": {"image.elf": ELF},
    "wcet": {"image.elf": unsure(IMAGES.map(lambda changed: changed[0]))},
    "log": {"drive.mf4": RECORDINGS},
    "target registers": {"chip.svd": unsure(mutated_words(port_samples.SVD)), "list.toml": mutated(samples.LIST)},
    "target seal": {"image.elf": IMAGES},
    "target size": {"image.elf": IMAGES, "port/budget.toml": BOUNDS},
    "target fits": {"motor.json": unsure(mutated_words(samples.motor_json())), "port/budget.toml": BOUNDS},
}  # fmt: skip
# Options with which a command reads a file that its valid call does not: further arguments, and the mutations.
MORE_FILES: dict[tuple[str, str], tuple[tuple[str, ...], Changed]] = {
    ("live", "drive.mf4"): (("--motor", "hsm1", "--replay", "drive.mf4"), RECORDINGS),
    ("live", "image.elf"): (("--motor", "hsm1", "--can-interface", "virtual", "--elf", "image.elf"), ELF),
    ("scope", "image.elf"): (("--can-interface", "virtual", "--elf", "image.elf"), ELF),
    ("commission", "w/steps.json"): (("--work", "w", "--resume"), mutated_json(samples.steps())),
    ("motor import", "loss.csv"): (
        ("--iron-loss", "loss.csv"),
        unsure(mutated_table("speed,loss\n1000,24\n2000,56\n3000,96\n")),
    ),
}
