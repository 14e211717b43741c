# SPDX-License-Identifier: Apache-2.0
"""A page for the eyes: what the inverter says on the bus, drawn live, and a slider for its torque."""
