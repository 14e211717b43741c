# SPDX-License-Identifier: Apache-2.0
"""The virtual ECU: application and plant in one process, reached over CAN and a bench channel."""
