# SPDX-License-Identifier: Apache-2.0
# Slots of hal/nvm.h on this port: all 64 KiB of the FlexNVM, four in each sector of 2 KiB.
set(S32K144_NVM_LAYOUT HAL_NVM_SLOTS=128U HAL_NVM_SLOT_SIZE=512U HAL_NVM_SECTOR_SLOTS=4U)
