# SPDX-License-Identifier: Apache-2.0
# From a motor's folder (motor.toml, flux map) to the libraries for that motor.

# Which folders this configuration builds, for tools/fluxtrue_tools/sim/build.py. Notes of the last one are removed.
file(GLOB notes "${CMAKE_BINARY_DIR}/motors/*/folder.txt")
if(notes)
    file(REMOVE ${notes})
endif()

function(_fluxtrue_motor_tool output)
    set(${output} ${CMAKE_COMMAND} -E env
        "PYTHONPATH=${CMAKE_SOURCE_DIR}/tools" PYTHONDONTWRITEBYTECODE=1
        "${FLUXTRUE_PYTHON}" -m fluxtrue_tools motor PARENT_SCOPE)
endfunction()

# Object library motor_<name>: the generated tables, in <build>/motors/<name>.
function(_fluxtrue_motor_tables name folder out)
    file(GLOB_RECURSE tool CONFIGURE_DEPENDS
        "${CMAKE_SOURCE_DIR}/tools/fluxtrue_tools/motor/*")
    list(FILTER tool EXCLUDE REGEX "__pycache__")
    list(APPEND tool "${CMAKE_SOURCE_DIR}/tools/fluxtrue_tools/bus/scales.py"
        "${CMAKE_SOURCE_DIR}/firmware/comm/fluxtrue.dbc")
    file(GLOB data CONFIGURE_DEPENDS "${folder}/*.toml" "${folder}/*.csv")
    file(STRINGS "${folder}/motor.toml" map REGEX "^flux_map *= *\"[^\"]+\"")
    if(map MATCHES "\"([^\"]+)\"") # which may lie elsewhere
        cmake_path(ABSOLUTE_PATH CMAKE_MATCH_1 BASE_DIRECTORY "${folder}" NORMALIZE OUTPUT_VARIABLE map)
        list(APPEND data "${map}")
        list(REMOVE_DUPLICATES data)
    endif()
    set(sources "${out}/motor_tables.c")
    if(NOT CMAKE_CROSSCOMPILING)
        list(APPEND sources "${out}/motor_si.c")
    endif()
    _fluxtrue_motor_tool(motor_tool)
    add_custom_command(
        OUTPUT "${out}/motor_tables.c" "${out}/motor_si.c"
        BYPRODUCTS "${out}/motor.json" "${out}/fluxtrue.dbc" "${out}/report.txt"
        COMMAND ${motor_tool} build "${folder}" --out "${out}" --no-report
        DEPENDS ${data} ${tool}
        COMMENT "Generating the tables of motor ${name}"
        VERBATIM)
    add_library(motor_${name} OBJECT ${sources})
    target_link_libraries(motor_${name} PRIVATE fluxtrue_strict fluxtrue_firmware)
    if(FLUXTRUE_BARE_METAL)
        # Data, which an image places by the name of this file; no constant of it may melt into code.
        target_compile_options(motor_${name} PRIVATE -fno-lto)
    else()
        target_include_directories(motor_${name} PRIVATE
            "${CMAKE_SOURCE_DIR}/tests" "${CMAKE_SOURCE_DIR}/tests/support")
    endif()
endfunction()

# fluxtrue_add_motor(<name> <folder>)
#   motor_<name>          object library with the tables; <build>/motors/<name>/folder.txt names the folder
#   fluxtrue_sil_<name>   host: <build>/motors/<name>/libfluxtrue_sil.so
#   fluxtrue_sim_<name>   host: <build>/motors/<name>/libfluxtrue_sim.so
#   fluxtrue_vecu_<name>  host: <build>/motors/<name>/fluxtrue_vecu
function(fluxtrue_add_motor name folder)
    set(out "${CMAKE_BINARY_DIR}/motors/${name}")
    file(CONFIGURE OUTPUT "${out}/folder.txt" CONTENT "${folder}\n" @ONLY)
    _fluxtrue_motor_tables(${name} "${folder}" "${out}")
    if(TARGET fluxtrue_hal_host)
        fluxtrue_shared(fluxtrue_sil_${name} fluxtrue_sil "${out}"
            fluxtrue_hal_host motor_${name} fluxtrue_firmware)
    endif()
    if(TARGET fluxtrue_hal_host AND TARGET fluxtrue_sim_runner)
        fluxtrue_shared(fluxtrue_sim_${name} fluxtrue_sim "${out}"
            fluxtrue_sim_runner fluxtrue_hal_host motor_${name}
            fluxtrue_plant fluxtrue_twin fluxtrue_firmware)
        fluxtrue_vecu(${name} "${out}" fluxtrue_vecu_parts fluxtrue_sim_runner fluxtrue_hal_host
            motor_${name} fluxtrue_plant fluxtrue_twin fluxtrue_firmware)
    endif()
endfunction()

# fluxtrue_build_for(<folder>): the firmware for one machine, any folder on disk.
#   host      <build>/libfluxtrue_sil.so
#   windows   <build>/fluxtrue_sil.dll and its import library libfluxtrue_sil.dll.a
#   target    <build>/libfluxtrue.a: all layers and the machine's tables
function(fluxtrue_build_for folder)
    file(REAL_PATH "${folder}" folder)
    cmake_path(GET folder FILENAME name)
    if(NOT (TARGET motor_${name} AND EXISTS "${CMAKE_SOURCE_DIR}/firmware/motors/${name}"
            AND folder PATH_EQUAL "${CMAKE_SOURCE_DIR}/firmware/motors/${name}"))
        _fluxtrue_motor_tool(motor_tool)
        execute_process(COMMAND ${motor_tool} check "${folder}"
            RESULT_VARIABLE failed OUTPUT_QUIET ERROR_VARIABLE message
            ERROR_STRIP_TRAILING_WHITESPACE)
        if(failed)
            message(FATAL_ERROR "FLUXTRUE_MOTOR=${folder}\n${message}")
        endif()
        set(name selected)
        fluxtrue_add_motor(${name} "${folder}")
    endif()
    set_property(GLOBAL PROPERTY FLUXTRUE_MOTOR_TARGET motor_${name})
    if(FLUXTRUE_BARE_METAL)
        get_property(layers GLOBAL PROPERTY FLUXTRUE_LAYERS)
        list(TRANSFORM layers REPLACE "(.+)" "$<TARGET_OBJECTS:\\1>" OUTPUT_VARIABLE objects)
        add_library(fluxtrue STATIC ${objects} $<TARGET_OBJECTS:motor_${name}>)
        target_link_libraries(fluxtrue INTERFACE fluxtrue_firmware)
        set_target_properties(fluxtrue PROPERTIES
            ARCHIVE_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}" LINKER_LANGUAGE C)
    elseif(TARGET fluxtrue_hal_host)
        fluxtrue_shared(fluxtrue_sil fluxtrue_sil "${CMAKE_BINARY_DIR}"
            fluxtrue_hal_host motor_${name} fluxtrue_firmware)
    endif()
endfunction()
