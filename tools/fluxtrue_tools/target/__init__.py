# SPDX-License-Identifier: Apache-2.0
"""What a microcontroller's image needs besides the compiler: register header, checksum."""
