# SPDX-License-Identifier: Apache-2.0
# Arm Cortex-M with a single-precision FPU and the hard-float ABI; FLUXTRUE_CPU says which.
set(FLUXTRUE_CPU cortex-m4 CACHE STRING "Processor: cortex-m4, cortex-m7 or cortex-m33")
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES FLUXTRUE_CPU)
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR ${FLUXTRUE_CPU})
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
# A port brings its own linker script: until then only a static library can be made.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
if(FLUXTRUE_CPU STREQUAL cortex-m4)
    set(fpu fpv4-sp-d16)
else()
    set(fpu fpv5-sp-d16)
endif()
# The stages are called once, from one interrupt: optimised across files they become part of it. Fat, so
# that the objects can still be inspected one by one. Scheduling before the registers are given out spreads values over
# more registers than the processor has, and it has one pipeline only: without it the interrupts are shorter. So they are
# without the saving of registers around the calls that they hardly ever make.
set(CMAKE_C_FLAGS_INIT
    "-mcpu=${FLUXTRUE_CPU} -mthumb -mfloat-abi=hard -mfpu=${fpu} -ffunction-sections -fdata-sections -flto -ffat-lto-objects -fno-schedule-insns -fno-caller-saves")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
