# SPDX-License-Identifier: Apache-2.0
"""Random and mutated frames through the receive path."""
