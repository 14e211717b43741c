# SPDX-License-Identifier: Apache-2.0
"""The CAN interface: C code from the one DBC."""
