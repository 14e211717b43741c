# SPDX-License-Identifier: Apache-2.0
"""The S32K144 image in an emulated inverter: register-level models around unicorn, coupled to the plant."""
