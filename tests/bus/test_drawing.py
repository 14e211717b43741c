# SPDX-License-Identifier: Apache-2.0
"""The drawing in the documentation agrees with the state machine's table, and the DBC names the same states."""

import subprocess
import sys

from ecu import load_dbc

from fluxtrue_tools.bus.states import PAGE, TABLE, draw, read_table, with_drawing


def test_the_page_shows_the_table_that_runs() -> None:
    done = subprocess.run([sys.executable, "-m", "fluxtrue_tools.bus.states", "--check"],
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 0, done.stdout


def test_a_changed_table_changes_the_drawing(tmp_path) -> None:
    changed = tmp_path / "table.c"
    changed.write_text(TABLE.read_text().replace("{STATE_SAFE_STATE, WHEN_SLOW, STATE_FAULT}",
                                                 "{STATE_SAFE_STATE, WHEN_SLOW, STATE_READY}"))  # fmt: skip
    page = PAGE.read_text()
    assert with_drawing(page, draw(read_table(changed))) != page


def test_the_bus_knows_every_state_of_the_drawing_by_its_name() -> None:
    choices = load_dbc().get_message_by_name("INV_Status").get_signal_by_name("State").choices
    drawn = {name for row in read_table(TABLE) for name in (row.source, row.target)}
    assert {str(value) for value in choices.values()} == drawn
