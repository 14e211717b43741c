# SPDX-License-Identifier: Apache-2.0
# The CAN messages: C code from the one DBC, in <build>/generated/bus.
#   fluxtrue_bus    pack and unpack by cantools, clamps and range checks on top

set(dbc "${CMAKE_SOURCE_DIR}/firmware/comm/fluxtrue.dbc")
set(generated "${CMAKE_BINARY_DIR}/generated")
file(GLOB generator CONFIGURE_DEPENDS "${CMAKE_SOURCE_DIR}/tools/fluxtrue_tools/bus/*.py")
add_custom_command(
    OUTPUT "${generated}/bus/bus.c" "${generated}/bus/bus.h" "${generated}/bus/signals.h"
        "${generated}/bus/exports.c"
    COMMAND ${CMAKE_COMMAND} -E env "PYTHONPATH=${CMAKE_SOURCE_DIR}/tools" PYTHONDONTWRITEBYTECODE=1
        "${FLUXTRUE_PYTHON}" -m fluxtrue_tools.bus.generate "${dbc}" "${generated}"
    DEPENDS "${dbc}" ${generator}
    COMMENT "Generating the CAN messages"
    VERBATIM)
add_library(fluxtrue_bus STATIC "${generated}/bus/bus.c" "${generated}/bus/bus.h" "${generated}/bus/signals.h")
target_include_directories(fluxtrue_bus SYSTEM PUBLIC "${generated}")
target_link_libraries(fluxtrue_bus PUBLIC m) # rounding
target_compile_options(fluxtrue_bus PRIVATE -w)

if(NOT CMAKE_CROSSCOMPILING)
    # Every message's encoder and decoder, for comparison with cantools' in Python.
    add_library(fluxtrue_bus_exports SHARED "${generated}/bus/exports.c" "${generated}/bus/bus.c")
    target_include_directories(fluxtrue_bus_exports PRIVATE "${generated}" "${CMAKE_SOURCE_DIR}/firmware")
    target_link_libraries(fluxtrue_bus_exports PRIVATE m)
    set_target_properties(fluxtrue_bus_exports PROPERTIES LIBRARY_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}")
endif()
