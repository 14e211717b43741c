# SPDX-License-Identifier: Apache-2.0
"""The tools around the Fluxtrue firmware: motor data, simulation, demonstration, benchmarks."""

from fluxtrue_tools import light_can
from fluxtrue_tools.version import version

light_can.install()  # before any module can import python-can
__version__ = version()
