# SPDX-License-Identifier: Apache-2.0
"""A page in the browser: signals of the bus, drawn live, and a slider for the torque."""
