# SPDX-License-Identifier: Apache-2.0
"""Flux maps of other programs and test benches, as a motor folder."""
