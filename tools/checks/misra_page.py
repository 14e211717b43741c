# SPDX-License-Identifier: Apache-2.0
"""The page docs/safety/misra.md, made from the data alone."""

import textwrap
from collections.abc import Iterator
from typing import Final

from misra_deviations import CATEGORIES, Entry, Rules, rule_key

HEAD: Final = """# MISRA C:2012, as far as a checker sees it

<!-- Written by `tools/checks/misra.py build/host --write` from docs/safety/misra.toml. -->

The check `check-misra` runs the MISRA add-on of the Cppcheck that `tools/requirements.txt` pins over `firmware`, as the
compiler for the Cortex-M4 sees it, and over the portable half of `fx`. Every finding is covered by an entry of
[misra.toml](misra.toml), and every entry covers a finding; anything else fails. An entry covers the lines that it
describes: another violation of the same rule in such a line passes. In `tests/tools/misra/planted` each enabled rule is
violated on purpose, and `tests/tools/misra` shows that the add-on finds it there.

    build/venv/bin/python tools/checks/misra.py build/host [FILE ...]

This is no claim of compliance with MISRA C:2012. The add-on implements a part of the rules, sees a part of what
violates them, and no directive; the rules that are not in this page are not checked by it. Ports (`hal/*/`), generated
code and tests are outside of the check. Rules are named by number; their text is in the document of MISRA.
"""


def _item(text: str) -> list[str]:
    return textwrap.wrap(f"- {text}", 120, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def _numbers(rules: Rules) -> Iterator[str]:
    yield "| category | rules of the add-on | enabled | left out | deviations | errors of the checker |"
    yield "|---|---|---|---|---|---|"
    total = [0] * 5
    for category in CATEGORIES:
        of = {rule for rule, name in rules.category.items() if name == category}
        entries = [entry for entry in rules.entries if entry.rule in of]
        row = [
            len(of), len(of & set(rules.enabled)), len(of & rules.disapplied.keys()),
            sum(not entry.of_tool for entry in entries), sum(entry.of_tool for entry in entries),
        ]  # fmt: skip
        total = [a + b for a, b in zip(total, row, strict=True)]
        yield f"| {category} | " + " | ".join(map(str, row)) + " |"
    yield "| all | " + " | ".join(map(str, total)) + " |"


def _outside(rules: dict[str, str]) -> Iterator[str]:
    for rule in sorted(rules, key=rule_key):
        yield from _item(f"{rule}: {rules[rule]}")


def _entries(entries: list[Entry], rules: Rules) -> Iterator[str]:
    for entry in sorted(entries, key=lambda one: rule_key(one.rule)):
        where = "everywhere" if entry.files == ("*",) else ", ".join(f"`{name}`" for name in entry.files)
        category = rules.category.get(entry.rule)
        yield from _item(f"{entry.rule} ({category}; {where}): {entry.reason} {entry.safe or entry.instead}")


def page(rules: Rules) -> str:
    """The whole page."""
    text = [HEAD, *_numbers(rules), "", "## Rules that are left out", "", *_outside(rules.disapplied)]
    for title, of_tool in (("Deviations", False), ("Errors of the checker", True)):
        text += ["", f"## {title}", "", *_entries([one for one in rules.entries if one.of_tool == of_tool], rules)]
    return "\n".join(text) + "\n"
