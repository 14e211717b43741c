# SPDX-License-Identifier: Apache-2.0
"""Mutation of the firmware: small errors in the C sources, each of which a unit test has to notice."""
