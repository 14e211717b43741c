# SPDX-License-Identifier: Apache-2.0
"""The tools around the Fluxtrue firmware: motor data, simulation, demonstration, benchmarks."""

from fluxtrue_tools.version import version

__version__ = version()
