# SPDX-License-Identifier: Apache-2.0
"""Values of a command line: what each kind takes, and that files of other programs end with one message."""

from pathlib import Path
from typing import Any

import click
import pytest

from fluxtrue_tools import kinds, paths
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.foreign import reading
from fluxtrue_tools.strict import down

OPTION = click.Option(["--it"])


@pytest.mark.parametrize(
    ("kind", "text", "meaning"),
    [
        (kinds.Finite(), "-1.5", -1.5),
        (kinds.Finite(0.0, 1.0, max_open=True), "0", 0.0),
        (kinds.Text(), " ", " "),
        (kinds.Address(), "127.0.0.1:29537", ("127.0.0.1", 29537)),
        (kinds.Scheduler(), "tcp://host:8786", "tcp://host:8786"),
        (kinds.BusOption(), "port=29536", ("port", 29536)),
        (kinds.BusOption(), "host=a=b", ("host", "a=b")),
        (kinds.BusInterface(), "virtual", "virtual"),
        (kinds.LossPoint(), "0@1e3", (0.0, 1000.0)),
    ],
)
def test_a_value_has_its_meaning(kind: click.ParamType, text: str, meaning: Any) -> None:
    assert kind.convert(text, OPTION, None) == meaning


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        *((kinds.Finite(), text) for text in ("nan", "inf", "-inf", "1e999")),
        *((kinds.Address(), text) for text in ("", "host", "host:", ":1", "host:0", "host:65536", "a:b:1", "h:\u0661")),
        *((kinds.Scheduler(), text) for text in ("host:1", "tcp://", "://host:1", "tcp://host")),
        *((kinds.BusOption(), text) for text in ("", "x", "=1", "a b=1")),
        *((kinds.LossPoint(), text) for text in ("1", "1@", "-1@3000", "1@0", "1@-3000", "nan@1", "1@inf", "1@2@3")),
        (kinds.Text(), ""),
        (kinds.BusInterface(), "nonsense"),
    ],
)
def test_what_it_cannot_mean_is_refused_by_the_option_s_name(kind: click.ParamType, text: str) -> None:
    with pytest.raises(FluxtrueError, match="^--it .*: allowed: "):
        kind.convert(text, OPTION, None)


def test_the_help_names_a_range_only_where_there_is_one() -> None:
    with click.Context(click.Command("it")) as context:
        shown = [click.Option(["--it"], type=kind, default=0.0).get_help_record(context) or ("", "")
                 for kind in (kinds.Finite(), kinds.Finite(max=2.0), kinds.Finite(min=1.0, max=2.0))]  # fmt: skip
    assert [text for _, text in shown] == ["", "[x<=2.0]", "[1.0<=x<=2.0]"]


@pytest.mark.parametrize("text", ["missing", "file", "x" * 300])
def test_a_folder_to_read_must_be_one(tmp_path: Path, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(FluxtrueError, match="cannot be read"):
        paths.InputFolder().convert(text, OPTION, None)


def test_a_largest_value_is_rounded_down_to_four_digits_as_a_reader_writes_it() -> None:
    assert [repr(down(value)) for value in (304.47, 0.0123456, 123456.0, 5.0)] == ["304.4", "0.01234", "123400.0",
                                                                                  "5.0"]  # fmt: skip


def test_whatever_a_reader_raises_is_one_message() -> None:
    said = r"^a.mf4: not a log \(KeyError: 'a table of its own'\)$"
    with pytest.raises(FluxtrueError, match=said), reading("a.mf4", "a log"):
        raise KeyError("a table of its own")
