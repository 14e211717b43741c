# SPDX-License-Identifier: Apache-2.0
"""The wizard's rules without a browser and an inverter: order of the steps, consent, what a page may ask for."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from fluxtrue_tools.bus.interface import read_interface
from fluxtrue_tools.commission import plot
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.steps import Found, Step, chosen
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.control import NO_COMMANDS, OTHER, give_up, obey
from fluxtrue_tools.live.link import Status
from fluxtrue_tools.live.recorder import Recorder
from fluxtrue_tools.live.samples import Samples
from fluxtrue_tools.live.session import Session
from fluxtrue_tools.live.wizard.consent import GONE, Consent
from fluxtrue_tools.live.wizard.files import PICTURES
from fluxtrue_tools.live.wizard.wizard import Wizard

KNOWN = Nameplate(250.0, 9000.0, 0.008, 0.16, 4, 0.07, 7.0, 10.0)
TIMEOUT_S = 0.3


class Page:
    """A page's connection."""

    closed = False


@dataclass
class Bus:
    """In place of the process that measures."""

    acts: list[tuple[Any, ...]] = field(default_factory=list)

    def act(self, *action: Any) -> None:
        self.acts.append(action)

    def status(self) -> Status:
        return Status("standby")


@dataclass
class Bench:
    """The wizard behind a session, and what it has begun."""

    wizard: Wizard
    session: Session
    bus: Bus
    page: Page = field(default_factory=Page)
    begun: list[tuple[str, tuple[str, ...], Found, Nameplate]] = field(default_factory=list)

    def ask(self, kind: str, page: Page | None = None, **values: Any) -> None:
        """A message of a page."""
        obey(self.session, page or self.page, {"type": kind, **values})  # type: ignore[arg-type]

    def states(self) -> list[str]:
        return [card["state"] for card in self.wizard.shown()["cards"].values()]


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return made_of(tmp_path, "map")


@pytest.fixture
def turning(tmp_path: Path) -> Bench:
    """With the steps that turn the shaft."""
    return made_of(tmp_path, "all")


def made_of(tmp_path: Path, steps: str) -> Bench:
    interface = read_interface()
    wizard, bus = Wizard(chosen((steps,)), tmp_path, KNOWN, 375.0, 12.0), Bus()
    samples, recorder = Samples(interface.database), Recorder(tmp_path, interface)
    session = Session("", 100.0, samples, recorder, {}, link=bus, wizard=wizard)  # type: ignore[arg-type]
    made = Bench(wizard, session, bus)

    def begin(step: Step, done: tuple[str, ...], found: Found, known: Nameplate) -> None:
        made.begun.append((step.name, done, found, known))

    wizard.begin = begin
    return made


def test_only_the_next_step_begins_and_its_result_counts_when_it_is_accepted(bench: Bench) -> None:
    assert bench.states() == ["next", "waiting", "waiting"]
    for step in ("resistance", "map", "spin", "None"):
        with pytest.raises(FluxtrueError, match="not now|allowed: offsets, resistance, map"):
            bench.ask("commission_do", step=step)
    bench.ask("commission_do", step="offsets")
    assert bench.states()[0] == "running"
    for kind in ("commission_do", "commission_accept"):
        with pytest.raises(FluxtrueError, match="not now, it is running"):
            bench.ask(kind, step="offsets")
    found = Found(1.5 + 0j, 0.01)
    bench.wizard.found("offsets", found)
    assert bench.states() == ["found", "waiting", "waiting"], "nothing is changed before it is accepted"
    bench.ask("commission_accept", step="offsets")
    assert bench.states() == ["accepted", "next", "waiting"]
    bench.ask("commission_do", step="resistance")
    assert bench.begun == [("offsets", (), Found(), KNOWN), ("resistance", ("offsets",), found, KNOWN)]


def test_a_step_that_turns_the_shaft_needs_a_consent_to_each_movement(turning: Bench) -> None:
    offered = {step["name"]: step["turns"] for step in turning.wizard.offer()}
    assert offered == {"offsets": False, "phases": True, "spin": True, "drag": True, "resistance": False, "map": False}
    turning.ask("commission_do", step="offsets")
    turning.wizard.found("offsets", Found())
    turning.ask("commission_accept", step="offsets")
    for may_turn in ({}, {"may_turn": False}, {"may_turn": 1}, {"may_turn": "true"}):
        with pytest.raises(FluxtrueError, match="step phases: it turns the shaft, allowed: with the consent"):
            turning.ask("commission_do", step="phases", **may_turn)
    assert turning.states()[1] == "next" and len(turning.begun) == 1
    turning.ask("commission_do", step="phases", may_turn=True)
    turning.wizard.refused("phases", "Stop was pressed.")
    with pytest.raises(FluxtrueError, match="it turns the shaft"):
        turning.ask("commission_do", step="phases")
    assert turning.begun[1:] == [("phases", ("offsets",), Found(), KNOWN)]


def test_a_magnet_that_a_step_measures_is_not_given(turning: Bench) -> None:
    turning.ask("commission_know", **GOOD | {"name": "truck"})
    assert turning.wizard.shown()["known"] == {"name": "truck", "psi_f_mVs": 160.0, "source": "", "open": True}
    with pytest.raises(FluxtrueError, match="letters, digits"):
        turning.ask("commission_know", name="../up")


def test_a_repeated_result_is_discarded_and_a_refused_step_can_be_done_again(bench: Bench) -> None:
    bench.ask("commission_do", step="offsets")
    bench.wizard.found("offsets", Found(1.5 + 0j))
    bench.ask("commission_do", step="offsets")
    assert bench.begun[1][1:3] == ((), Found())
    bench.wizard.refused("offsets", "Stop was pressed.")
    card = bench.wizard.shown()["cards"]["offsets"]
    assert (card["state"], card["refused"], card["rows"]) == ("refused", "Stop was pressed.", [])
    bench.ask("commission_do", step="offsets")
    assert bench.wizard.shown()["cards"]["offsets"]["refused"] == ""


def test_a_page_without_control_cannot_begin_accept_or_enter_anything(bench: Bench) -> None:
    bench.ask("commission_do", step="offsets")
    bench.wizard.found("offsets", Found())
    other = Page()
    for kind in ("commission_do", "commission_accept", "commission_know", "reset"):
        with pytest.raises(FluxtrueError, match=OTHER):
            bench.ask(kind, other, step="offsets")
    assert bench.states()[0] == "found"
    bench.ask("stop", other)
    assert bench.bus.acts == [("stop", "Stop was pressed on another page.")]
    give_up(bench.session, bench.page)  # type: ignore[arg-type]
    assert bench.bus.acts[-1] == ("let_go",)
    bench.ask("commission_accept", other, step="offsets")


@pytest.mark.parametrize("kind", ["torque", "drive", "ready", "off", "knob", "tune", "tune_list", "scope_arm", "record",
                                  "seek", "launch"])  # fmt: skip
def test_nothing_else_is_commanded(bench: Bench, kind: str) -> None:
    with pytest.raises(FluxtrueError, match=NO_COMMANDS):
        bench.ask(kind)
    assert bench.session.hand is None and not bench.bus.acts


GOOD = {"name": "my-motor", "psi_f_mVs": 120.0, "source": "data sheet"}


@pytest.mark.parametrize(("change", "message"), [
    ({"psi_f_mVs": 0.0}, "more than 0"), ({"psi_f_mVs": -1}, "more than 0"), ({"psi_f_mVs": None}, "not a number"),
    ({"psi_f_mVs": "120"}, "not a number"), ({"name": ""}, "letters, digits"), ({"name": "../up"}, "letters, digits"),
    ({"name": "a/b"}, "letters, digits"), ({"name": "x" * 49}, "letters, digits"), ({"source": ""}, "a few words"),
    ({"source": "a\nb = 1"}, "a few words"), ({"source": "x" * 61}, "a few words"),
])  # fmt: skip
def test_a_magnet_that_is_none_is_refused(bench: Bench, change: dict[str, Any], message: str) -> None:
    with pytest.raises(FluxtrueError, match=message):
        bench.ask("commission_know", **GOOD | change)
    assert bench.wizard.shown()["known"] == {"name": "my-motor", "psi_f_mVs": 160.0, "source": "", "open": True}


def test_the_magnet_can_be_given_until_the_step_that_uses_it(bench: Bench) -> None:
    bench.ask("commission_know", **GOOD)
    bench.ask("commission_do", step="offsets")
    assert (bench.begun[0][3].psi_f_Vs, bench.begun[0][3].psi_f_source) == (pytest.approx(0.12), "data sheet")
    bench.wizard.found("offsets", Found())
    bench.ask("commission_accept", step="offsets")
    bench.ask("commission_know", **GOOD | {"psi_f_mVs": 121.0})
    bench.ask("commission_do", step="resistance")
    assert bench.begun[1][3].psi_f_Vs == pytest.approx(0.121)
    with pytest.raises(FluxtrueError, match="before that step"):
        bench.ask("commission_know", **GOOD)


def test_consent_lasts_as_long_as_the_page_reports() -> None:
    consent = Consent()
    assert not consent.withdraw("Stop") and consent.check(1e3) == "", "no step, nothing to end"
    consent.give(10.0)
    consent.hand(10.2)
    assert consent.check(10.2 + TIMEOUT_S - 1e-6) == ""
    assert consent.check(10.2 + TIMEOUT_S + 1e-6) == GONE
    consent.hand(10.6)
    assert consent.check(10.6) == GONE, "a page that comes back does not continue the step"
    assert consent.end() == GONE
    assert consent.check(20.0) == "" and consent.end() == GONE


def test_the_first_reason_to_end_stays() -> None:
    consent = Consent()
    consent.give(0.0)
    assert consent.withdraw("Stop was pressed.") and consent.withdraw("closed")
    assert consent.check(0.1) == "Stop was pressed." == consent.end()
    consent.give(1.0)
    assert consent.check(1.0) == ""


def test_each_picture_has_a_title() -> None:
    assert {step: len(panels) for step, panels in plot.PANELS.items()} == {
        step: len(titles) for step, titles in PICTURES.items() if step != "finish"}  # fmt: skip
