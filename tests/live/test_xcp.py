# SPDX-License-Identifier: Apache-2.0
"""The page's XCP session with an ECU that does not answer, without an ECU."""

from typing import ClassVar

import pytest
from masters import ConnectedMaster
from pyxcp.types import XcpTimeoutError

from fluxtrue_tools.a2l.elf import Description, Value
from fluxtrue_tools.bus.address import BusAddress
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live import xcp
from fluxtrue_tools.live.tuning import Tuning

OBSERVER = Value("observer_m", "", "", "F32", "", 2.0, 4.0, 0x1000)
DESCRIPTION = Description("hsm1", (OBSERVER,), (), (), (), 1e-3)


class Master(ConnectedMaster):
    """A session that ends when the ECU is reset: afterwards nothing is answered."""

    made: ClassVar[list["Master"]] = []

    def __init__(self) -> None:
        super().__init__()
        self.is_reset = False
        Master.made.append(self)

    def setMta(self, address: int) -> None:
        """Say where the next data go."""

    def download(self, data: bytes) -> None:
        """Write."""
        if self.is_reset:
            raise XcpTimeoutError("no answer")


@pytest.fixture
def tuning(monkeypatch: pytest.MonkeyPatch) -> Tuning:
    """The calibration of one value."""
    Master.made.clear()
    monkeypatch.setattr(xcp, "_connect", lambda *_: Master())
    return Tuning(xcp.Xcp(BusAddress("virtual", "none", {})), DESCRIPTION)


def test_after_an_ecu_that_did_not_answer_the_next_call_connects_again(tuning: Tuning) -> None:
    tuning.write("observer_m", 3.0)
    Master.made[0].is_reset = True
    with pytest.raises(FluxtrueError, match="XCP: no answer"):
        tuning.write("observer_m", 3.0)
    assert Master.made[0].is_closed
    tuning.write("observer_m", 3.0)
    assert len(Master.made) == 2 and not Master.made[1].is_closed
    tuning.close()
