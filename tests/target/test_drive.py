# SPDX-License-Identifier: Apache-2.0
"""The whole drive on an emulated Cortex-M4: in every period its outputs are bit for bit those of the host."""

from __future__ import annotations

from pathlib import Path

import pytest

from fluxtrue_tools.bench import build, drive

PERIODS_MIN = 2000


class Recorder(drive.Target):
    """Records every call, so that the same calls can be made on the host."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.calls: list[tuple[str, tuple[int, ...]]] = []

    def call(self, symbol: str, *arguments: int) -> int:
        self.calls.append((symbol, arguments))
        return super().call(symbol, *arguments)


def _run(processor: drive.Processor, mode: int) -> list[list[int]]:
    """Outputs after every period of the closed loop."""
    trace = []
    for _ in drive.periods(processor, mode):
        processor.call("bench_fast_isr")
        processor.call("bench_mrai_isr")
        trace.append(processor.outputs())
    return trace


@pytest.fixture(scope="module", params=[drive.PAPER, drive.ROBUST], ids=["paper", "robust"])
def recorder(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Recorder, list[list[int]]]:
    if not build.have_arm_compiler():
        pytest.skip(f"{build.ARM_CC} is not installed: nothing is compiled for the target")
    target = Recorder(drive.build_drive(tmp_path_factory.mktemp("target")))
    return target, _run(target, request.param)


def test_target_and_host_agree_bit_for_bit_through_a_drive_cycle(
    recorder: tuple[Recorder, list[list[int]]], tmp_path: Path
) -> None:
    target, target_outputs = recorder
    # Undefined behaviour ends the run with a message.
    flags = ("-fsanitize=undefined", "-fno-sanitize-recover=all")
    host = drive.Host(drive.build_drive_host(tmp_path, flags))
    host_outputs = []
    for symbol, arguments in target.calls:
        host.call(symbol, *arguments)
        if symbol == "bench_mrai_isr":
            host_outputs.append(host.outputs())
    assert len(target_outputs) >= PERIODS_MIN
    differing = [k for k, (a, b) in enumerate(zip(host_outputs, target_outputs, strict=True)) if a != b]
    assert not differing, (
        f"period {differing[0]}: host {host_outputs[differing[0]]}, target {target_outputs[differing[0]]}"
    )


def test_the_cycle_has_torque_of_both_signs_reaches_the_voltage_limit_and_ends_without_a_fault(
    recorder: tuple[Recorder, list[list[int]]],
) -> None:
    _, trace = recorder
    gates, faults = 3, 13  # positions among the outputs
    settled = trace[drive.WARM_UP :]
    assert all(row[gates] == 1 for row in settled)
    assert trace[-1][faults] == 0
    assert min(row[5] for row in settled) < -2000 < 2000 < max(row[5] for row in settled)  # i_q
    assert len({tuple(row[:3]) for row in settled}) > PERIODS_MIN // 2
    voltage_squared = [row[9] ** 2 + row[10] ** 2 for row in settled]  # u_d, u_q
    assert max(voltage_squared) > (0.55 * 350 / 525 * 32768) ** 2
    assert max(abs(row[21]) for row in settled) > 0  # the magnet is being identified
