# SPDX-License-Identifier: Apache-2.0
"""The drive's scope: captures of up to eight signals at PWM rate, armed and read over XCP."""
