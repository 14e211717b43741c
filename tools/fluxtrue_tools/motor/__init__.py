# SPDX-License-Identifier: Apache-2.0
"""Machine data: reading, checking, symmetrising, and the tables the firmware is built from."""
