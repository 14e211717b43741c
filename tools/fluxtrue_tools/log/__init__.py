# SPDX-License-Identifier: Apache-2.0
"""Recorded drives: decoded, summarised, plotted, exported."""
