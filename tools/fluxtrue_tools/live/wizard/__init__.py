# SPDX-License-Identifier: Apache-2.0
"""The commissioning of an unknown motor on the live page."""
