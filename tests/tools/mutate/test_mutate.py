# SPDX-License-Identifier: Apache-2.0
"""A test that leaves a hole: its mutants are found, and the list accepts only what is true."""

import subprocess
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.mutate import cli, listed, page, score
from fluxtrue_tools.mutate.changed import changed
from fluxtrue_tools.mutate.operators import mutants
from fluxtrue_tools.mutate.programs import Build
from fluxtrue_tools.mutate.run import EQUIVALENT, KILLED, SURVIVED, TIMED_OUT

FILE = "firmware/part/hole.c"
SOURCE = """#include <stdbool.h>

bool is_above(int x, int limit)
{
    return x > limit;
}

unsigned bits_of(unsigned x)
{
    unsigned bits = 0U;
    while (x != 0U) {
        x >>= 1;
        bits++;
    }
    return bits;
}

int least(int a, int b)
{
    return ((a < b) ? a : b) + 0;
}
"""
TEST = """#include <stdbool.h>
bool is_above(int x, int limit);
unsigned bits_of(unsigned x);
int least(int a, int b);
int main(void)
{
    const bool good = bits_of(5U) == 3U && bits_of(0U) == 0U && least(1, 2) == 1 && least(4, 3) == 3;
    return (good && is_above(4, 3) && !is_above(2, 3)) ? 0 : 1;
}
"""
NO_ERROR = "return ((a <= b) ? a : b) + 0;"  # but the compiler does not know
CMAKE = """cmake_minimum_required(VERSION 3.25)
project(hole C)
set(CMAKE_C_FLAGS "-O2 -g")
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
enable_testing()
add_library(part STATIC firmware/part/hole.c)
add_executable(unit_part_hole test.c)
target_link_libraries(unit_part_hole PRIVATE part)
add_test(NAME unit_part_hole COMMAND unit_part_hole)
set_tests_properties(unit_part_hole PROPERTIES LABELS unit)
"""
LIST = """[[strict]]
name = "part"
files = ["firmware/part/*"]

[[equivalent]]
file = "firmware/part/hole.c"
function = "is_above"
before = "return x > limit;"
after = ["return {};"]
reason = "planted"
"""


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A source, a weak test and their build."""
    root = tmp_path_factory.mktemp("project").resolve()
    (root / "firmware" / "part").mkdir(parents=True)
    (root / FILE).write_text(SOURCE, encoding="utf-8")
    (root / "test.c").write_text(TEST, encoding="utf-8")
    (root / "CMakeLists.txt").write_text(CMAKE, encoding="utf-8")
    subprocess.run(["cmake", "-G", "Ninja", "-S", root, "-B", root / "out"], check=True, capture_output=True)
    subprocess.run(["ninja", "-C", root / "out"], check=True, capture_output=True)
    return root


Measure = Callable[[], cli.Campaign]


@pytest.fixture
def measure(project: Path) -> Measure:
    """Measure everything with the list that the project has now."""

    def measured() -> cli.Campaign:
        build = Build(project, project / "out")
        build.make(build.programs, 1)
        campaign = cli.Campaign(project, build, listed.load(project), fresh=False, jobs=1)
        every, _ = mutants(project, FILE)
        campaign.measure(FILE, every, every)
        return campaign

    return measured


def write_list(project: Path, after: str) -> None:
    """List one mutant of is_above() as equivalent."""
    path = project / listed.FILE
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(LIST.format(after), encoding="utf-8")


def outcomes(campaign: cli.Campaign) -> dict[str, str]:
    """The outcomes by the line after the error."""
    return {result.mutant.after: outcome for result, outcome in campaign.classified()}


def test_the_hole_is_found_and_only_the_hole(measure: Measure) -> None:
    campaign = measure()
    found = outcomes(campaign)
    survivors = {after for after, outcome in found.items() if outcome == SURVIVED}
    assert survivors == {"return x >= limit;", NO_ERROR}
    assert found["return x <= limit;"] == found["return 0;"] == KILLED
    assert found["return ((a < b) ? a : b) - 0;"] == EQUIVALENT, "the compiler makes the same object of both"
    endless = [result for result in campaign.results if result.mutant.before == "x >>= 1;"]
    assert TIMED_OUT in {result.outcome for result in endless}


def test_outcomes_are_kept_until_the_test_changes(project: Path, measure: Measure) -> None:
    measure()
    assert all(result.cached for result in measure().results)
    (project / "test.c").write_text(TEST.replace("is_above(4, 3)", "is_above(4, 3) && !is_above(3, 3)"),
                                    encoding="utf-8")  # fmt: skip
    campaign = measure()
    assert outcomes(campaign)["return x >= limit;"] == KILLED, "the hole is closed"
    assert outcomes(campaign)[NO_ERROR] == SURVIVED
    (project / "test.c").write_text(TEST, encoding="utf-8")
    assert outcomes(measure())["return x >= limit;"] == SURVIVED


def test_a_listed_survivor_counts_as_equivalent(project: Path, measure: Measure) -> None:
    write_list(project, "x >= limit")
    assert outcomes(measure())["return x >= limit;"] == score.LISTED


def test_a_listed_mutant_that_a_test_notices_is_wrongly_listed(project: Path, measure: Measure) -> None:
    write_list(project, "x <= limit")
    campaign = measure()
    assert len(score.wrongly_listed(campaign.results, campaign.listed)) == 1


def test_a_listed_mutant_that_does_not_exist_is_refused(project: Path) -> None:
    write_list(project, "x + limit")
    every, _ = mutants(project, FILE)
    with pytest.raises(FluxtrueError, match="no such mutant"):
        cli.check(listed.load(project), {FILE: every})


def test_a_test_that_fails_without_a_mutant_measures_nothing(project: Path, measure: Measure) -> None:
    (project / "test.c").write_text(TEST.replace("== 3U", "== 4U"), encoding="utf-8")
    try:
        with pytest.raises(FluxtrueError, match="unit_part_hole fails without a mutant"):
            measure()
    finally:
        (project / "test.c").write_text(TEST, encoding="utf-8")


OWN = """add_executable(unit_part_own own.c firmware/part/hole.c)
target_compile_definitions(unit_part_own PRIVATE OFFSET=1)
add_test(NAME unit_part_own COMMAND unit_part_own)
set_tests_properties(unit_part_own PROPERTIES LABELS unit)
"""
OWN_SOURCE = """#ifndef OFFSET
#define OFFSET 0
#endif
int moved(int x);
int moved(int x)
{
    return x + 2 * OFFSET;
}
"""


def test_a_test_that_compiles_the_source_with_other_definitions_finds_what_only_they_show(tmp_path: Path) -> None:
    root = tmp_path.resolve()
    (root / "firmware" / "part").mkdir(parents=True)
    (root / FILE).write_text(OWN_SOURCE, encoding="utf-8")
    call = "int moved(int x);\nint main(void) {{ return moved(3) == {} ? 0 : 1; }}\n"
    (root / "test.c").write_text(call.format(3), encoding="utf-8")
    (root / "own.c").write_text(call.format(5), encoding="utf-8")
    (root / "CMakeLists.txt").write_text(CMAKE + OWN, encoding="utf-8")
    subprocess.run(["cmake", "-G", "Ninja", "-S", root, "-B", root / "out"], check=True, capture_output=True)
    subprocess.run(["ninja", "-C", root / "out"], check=True, capture_output=True)
    campaign = cli.Campaign(root, Build(root, root / "out"), listed.load(root), fresh=False, jobs=1)
    every, _ = mutants(root, FILE)
    found = {result.mutant.after: result for result in campaign.measure(FILE, every, every)}
    assert found["return x + 3 * OFFSET;"].outcome == KILLED, "not an equal object: the other program's differs"
    assert found["return x + 3 * OFFSET;"].by == "unit_part_own"
    assert found["return (__typeof__(x + 2 * OFFSET)){0};"].by == "unit_part_hole"


def test_a_sample_of_each_part_does_not_depend_on_the_other_parts(project: Path) -> None:
    every, _ = mutants(project, FILE)
    known = listed.Listed(listed.List())
    others = {"firmware/other/a.c": every, "firmware/part/hole.c": every}
    together = cli._sample_each(others, 5, 3, known)
    assert [len(chosen) for chosen in together.values()] == [5, 5]
    assert together[FILE] == cli._sample_each({FILE: every}, 5, 3, known)[FILE]
    assert together[FILE] != cli._sample_each({FILE: every}, 5, 4, known)[FILE]


def test_an_estimate_weighs_each_part_by_its_errors() -> None:
    """By hand: 80 and 25 errors, 8 of 8 and 4 of 5 found; variances 0.9 * 0.1 / 8 * 0.9 and 5/7 * 2/7 / 5 * 0.8."""
    found = {"a": score.Score(Counter({KILLED: 8, EQUIVALENT: 2})),
             "b": score.Score(Counter({KILLED: 3, TIMED_OUT: 1, SURVIVED: 1, score.DUPLICATE: 5})),
             "none": score.Score(Counter({EQUIVALENT: 1}))}  # fmt: skip
    estimate = score.estimate(found, {"a": 100, "b": 50, "none": 9})
    assert estimate.share == pytest.approx(100 / 105)
    assert estimate.half_width == pytest.approx(0.1723, abs=1e-4)
    assert str(estimate) == "95.2% found, with a confidence of 95 % between 78.0% and 100.0%"


def test_the_page_shows_each_sample_as_it_was_measured_first() -> None:
    samples = [listed.Sample(seed=1, found={"a": [3, 4], "b": [5, 5]}), listed.Sample(seed=2, found={"a": [4, 4]})]
    text = page.write({}, {}, Counter(), listed.Listed(listed.List(sample=samples)))
    assert "| part | seed 1 | seed 2 |" in text
    assert "| `a` | 3 of 4, 75.0 % | 4 of 4, 100.0 % |" in text
    assert "| `b` | 5 of 5, 100.0 % |  |" in text
    assert "| all of these | 8 of 9, 88.9 % | 4 of 4, 100.0 % |" in text


def test_changed_files_are_those_that_differ_from_the_merge_base(tmp_path: Path) -> None:
    def git(*words: str) -> None:
        subprocess.run(["git", "-C", tmp_path, "-c", "user.name=a", "-c", "user.email=a@b", *words], check=True,
                       capture_output=True)  # fmt: skip

    files = ["a.c", "b.c", "c.c"]
    git("init", "-q", "-b", "main")
    for file in files:
        (tmp_path / file).write_text("1\n", encoding="utf-8")
    git("add", ".")
    git("commit", "-q", "-m", "first")
    git("checkout", "-q", "-b", "change")
    (tmp_path / "a.c").write_text("2\n", encoding="utf-8")
    git("commit", "-q", "-a", "-m", "second")
    (tmp_path / "b.c").write_text("2\n", encoding="utf-8")
    (tmp_path / "new.c").write_text("1\n", encoding="utf-8")
    assert changed(tmp_path, "main", [*files, "new.c"]) == ["a.c", "b.c", "new.c"]
    assert changed(tmp_path, "no-such-branch", files) is None
