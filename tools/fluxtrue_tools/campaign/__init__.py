# SPDX-License-Identifier: Apache-2.0
"""Monte-Carlo over plants and drives: how true is the torque when everything is a little wrong?"""
