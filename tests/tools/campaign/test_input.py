# SPDX-License-Identifier: Apache-2.0
"""A bad campaign file is refused with one line that names file, key, value and what is allowed."""

from pathlib import Path

import pytest
from conftest import SMALL, campaign

from fluxtrue_tools.campaign.spec import Campaign, parse, read
from fluxtrue_tools.errors import FluxtrueError

LQ, CHECKED = "[spread]\nlq_scale", "[check]\ncontrollers"
BAD = [
    ("unknown key", "cases = 4", "cases = 4\nplants = 3", "plants: unknown key, allowed: motor, cases, seed"),
    ("unknown nested key", "[drive]", "[drive]\nspeed = 3", "drive.speed: unknown key, allowed: duration_s, vehicle"),
    ("unknown controller key", "warm_up = false", "warmup = false", "controller.0.warmup: unknown key, allowed"),
    ("wrong type", "cases = 4", 'cases = "many"', "cases = 'many'"),
    ("a fraction of a case", "cases = 4", "cases = 4.5", "cases = 4.5"),
    ("no case", "cases = 4", "cases = 0", "cases = 0"),
    ("a negative seed", "seed = 7", "seed = -7", "seed = -7"),
    ("missing field", "seed = 7", "", "seed: missing, wanted"),
    ("not valid TOML", "seed = 7", "seed = ", "not valid TOML"),
    ("not a number", "duration_s = 2", "duration_s = nan", "drive.duration_s"),
    ("an absurd drive", "duration_s = 2", "duration_s = 1e9", "drive.duration_s"),
    ("a reversed range", "[drive]", f"{LQ} = [1.1, 0.9]\n[drive]", "spread.lq_scale = [1.1, 0.9]: allowed: [low"),
    ("a range in percent", "[drive]", f"{LQ} = [90, 110]\n[drive]", "spread.lq_scale.0 = 90"),
    ("a range of one number", "[drive]", f"{LQ} = 1.0\n[drive]", "spread.lq_scale = 1.0: allowed: [low, high]"),
    ("a reversed band", "[[500, 6000, 1]]", "[[6000, 500, 1]]", "windows.speed_rpm: 6000 to 500"),
    ("a band without strata", "[[500, 6000, 1]]", "[[500, 6000]]", "windows.speed_rpm.0"),
    ("a controller twice", 'name = "paper"', 'name = "tables"', "controller: tables, tables, allowed: every name once"),
    ("an unknown checked one", "[drive]", f'{CHECKED} = ["robust"]\n[drive]', "check.controllers: 'robust', allowed"),
    ("no reference", "[drive]", f'{CHECKED} = ["paper"]\nreference = "x"\n[drive]', "check.reference: 'x', allowed"),
    ("a checked one in few", 'name = "tables"', 'name = "tables"\ncases = 2', "controller.0.cases: 2, allowed: for"),
    ("in no case", 'name = "paper"', 'name = "paper"\ncases = 0', "controller.1.cases = 0"),
    ("a plant's typo", "angle_bits = 12", "angle_bit = 12", "plant.angle_bit: unknown key"),
]


@pytest.mark.parametrize(("old", "new", "message"), [b[1:] for b in BAD], ids=[b[0] for b in BAD])
def test_a_bad_value_is_named_with_what_is_allowed(old: str, new: str, message: str) -> None:
    assert old in SMALL
    with pytest.raises(FluxtrueError) as error:
        parse(SMALL.replace(old, new, 1), "bad.toml")
    assert str(error.value).startswith("bad.toml: ")
    assert message in str(error.value)


CALLED = [
    ("a missing file", SMALL, ["nowhere.toml"], "nowhere.toml: cannot be read (No such file or directory)"),
    ("a motor that is not there", SMALL.replace("hsm1", "hsm2"), ["c.toml"], "c.toml: motor = 'hsm2': neither"),
    ("a drop below nothing", SMALL + "[spread]\ndevice_drop_error_V = [-2, 2]\n", ["c.toml"],
     "spread.device_drop_error_V = -2 about 1 V, allowed: no drop below 0"),
    ("a name no firmware has", SMALL.replace("{ torque_loop = true", "{ torque_lop = 1, torque_loop = true"),
     ["c.toml"], "c.toml: controller.1.set.torque_lop = 1: no such name, allowed: torque_loop"),
    ("a value no firmware takes", SMALL.replace("{ torque_loop = true", "{ observer_m = 99, torque_loop = true"),
     ["c.toml"], "c.toml: controller.1.set.observer_m = 99, allowed: 2 to 4"),
    ("a flag that is not there", SMALL + '[check]\ncount_nonzero = ["psi_clamp"]', ["c.toml"],
     "check.count_nonzero: 'psi_clamp': no such name, allowed: psi_clamped"),
    ("a case beyond the last", SMALL, ["c.toml", "--case", "4"], "--case 4, allowed: 0 to 3"),
    ("more cases than there are", SMALL, ["c.toml", "--cases", "5"], "--cases 5, allowed: up to the campaign's 4"),
    ("a plot of no format", SMALL, ["c.toml", "--case", "1", "--plot", "a.gif"], "allowed: a file ending in .png"),
    ("no scheduler", SMALL, ["c.toml", "--scheduler", "nonsense://x"], "--scheduler nonsense://x"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "arguments", "message"), [c[1:] for c in CALLED], ids=[c[0] for c in CALLED])
def test_bad_input_ends_in_one_line_exit_2_and_no_results(
    tmp_path: Path, text: str, arguments: list[str], message: str
) -> None:
    (tmp_path / "c.toml").write_text(text)
    result = campaign(*arguments, "--out", "out", cwd=tmp_path)
    assert result.returncode == 2, result.stderr
    assert message in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1, result.stderr
    assert not list(tmp_path.glob("out/**/*.parquet"))


SHIPPED = Path(__file__).resolve().parents[2] / "loop" / "campaign"


def test_no_two_shipped_campaigns_share_a_seed() -> None:
    seeds = [read(path).seed for path in SHIPPED.glob("*.toml")]
    assert len(seeds) >= 7
    assert len(set(seeds)) == len(seeds)


@pytest.mark.parametrize("name", ["ci", "development"])
def test_the_campaigns_of_the_measured_machine_differ_in_seed_and_size_only(name: str) -> None:
    def of_any_size(campaign: Campaign) -> Campaign:
        controllers = tuple(c.model_copy(update={"cases": None}) for c in campaign.controller)
        return campaign.model_copy(update={"seed": 0, "cases": 1, "controller": controllers})

    alike = [of_any_size(read(SHIPPED / f"{n}.toml")) for n in (name, "hsm1-500")]
    assert alike[0] == alike[1]
