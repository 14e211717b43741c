# SPDX-License-Identifier: Apache-2.0
"""Connections to a virtual CAN bus."""

import socket

import can
from fluxtrue_tools.vecu.process import HOST


def client_port(bus: can.BusABC) -> int:
    """Our side of a socketcand connection: how the bench channel knows us. 0: another interface."""
    connection = getattr(bus, "_SocketCanDaemonBus__socket", None)
    return int(connection.getsockname()[1]) if isinstance(connection, socket.socket) else 0


def connect(port: int) -> can.BusABC:
    """A socketcand client of a virtual ECU."""
    return can.Bus(interface="socketcand", channel="can0", host=HOST, port=port, tcp_tune=True)
