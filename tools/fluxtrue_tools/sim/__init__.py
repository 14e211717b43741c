# SPDX-License-Identifier: Apache-2.0
"""Closed-loop simulation: the simulated drive with the firmware or its double-precision twin."""
