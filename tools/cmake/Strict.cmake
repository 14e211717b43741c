# SPDX-License-Identifier: Apache-2.0
# How everything is compiled, and the target fluxtrue_strict with the warnings for our own code.

set(CMAKE_C_VISIBILITY_PRESET hidden)
# No NDEBUG: an assertion is worth its time in a simulation.
set(CMAKE_C_FLAGS_RELWITHDEBINFO "-O2 -g")
# Shared libraries for the simulation. On the target PIC would cost registers and put const tables in RAM.
if(NOT CMAKE_CROSSCOMPILING)
    set(CMAKE_POSITION_INDEPENDENT_CODE ON)
endif()
# A fused multiply-add rounds differently: results must not depend on the build machine.
add_compile_options(-ffp-contract=off)

if(FLUXTRUE_SANITIZE)
    # Compiled in two thirds of the time of -O2. Tests read the full debugging information.
    add_compile_options(-O1)
    add_compile_options(-fsanitize=address,undefined -fno-sanitize-recover=all
                        -fno-omit-frame-pointer)
    add_link_options(-fsanitize=address,undefined)
endif()

add_library(fluxtrue_strict INTERFACE)
target_compile_options(fluxtrue_strict INTERFACE
    -Wall -Wextra -Wconversion -Wsign-conversion -Wshadow -Wstrict-prototypes
    -Wmissing-prototypes -Wundef $<$<BOOL:${FLUXTRUE_WERROR}>:-Werror>)

# For the firmware and its tests (which instantiate the inline functions), not for plant and tables.
add_library(fluxtrue_covered INTERFACE)
if(FLUXTRUE_COVERAGE)
    target_compile_options(fluxtrue_covered INTERFACE --coverage)
    add_link_options(--coverage)
endif()
if(FLUXTRUE_MCDC)
    target_compile_options(fluxtrue_covered INTERFACE
        -fprofile-instr-generate -fcoverage-mapping -fcoverage-mcdc)
    add_link_options(-fprofile-instr-generate)
endif()
