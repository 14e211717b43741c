# SPDX-License-Identifier: Apache-2.0
"""Self-commissioning: a motor's folder from the inverter and the motor alone."""
