# SPDX-License-Identifier: Apache-2.0
"""Monte-Carlo simulation over plants and drives: the torque error with realistic deviations."""
