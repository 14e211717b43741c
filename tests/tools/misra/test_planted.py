# SPDX-License-Identifier: Apache-2.0
"""Each enabled rule is violated in planted/*.c, at a line that names it, and the add-on finds it there."""

import re
import shutil
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tools" / "checks"))
from misra_deviations import Rules, read, rule_key  # noqa: E402
from misra_run import Analysis, analyse, digest, implemented  # noqa: E402

PLANTED = Path(__file__).with_name("planted")
MARK = re.compile(r"/\* (?:.* )?rules? (\d+\.\d+(?:, \d+\.\d+)*) \*/")


@pytest.fixture(scope="module")
def rules() -> Rules:
    """What the project enables."""
    return read((ROOT / "docs/safety/misra.toml").read_text(encoding="utf-8"))


def marked() -> set[tuple[str, int, str]]:
    """File, line and rule of every mark."""
    return {
        (path.name, number, rule)
        for path in sorted(PLANTED.iterdir())
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        for match in MARK.finditer(line)
        for rule in match.group(1).split(", ")
    }


def test_every_rule_of_the_addon_is_enabled_or_left_out_with_a_reason(rules: Rules) -> None:
    assert implemented() == set(rules.enabled) | rules.disapplied.keys()
    assert list(rules.faults(Path("misra.toml"), implemented())) == []


def test_every_enabled_rule_is_planted(rules: Rules) -> None:
    assert sorted(set(rules.enabled) - {rule for _, _, rule in marked()}, key=rule_key) == []


def test_every_planted_violation_is_found_at_its_line(tmp_path: Path) -> None:
    folder = tmp_path / "planted"
    shutil.copytree(PLANTED, folder)
    found = analyse(Analysis(tmp_path, (folder,), ("PLANTED=1",), 1), sorted(folder.glob("*.c")), True)
    assert marked() - {(Path(one.path).name, one.line, one.rule) for one in found} == set()


def test_the_findings_do_not_depend_on_where_the_checkout_is(tmp_path: Path) -> None:
    seen = set()
    for place in ("here", "a/longer/place"):
        folder = tmp_path / place / "planted"
        shutil.copytree(PLANTED, folder)
        analysis = Analysis(tmp_path / place, (folder,), ("PLANTED=1",), 1)
        assert str(tmp_path) not in " ".join(analysis.options)
        seen.add(digest(analysis, sorted(folder.glob("*.c"))[0]))
    assert len(seen) == 1
