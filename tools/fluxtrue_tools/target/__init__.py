# SPDX-License-Identifier: Apache-2.0
"""Tools for a microcontroller's image: register header, checksum."""
