# SPDX-License-Identifier: Apache-2.0
"""The tools around the Fluxtrue firmware: motor data, simulation, demonstration, benchmarks."""
