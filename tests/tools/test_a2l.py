# SPDX-License-Identifier: Apache-2.0
"""The A2L file: its contents as two independent readers find them, and refusal of files that are not firmware."""

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pya2l
import pytest
from click.testing import CliRunner

from fluxtrue_tools.a2l.cli import ANSWER_ID, COMMAND_ID, a2l, render
from fluxtrue_tools.a2l.elf import read
from fluxtrue_tools.errors import FluxtrueError

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ["FLUXTRUE_BUILD_DIR"]) / "motors" / "hsm1" / "fluxtrue_vecu"
LISTS = ROOT / "firmware" / "calibration"


def _listed(header: str) -> list[str]:
    return re.findall(r"^ +X\((\w+),", (LISTS / header).read_text(), re.MULTILINE)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The virtual ECU's description file."""
    path = tmp_path_factory.mktemp("a2l") / "fluxtrue.a2l"
    path.write_text(render(read(PROGRAM), PROGRAM.name))
    return path


def test_every_declared_value_and_measurement_is_described_in_the_order_of_the_source() -> None:
    description = read(PROGRAM)
    assert [value.name for value in description.values] == [
        *_listed("calibration_list.h"),
        *_listed("mrai/mrai_calibration_list.h"),
    ]
    assert [value.name for value in description.measurements] == _listed("measurement_list.h")


def test_the_freeze_frame_is_described_with_its_samples() -> None:
    frozen = {value.name: value for value in read(PROGRAM).frozen}
    samples = [name for name, value in frozen.items() if value.count]
    assert samples == [f"freeze_{name}" for name in _listed("freeze_frame.h")]
    assert all(frozen[name].count == 32 for name in samples)
    assert (frozen["freeze_i_q_A"].base, frozen["freeze_i_q_A"].unit) == ("CURRENT", "A")
    assert frozen["freeze_time_ms"].count == 0


# The cycle as a whole number of units; XCP codes of the units: 6 is 1 ms, 4 is 10 us.
@pytest.mark.parametrize(("step_s", "cycle"), [(1e-3, "1 6"), (22 / 22500, "98 4"), (5 / 4500, "111 4")])
def test_the_raster_of_a_step_is_described_with_the_step_s_true_length(step_s: float, cycle: str) -> None:
    description = read(PROGRAM)
    assert description.step_s == pytest.approx(1e-3)  # 10 kHz
    text = render(replace(description, step_s=step_s), PROGRAM.name)
    assert f'EVENT "step" "step" 0 DAQ 4 {cycle} 0' in text


def test_limits_and_units_are_those_of_the_declaration() -> None:
    by_name = {value.name: value for value in read(PROGRAM).values}
    assert (by_name["observer_m"].lo, by_name["observer_m"].hi) == (2.0, 4.0)
    assert by_name["flux_bandwidth_rad_s"].hi == 500.0
    assert by_name["flux_bandwidth_rad_s"].unit == "rad/s"


def test_per_unit_measurements_are_converted_by_the_motor_s_own_bases() -> None:
    description = read(PROGRAM)
    factors = {base.name: base.factor for base in description.bases}
    assert factors["CURRENT"] == pytest.approx(400.0 / 32768.0)  # the converter's full scale in motor.toml
    current = next(value for value in description.measurements if value.name == "i_q_A")
    assert (current.base, current.unit, current.lo) == ("CURRENT", "A", -400.0)


def test_the_identifiers_are_the_firmware_s() -> None:
    text = (LISTS / "xcp_access.h").read_text()
    assert f"XCP_ID_COMMAND 0x{COMMAND_ID:X}U" in text
    assert f"XCP_ID_ANSWER 0x{ANSWER_ID:X}U" in text


def test_a2ltool_finds_nothing_to_complain_about(written: Path) -> None:
    tool = Path(sys.executable).with_name("a2ltool")
    done = subprocess.run([tool, "--check", "--strict", written], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "No problems found" in done.stdout, done.stdout + done.stderr


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_pya2l_reads_addresses_limits_and_types(written: Path) -> None:
    session = pya2l.import_a2l(str(written), in_memory=True)
    description = read(PROGRAM)
    for value in description.values:
        found = session.query(pya2l.model.Characteristic).filter_by(name=value.name).one()
        assert (found.address, found.type) == (value.address, "VALUE")
        assert (found.lowerLimit, found.upperLimit) == pytest.approx((value.lo, value.hi))
    for value in description.measurements + description.frozen:
        found = session.query(pya2l.model.Measurement).filter_by(name=value.name).one()
        assert found.ecu_address.address == value.address
    session.close()


@pytest.mark.parametrize(("content", "wanted"), [
    (None, "No such file"),
    (b"not an ELF file at all", "not an ELF file"),
    (b"\x7fELF", "not an ELF file"),
])  # fmt: skip
def test_a_file_that_is_no_firmware_is_refused(tmp_path: Path, content: bytes | None, wanted: str) -> None:
    path = tmp_path / "bad.elf"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(FluxtrueError, match=f"bad.elf: .*{wanted}"):
        read(path)


def test_an_elf_file_without_the_declarations_is_refused() -> None:
    with pytest.raises(FluxtrueError, match=r"no section '.a2l'"):
        read(Path("/bin/true"))


def test_an_elf_file_with_empty_declarations_is_refused(tmp_path: Path) -> None:
    (tmp_path / "nothing").write_bytes(b"")
    emptied = tmp_path / "bad.elf"
    update = f"--update-section=.a2l={tmp_path / 'nothing'}"
    subprocess.run(["objcopy", "--strip-debug", update, PROGRAM, emptied], check=True)
    with pytest.raises(FluxtrueError, match=r"bad.elf: section '.a2l' has no value to calibrate"):
        read(emptied)


def test_the_command_writes_the_file_or_nothing(tmp_path: Path) -> None:
    out = tmp_path / "x.a2l"
    done = CliRunner().invoke(a2l, [str(PROGRAM), "--out", str(out)], catch_exceptions=False)
    assert done.exit_code == 0 and out.read_text().startswith("ASAP2_VERSION")
    missing = tmp_path / "no" / "x.a2l"
    done = CliRunner().invoke(a2l, [str(PROGRAM), "--out", str(missing)])
    assert done.exit_code != 0 and not missing.parent.exists()
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.a2l"]
