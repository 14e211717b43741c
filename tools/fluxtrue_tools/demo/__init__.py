# SPDX-License-Identifier: Apache-2.0
"""The experiments: the paper's, and ours on a measured machine, with their bounds."""
