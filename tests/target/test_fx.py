# SPDX-License-Identifier: Apache-2.0
"""The fixed-point library on an emulated Cortex-M4: same results as on the host, cost and error within their bounds."""

from __future__ import annotations

import ctypes
import re
from pathlib import Path

import numpy as np
import pytest
from unicorn import UC_HOOK_CODE

from fluxtrue_tools import bench
from fluxtrue_tools.bench import build, fx_cases, fx_tables
from fluxtrue_tools.bench.machine import Elf, Machine, instructions
from fluxtrue_tools.bench.peers import PEERS

ROWS = 30000
NAMES = sorted(
    line.split("(")[1].split(",")[0]
    for line in Path(build.FX_SOURCES[0]).read_text(encoding="utf-8").splitlines()
    if line.startswith(("KERNEL1(", "KERNEL2(", "KERNEL3("))
)


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not build.have_arm_compiler():
        pytest.skip(f"{build.ARM_CC} is not installed: nothing is compiled for the target")
    return build.build_target(tmp_path_factory.mktemp("target") / "fx.elf", build.FX_SOURCES)


@pytest.fixture(scope="module")
def machine(program: Path) -> Machine:
    return Machine(program)


@pytest.fixture(scope="module")
def results(machine: Machine) -> dict[str, bench.Result]:
    overhead = bench.call_overhead(machine)
    measured = bench.measure(machine, fx_cases.cases(), overhead)
    return {result.name: result for result in measured}


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The portable implementation; undefined behaviour ends the run with a message."""
    flags = ["-fsanitize=undefined", "-fno-sanitize-recover=all"]
    path = build.build_host(tmp_path_factory.mktemp("host") / "fx.so", build.FX_SOURCES, flags)
    return ctypes.CDLL(str(path))


@pytest.fixture(scope="module")
def rows() -> np.ndarray:
    """Every pair of corner values, every 16-bit number, and random numbers of all magnitudes."""
    rng = np.random.default_rng(7)
    corners = np.array(sorted({*fx_cases.CORNERS_Q15, *fx_cases.CORNERS_Q31, 32768, 65535, 31, 32}))
    pairs = np.stack([axis.ravel() for axis in np.meshgrid(corners, corners)], axis=1)
    pairs = np.column_stack([pairs, rng.permutation(pairs[:, 0])])
    every = np.column_stack([np.arange(-32768, 32768), rng.permutation(65536) - 32768, rng.permutation(65536) - 32768])
    random = rng.integers(-(2**31), 2**31, (ROWS, 3)) >> rng.integers(0, 32, (ROWS, 3))
    return np.ascontiguousarray(np.concatenate([pairs, every, random]), dtype=np.int32)


@pytest.mark.parametrize("name", NAMES)
def test_target_and_host_agree_bit_for_bit(name: str, program: Path, host: ctypes.CDLL, rows: np.ndarray) -> None:
    machine = Machine(program)
    host_results = np.empty(len(rows), dtype=np.int64)
    function = getattr(host, f"batch_{name}")
    function(rows.ctypes.data_as(ctypes.c_void_p), host_results.ctypes.data_as(ctypes.c_void_p),
             ctypes.c_uint32(len(rows)))  # fmt: skip
    arguments = machine.place(rows.tobytes())
    answers = machine.place(bytes(8 * len(rows)))
    machine.call(f"batch_{name}", arguments, answers, len(rows))
    target_results = np.frombuffer(machine.read(answers, 8 * len(rows)), dtype=np.int64)
    differing = np.flatnonzero(host_results != target_results)
    first = differing[:1]
    assert differing.size == 0, f"{name}{rows[first]}: host {host_results[first]}, target {target_results[first]}"


def test_every_function_that_is_measured_is_also_compared(results: dict[str, bench.Result]) -> None:
    assert set(results) - {"sincos_struct"} <= set(NAMES)


# Not compared by themselves: functions that others of the library call, and functions without a result.
NOT_COMPARED = {
    "fx_compiler_barrier",
    "fx_axis",
    "fx_axis_position",
    "fx_cell_at",
    "fx_leading_zeros",
    "fx_load_pair",
    "fx_rsqrt_normalised",
    "fx_weights",
}
DEFINED = re.compile(r"^(?:__attribute__\(\(always_inline\)\) )?(?:static inline )?[a-z]\w+ (fx_\w+)\(", re.MULTILINE)


@pytest.mark.parametrize("where", ["tools/fluxtrue_tools/bench/fx_kernels.c", "tests/unit/fx"])
def test_every_function_of_the_library_is_compared_with_the_target_and_with_an_exact_reference(where: str) -> None:
    headers = [path for path in (build.FIRMWARE / "fx").glob("*.h") if not path.name.startswith("arch")]
    names = {name for path in headers for name in DEFINED.findall(path.read_text(encoding="utf-8"))} - NOT_COMPARED
    assert {"fx_mesh_cell", "fx_quotient", "fx_div_q31", "fx_add_q15"} <= names, "the pattern finds the functions"
    place = build.ROOT / where
    text = "".join(path.read_text(encoding="utf-8") for path in ([place] if place.is_file() else place.glob("*.c")))
    mentioned = set(re.findall(r"\bfx_\w+", re.sub(r'"[^"\n]*"', "", text)))
    assert sorted(names - mentioned) == []


# The product's own bounds. The cost is that of a call: saving registers counts, the return does not.
@pytest.mark.parametrize(
    ("name", "max_instructions", "max_error"),
    [
        ("sincos", 20, 4e-5),
        ("sincos_struct", 20, None),
        ("sqrt_q30", 50, 2.0**-15),
        ("magnitude", 50, 2.0**-15),
    ],
)
def test_cost_and_error_stay_within_their_bounds(
    results: dict[str, bench.Result], name: str, max_instructions: int, max_error: float | None
) -> None:
    result = results[name]
    assert result.maximum <= max_instructions
    if max_error is not None:
        assert result.error is not None and result.error <= max_error


@pytest.mark.parametrize("peer", PEERS, ids=lambda peer: peer.name)
def test_no_peer_is_both_faster_and_more_accurate(results: dict[str, bench.Result], peer: bench.peers.Peer) -> None:
    rivals = [result for result in results.values() if result.group == peer.function]
    assert rivals
    for result in rivals:
        faster = peer.instructions < result.maximum
        more_accurate = peer.error is None or peer.error < (result.error or 0.0)
        assert not (faster and more_accurate)


@pytest.mark.parametrize(
    ("name", "arguments"),
    [("sincos", (12345,)), ("sqrt_q30", (123456,)), ("leg", (-7, 9)), ("cell_sum", (40000, -3)),
     ("div_q31", (-5, 7)), ("five_tables", (40000, -3)), ("nothing", (0,))],
)  # fmt: skip
def test_counting_by_block_equals_counting_one_by_one(program: Path, name: str, arguments: tuple[int, ...]) -> None:
    by_block = Machine(program).count(f"bench_{name}", *arguments)[1]
    single = Machine(program)
    seen: list[int] = []
    single.uc.hook_add(UC_HOOK_CODE, lambda _uc, at, _size, _data: seen.append(at))
    single.call(f"bench_{name}", *arguments)
    # Only counting by block includes the instructions that an IT instruction (0xBFxx) skips: at most 4 for each IT.
    conditional = sum(single.read(at + 1, 1) == b"\xbf" for at in seen)
    assert len(seen) <= by_block <= len(seen) + 4 * conditional
    if conditional == 0:
        assert by_block == len(seen)


def test_instructions_of_two_and_four_bytes_are_told_apart() -> None:
    # bx lr; nop; smmlar r2, r1, r0, r3 (4 bytes); b.n
    code = bytes.fromhex("704700bf51fb1032fee7")
    assert instructions(code) == 4


def test_a_file_that_is_no_program_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "not.elf"
    path.write_bytes(b"\x7fELF\x02\x01 a 64-bit one")
    with pytest.raises(ValueError, match="not a 32-bit little-endian ELF"):
        Elf.read(path)


def test_committed_tables_are_what_their_formulas_give() -> None:
    for name, text in fx_tables.sources().items():
        assert (build.FIRMWARE / "fx" / name).read_text(encoding="utf-8") == text
