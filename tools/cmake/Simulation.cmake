# SPDX-License-Identifier: Apache-2.0
# What the simulation on the host is made of. A part whose folder is empty is left out. For Windows only the first.
#   fluxtrue_hal_host    the firmware as a library for any plant (hal/host)
#   fluxtrue_plant       the simulated drive: knows nothing of the firmware (tests/plant)
#   fluxtrue_twin        the controller again in double precision (tests/support/twin)
#   fluxtrue_sim_runner  plant with firmware or twin, period by period (tests/loop/runner)
#   fluxtrue_vecu_parts  the virtual ECU's bus, sockets and bench channel (tests/vecu)

# fluxtrue_part(<name> <library type> <folder> [<include folder> ...])
function(fluxtrue_part name type folder)
    file(GLOB sources CONFIGURE_DEPENDS "${CMAKE_SOURCE_DIR}/${folder}/*.c")
    if(sources)
        add_library(${name} ${type} ${sources})
        target_include_directories(${name} PUBLIC ${ARGN})
        target_link_libraries(${name} PRIVATE fluxtrue_strict)
    endif()
endfunction()

set(tests "${CMAKE_SOURCE_DIR}/tests")
set(firmware "${CMAKE_SOURCE_DIR}/firmware")

# The firmware's port on a computer. A computer copies by its processor, as a port without a DMA does.
file(GLOB FLUXTRUE_HOST_PORT CONFIGURE_DEPENDS "${CMAKE_SOURCE_DIR}/hal/host/*.c")
set(FLUXTRUE_NO_GATHER "${CMAKE_SOURCE_DIR}/hal/template/gather.c")
list(APPEND FLUXTRUE_HOST_PORT "${FLUXTRUE_NO_GATHER}")

# Object libraries where the exported functions must be kept although nothing calls them.
fluxtrue_part(fluxtrue_hal_host OBJECT hal/host "${firmware}" "${CMAKE_SOURCE_DIR}")
target_sources(fluxtrue_hal_host PRIVATE "${FLUXTRUE_NO_GATHER}")
if(WIN32)
    target_compile_definitions(fluxtrue_hal_host PRIVATE FLUXTRUE_BUILD) # its functions are exported
else()
    fluxtrue_part(fluxtrue_plant STATIC tests/plant "${tests}" "${tests}/plant")
    if(TARGET fluxtrue_plant)
        # Two numbers are stored one by one and loaded as a pair at once, for which the processor waits: the results are
        # the same to the bit, a substep takes 4 % less.
        target_compile_options(fluxtrue_plant PRIVATE -fno-tree-slp-vectorize)
    endif()
    fluxtrue_part(fluxtrue_twin STATIC tests/support/twin "${tests}" "${tests}/support" "${firmware}")
    fluxtrue_part(fluxtrue_sim_runner OBJECT tests/loop/runner
        "${tests}" "${tests}/support" "${firmware}" "${CMAKE_SOURCE_DIR}")
    fluxtrue_part(fluxtrue_vecu_parts OBJECT tests/vecu
        "${tests}" "${tests}/vecu" "${firmware}" "${CMAKE_SOURCE_DIR}")
endif()

# Everything the tools load at run time: what tools/demo builds. Not the machines of tests/motors.
add_custom_target(fluxtrue_libraries)
function(_fluxtrue_loaded target)
    if("${FLUXTRUE_MACHINE_OF_TESTS}" STREQUAL "")
        add_dependencies(fluxtrue_libraries ${target})
    endif()
endfunction()

# fluxtrue_shared(<target> <output name> <folder> <library or object library> ...)
function(fluxtrue_shared target output folder)
    add_library(${target} SHARED)
    foreach(part IN LISTS ARGN)
        if(TARGET ${part})
            get_target_property(type ${part} TYPE)
            if(type STREQUAL OBJECT_LIBRARY)
                target_sources(${target} PRIVATE $<TARGET_OBJECTS:${part}>)
            else()
                target_link_libraries(${target} PRIVATE ${part})
            endif()
        endif()
    endforeach()
    target_link_libraries(${target} PRIVATE m)
    target_link_options(${target} PRIVATE
        $<$<NOT:$<BOOL:${FLUXTRUE_SANITIZE}>>:-Wl,--no-undefined>)
    set_target_properties(${target} PROPERTIES LINKER_LANGUAGE C
        OUTPUT_NAME ${output} LIBRARY_OUTPUT_DIRECTORY "${folder}")
    if(WIN32) # named as there, and without a library of the compiler beside it
        set_target_properties(${target} PROPERTIES PREFIX ""
            RUNTIME_OUTPUT_DIRECTORY "${folder}" ARCHIVE_OUTPUT_DIRECTORY "${folder}")
        target_link_options(${target} PRIVATE -static-libgcc)
    endif()
    _fluxtrue_loaded(${target})
endfunction()

# fluxtrue_vecu(<name> <folder> <library or object library> ...)
#   fluxtrue_vecu_<name>   <folder>/fluxtrue_vecu: application and plant in one process, at a fixed address so that
#                          calibration tools find its variables where the ELF file says
function(fluxtrue_vecu name folder)
    file(GLOB tool CONFIGURE_DEPENDS "${CMAKE_SOURCE_DIR}/tools/fluxtrue_tools/vecu/emit.py"
        "${CMAKE_SOURCE_DIR}/tools/fluxtrue_tools/sim/motor.py")
    add_custom_command(OUTPUT "${folder}/machine_data.c"
        COMMAND ${CMAKE_COMMAND} -E env "PYTHONPATH=${CMAKE_SOURCE_DIR}/tools" PYTHONDONTWRITEBYTECODE=1
            "${FLUXTRUE_PYTHON}" -m fluxtrue_tools.vecu.emit "${folder}/motor.json" "${folder}/machine_data.c"
        DEPENDS "${folder}/motor_tables.c" ${tool}
        COMMENT "Generating the plant of motor ${name}"
        VERBATIM)
    set(target fluxtrue_vecu_${name})
    add_executable(${target} "${folder}/machine_data.c")
    target_include_directories(${target} PRIVATE "${CMAKE_SOURCE_DIR}/tests/vecu")
    foreach(part IN LISTS ARGN)
        get_target_property(type ${part} TYPE)
        if(type STREQUAL OBJECT_LIBRARY)
            target_sources(${target} PRIVATE $<TARGET_OBJECTS:${part}>)
        else()
            target_link_libraries(${target} PRIVATE ${part})
        endif()
    endforeach()
    target_link_libraries(${target} PRIVATE m)
    target_link_options(${target} PRIVATE -no-pie)
    set_target_properties(${target} PROPERTIES OUTPUT_NAME fluxtrue_vecu RUNTIME_OUTPUT_DIRECTORY "${folder}")
    _fluxtrue_loaded(${target})
endfunction()
