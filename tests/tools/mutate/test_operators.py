# SPDX-License-Identifier: Apache-2.0
"""Which errors are made in a C source, and what is left out."""

from collections import Counter
from pathlib import Path

import pytest

from fluxtrue_tools.mutate.mutant import Mutant
from fluxtrue_tools.mutate.operators import ASSERTION, MACRO, TABLE, mutants, other_numbers


def made(tmp_path: Path, text: str, name: str = "a.c") -> list[Mutant]:
    """The mutants of a text."""
    (tmp_path / name).write_text(text, encoding="utf-8")
    return mutants(tmp_path, name)[0]


def after(tmp_path: Path, body: str) -> set[str]:
    """What becomes of the only line of a function's body."""
    found = made(tmp_path, f"int f(int a, int b, int *c)\n{{\n    {body}\n}}\n")
    assert {mutant.before for mutant in found} == {body}
    assert {mutant.function for mutant in found} == {"f"}
    return {mutant.after for mutant in found}


ZERO = "(__typeof__({})){{0}}"


@pytest.mark.parametrize(
    ("body", "wanted"),
    [
        ("return a < b;", {"return a <= b;", "return a >= b;", "return 1;", "return 0;"}),
        ("return a == b;", {"return a != b;", "return 1;", "return 0;"}),
        ("return a && b;", {"return a || b;", "return a;", "return b;", "return 1;", "return 0;"}),
        ("return !a;", {"return a;", "return 1;", "return 0;"}),
        ("return a + b;", {"return a - b;", f"return {ZERO.format('a + b')};"}),
        ("return a << b;", {"return a >> b;", f"return {ZERO.format('a << b')};"}),
        ("return a | b;", {"return a & b;", "return a;", "return b;", f"return {ZERO.format('a | b')};"}),
        ("return 7;", {"return 8;", "return 0;"}),
        ("return true;", {"return false;"}),
        ("*c = a;", {";"}),
        ("(void)g(a);", {";"}),
        ("a += b;", {"a -= b;", ";"}),
        ("if (a) g();", {"if (1) g();", "if (0) g();", "if (a) ;"}),
        ("while (a) g();", {"while (0) g();", "while (a) ;"}),
        ("return a ? b : *c;", {"return 1 ? b : *c;", "return 0 ? b : *c;", f"return {ZERO.format('a ? b : *c')};"}),
        ("const int d = g(a);", {f"const int d = {ZERO.format('g(a)')};"}),
        ("const bool d = a < b;", {"const bool d = a <= b;", "const bool d = a >= b;", "const bool d = 1;",
                                   "const bool d = 0;"}),
        ("*s = (t){.x = a, .y = {b}};", {";", "*s = (t){.x = 0, .y = {b}};", "*s = (t){.x = a, .y = {0}};"}),
    ],
)  # fmt: skip
def test_every_operator(tmp_path: Path, body: str, wanted: set[str]) -> None:
    assert after(tmp_path, body) == wanted


@pytest.mark.parametrize(
    ("text", "wanted"),
    [("0", ("1",)), ("10U", ("11U", "0U")), ("0x1DU", ("0x1EU", "0U")), ("0.5", ("0.45", "0.0")), ("abc", ())],
)
def test_constants(text: str, wanted: tuple[str, ...]) -> None:
    assert other_numbers(text) == wanted


def test_an_operator_that_binds_less_keeps_the_operands_of_its_neighbours(tmp_path: Path) -> None:
    found = after(tmp_path, "return (a | b) == (a & (b ^ a)) && b;")
    assert "return (a & b) == (a & (b ^ a)) && b;" in found
    assert {"return (a || b) && b;", "return (a && b) || b;"} <= after(tmp_path, "return a && b && b;")


def test_constants_of_the_source_are_changed_where_they_are_defined(tmp_path: Path) -> None:
    found = made(tmp_path, "#define LIMIT 10U /* of something */\n#define PART Q15(0.5)\nenum { STEPS = 3 };\n")
    assert {mutant.after for mutant in found} == {
        "#define LIMIT 11U /* of something */", "#define LIMIT 0U /* of something */",
        "#define PART Q15(0.45)", "#define PART Q15(0.0)", "enum { STEPS = 4 };", "enum { STEPS = 0 };",
    }  # fmt: skip


def test_rows_of_a_table_are_deleted(tmp_path: Path) -> None:
    found = made(tmp_path, "const row_t rows[] = {\n    {A, B | C},\n    {D, E},\n};\n")
    assert {(mutant.before, mutant.after) for mutant in found if mutant.edit.operator == "row deleted"} == {
        ("{A, B | C},", ""), ("{D, E},", ""),
    }  # fmt: skip
    assert ("{A, B | C},", "{A, B},") in {(mutant.before, mutant.after) for mutant in found}


def test_what_is_left_out_is_counted(tmp_path: Path) -> None:
    numbers = ", ".join(map(str, range(40)))
    text = f'#define F(x) ((x) + 1)\n_Static_assert(1 < 2, "");\nconst int table[40] = {{{numbers}}};\nint a[3];\n'
    (tmp_path / "a.c").write_text(text, encoding="utf-8")
    found, excluded = mutants(tmp_path, "a.c")
    assert not found
    assert excluded[MACRO] == excluded[ASSERTION] == excluded[TABLE] == 1


def test_a_mutant_is_named_without_its_line(tmp_path: Path) -> None:
    text = "int f(int a)\n{\n    a++;\n    a++;\n    return a;\n}\n"
    names = [mutant.name for mutant in made(tmp_path, text)]
    assert len(set(names)) == len(names)
    assert [mutant.name for mutant in made(tmp_path, f"/* new */\n\n{text}")] == names
    assert Counter(order for *_, order in names)[1] == 2


def test_a_mutant_has_the_lines_of_its_source(tmp_path: Path) -> None:
    text = "int f(int a)\n{\n    g(a,\n      a);\n    return a;\n}\n"
    for mutant in made(tmp_path, text):
        assert mutant.edit.apply(text.encode()).count(b"\n") == text.count("\n")
