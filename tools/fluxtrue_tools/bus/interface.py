# SPDX-License-Identifier: Apache-2.0
"""A DBC as the tools use it: its messages, and whether it describes the inverter that is connected.

Factors differ from motor to motor (docs/decisions/018-bus-scales.md): a tool takes the DBC that `motor build` wrote for
the motor, never a factor of its own.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import cantools
from cantools.database.can import Database, Message

from fluxtrue_tools.bus import DBC
from fluxtrue_tools.bus.scales import HASH, interface_hash
from fluxtrue_tools.errors import FluxtrueError

COMMAND: Final = "VCU_TorqueRequest"
LIMITS: Final = "VCU_BatteryLimits"
COMMISSION: Final = "VCU_Commission"
CONFIGURATION: Final = "INV_Configuration"
REQUEST: Final = "TorqueRequested"
DATA_ID: Final = "E2EDataId"


@dataclass(frozen=True)
class Interface:
    """The text of a DBC, under the name that messages give it."""

    name: str
    text: str

    @cached_property
    def database(self) -> Database:
        """The messages of the DBC."""
        try:
            database = cantools.database.load_string(self.text, "dbc")
        except (cantools.database.Error, ValueError) as error:
            raise FluxtrueError(f"{self.name}: no DBC ({error})") from error
        assert isinstance(database, Database)
        return database

    @cached_property
    def hash(self) -> int:
        """What an inverter that it describes transmits as InterfaceHash."""
        return interface_hash(self.text)

    def message(self, name: str) -> Message:
        """One message."""
        return self.database.get_message_by_name(name)

    def data_id(self, name: str) -> int:
        """The data id of a protected message."""
        found = self.message(name).dbc
        assert found is not None
        return int(found.attributes[DATA_ID].value)

    def largest(self, message: str, signal: str) -> float:
        """The end of a signal's range."""
        maximum = self.message(message).get_signal_by_name(signal).maximum
        assert maximum is not None
        return float(maximum)

    def mismatch(self, configuration: dict[str, Any] | None) -> str:
        """One message if the inverter's INV_Configuration names another interface; empty also before its first."""
        if configuration is None or HASH not in configuration or int(configuration[HASH]) == self.hash:
            return ""
        return (f"{self.name} (interface hash 0x{self.hash:08X}) does not describe this inverter "
                f"(0x{int(configuration[HASH]):08X}): torques and other values would have another scale. Take the "
                "fluxtrue.dbc that `tools/fluxtrue motor build` writes for the inverter's motor.")  # fmt: skip


def read_interface(path: Path = DBC) -> Interface:
    """The DBC in a file."""
    try:
        return Interface(str(path), path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise FluxtrueError(f"{path}: cannot be read ({error})") from error
