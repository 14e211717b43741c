# SPDX-License-Identifier: Apache-2.0
# A linked image of a port (hal/<port>): the firmware for FLUXTRUE_MOTOR with start-up code and drivers.

# fluxtrue_image(<name> SOURCES <file> ... SCRIPT <linker script> [SEAL] [BUDGET <file> [ANGLE <sensor>]]
#                [DEFINITIONS <D> ...] [LINK <option> ...])
#   <build>/<name>.elf and .bin; SEAL writes the checksum; a machine beyond the BUDGET of the port is refused before the
#   image is linked, with what this angle sensor costs (tools/fluxtrue target fits --angle; left out: the encoder), an
#   image larger than its bounds afterwards
function(fluxtrue_image name)
    cmake_parse_arguments(PARSE_ARGV 1 arg "SEAL" "SCRIPT;BUDGET;ANGLE" "SOURCES;DEFINITIONS;LINK")
    if(arg_UNPARSED_ARGUMENTS OR NOT arg_SOURCES OR NOT arg_SCRIPT)
        message(FATAL_ERROR "fluxtrue_image(${name}): wants SOURCES and SCRIPT; unknown: '${arg_UNPARSED_ARGUMENTS}'")
    endif()
    cmake_path(ABSOLUTE_PATH arg_SCRIPT)
    get_property(layers GLOBAL PROPERTY FLUXTRUE_LAYERS)
    list(TRANSFORM layers REPLACE "(.+)" "$<TARGET_OBJECTS:\\1>" OUTPUT_VARIABLE objects)
    get_property(motor GLOBAL PROPERTY FLUXTRUE_MOTOR_TARGET)
    add_executable(${name}_image ${arg_SOURCES} ${objects} $<TARGET_OBJECTS:${motor}>)
    set_target_properties(${name}_image PROPERTIES OUTPUT_NAME ${name} SUFFIX .elf LINK_DEPENDS "${arg_SCRIPT}"
        RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}")
    target_compile_definitions(${name}_image PRIVATE ${arg_DEFINITIONS})
    target_compile_options(${name}_image PRIVATE -ffreestanding)
    target_link_libraries(${name}_image PRIVATE fluxtrue_firmware fluxtrue_strict)
    target_link_options(${name}_image PRIVATE -O2 -nostartfiles --specs=nano.specs ${arg_LINK} "-T${arg_SCRIPT}"
        -Wl,--gc-sections,--fatal-warnings "-Wl,-Map=${CMAKE_BINARY_DIR}/${name}.map")
    set(tool ${CMAKE_COMMAND} -E env "PYTHONPATH=${CMAKE_SOURCE_DIR}/tools" PYTHONDONTWRITEBYTECODE=1
        "${FLUXTRUE_PYTHON}" -m fluxtrue_tools target)
    if(arg_BUDGET)
        cmake_path(ABSOLUTE_PATH arg_BUDGET)
        string(REGEX REPLACE "^motor_" "" machine "${motor}")
        set(angle "")
        if(arg_ANGLE)
            set(angle --angle ${arg_ANGLE})
        endif()
        add_custom_command(TARGET ${name}_image PRE_LINK VERBATIM
            COMMAND ${tool} fits "${CMAKE_BINARY_DIR}/motors/${machine}/motor.json" --budget "${arg_BUDGET}" ${angle})
        set_property(TARGET ${name}_image APPEND PROPERTY LINK_DEPENDS "${arg_BUDGET}")
    endif()
    if(arg_SEAL)
        add_custom_command(TARGET ${name}_image POST_BUILD VERBATIM
            COMMAND ${tool} seal "$<TARGET_FILE:${name}_image>")
    endif()
    if(arg_BUDGET)
        add_custom_command(TARGET ${name}_image POST_BUILD VERBATIM
            COMMAND ${tool} size "$<TARGET_FILE:${name}_image>" --budget "${arg_BUDGET}")
    endif()
    add_custom_command(TARGET ${name}_image POST_BUILD VERBATIM
        COMMAND "${CMAKE_OBJCOPY}" -O binary "$<TARGET_FILE:${name}_image>" "${CMAKE_BINARY_DIR}/${name}.bin")
endfunction()
