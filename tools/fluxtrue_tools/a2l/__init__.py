# SPDX-License-Identifier: Apache-2.0
"""The description file for calibration tools (ASAP2), from the firmware's ELF file alone."""
