# SPDX-License-Identifier: Apache-2.0
"""Bounded model checking of the firmware with CBMC: harnesses, planted errors, cached verdicts."""
