# SPDX-License-Identifier: Apache-2.0
# Unit tests in C with Unity, mocks of the hardware interface with CMock.

include(TestTime)
find_program(FLUXTRUE_RUBY ruby)
# Both generators need only Ruby's standard library; half of their time would be to load its package manager.
set(ruby "${FLUXTRUE_RUBY}" --disable=gems -W0)
set(unity "${FLUXTRUE_CMOCK}/vendor/unity")
set(FLUXTRUE_UNIT_TESTS ON)
if(FLUXTRUE_TESTS STREQUAL OFF)
    set(FLUXTRUE_UNIT_TESTS OFF)
elseif(NOT EXISTS "${unity}/src/unity.c" OR NOT FLUXTRUE_RUBY)
    if(FLUXTRUE_TESTS STREQUAL ON)
        message(FATAL_ERROR "No Ruby, or no CMock at ${FLUXTRUE_CMOCK}: run tools/setup first")
    endif()
    message(STATUS "Unit tests are left out: no CMock or no Ruby (tools/setup gets both)")
    set(FLUXTRUE_UNIT_TESTS OFF)
endif()

# The tests whose coverage counts: those of the firmware below tests/unit. They take seconds, and they assert what they
# execute; a closed loop also executes much that it does not assert.
add_custom_target(fluxtrue_coverage_tests)

if(FLUXTRUE_UNIT_TESTS)
    add_library(fluxtrue_unity STATIC "${unity}/src/unity.c" "${FLUXTRUE_CMOCK}/src/cmock.c")
    target_include_directories(fluxtrue_unity SYSTEM PUBLIC "${unity}/src" "${FLUXTRUE_CMOCK}/src")
    target_compile_definitions(fluxtrue_unity PUBLIC UNITY_INCLUDE_DOUBLE UNITY_SUPPORT_64)
    target_compile_options(fluxtrue_unity PRIVATE -w)
    # Written only when it changes: every mock and runner depends on it.
    file(CONFIGURE OUTPUT "${CMAKE_BINARY_DIR}/cmock.yml" @ONLY CONTENT [[
:cmock:
  :mock_prefix: mock_
  :plugins:
    - :ignore
    - :ignore_arg
    - :expect_any_args
    - :return_thru_ptr
    - :array
    - :callback
  :treat_inlines: :include
  :treat_externs: :include
  :when_ptr: :compare_data
]])
endif()

# The mock of one header, and, because inline functions are mocked too, a copy of the header
# without their bodies that must be found before the real one.
function(_fluxtrue_mock header folder sources)
    cmake_path(GET header PARENT_PATH sub)
    cmake_path(GET header STEM stem)
    set(mock "${folder}/${sub}/mock_${stem}.c")
    # CMock ends the value of an option at the first character that is no ASCII letter, digit or one of a few signs: the
    # path of a checkout may have others, therefore it is told a relative one.
    file(MAKE_DIRECTORY "${folder}/${sub}")
    add_custom_command(
        OUTPUT "${mock}"
        BYPRODUCTS "${folder}/${sub}/mock_${stem}.h"
        COMMAND ${ruby} "${FLUXTRUE_CMOCK}/lib/cmock.rb"
            "-o${CMAKE_BINARY_DIR}/cmock.yml" --mock_path=. "--subdir=${sub}" "${CMAKE_SOURCE_DIR}/${header}"
        WORKING_DIRECTORY "${folder}"
        DEPENDS "${CMAKE_SOURCE_DIR}/${header}" "${CMAKE_BINARY_DIR}/cmock.yml"
        COMMENT "Mocking ${header}"
        VERBATIM)
    set_source_files_properties("${mock}" PROPERTIES COMPILE_OPTIONS -w)
    set(${sources} "${mock}" PARENT_SCOPE)
endfunction()

# The mock of one header as a library of objects, made once for all tests that use it. Its folder holds nothing else: a
# test finds the copies of the headers that it mocks, and every other header as it is.
function(_fluxtrue_mock_library header target folder)
    string(MAKE_C_IDENTIFIER "${header}" name)
    set(library "fluxtrue_mock_${name}")
    set(own "${CMAKE_BINARY_DIR}/mocks/${name}")
    set(${target} "${library}" PARENT_SCOPE)
    set(${folder} "${own}" PARENT_SCOPE)
    if(TARGET ${library})
        return()
    endif()
    _fluxtrue_mock("${header}" "${own}" mock)
    add_library(${library} OBJECT "${mock}")
    target_include_directories(${library} BEFORE PRIVATE "${own}")
    target_include_directories(${library} PRIVATE "${CMAKE_SOURCE_DIR}/firmware" "${CMAKE_SOURCE_DIR}")
    target_link_libraries(${library} PRIVATE fluxtrue_firmware fluxtrue_unity fluxtrue_strict fluxtrue_covered)
endfunction()

# What the sources of a test are compiled with and linked to; arg_ are the arguments of fluxtrue_unity_test.
function(_fluxtrue_unity_environment target)
    foreach(header IN LISTS arg_MOCKS)
        _fluxtrue_mock_library("${header}" mock copy)
        add_dependencies(${target} ${mock}) # the mock's header
        target_include_directories(${target} BEFORE PRIVATE "${copy}")
    endforeach()
    target_include_directories(${target} PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}"
        "${CMAKE_SOURCE_DIR}/firmware" "${CMAKE_SOURCE_DIR}/tests"
        "${CMAKE_SOURCE_DIR}/tests/support" "${CMAKE_SOURCE_DIR}" ${arg_INCLUDES})
    target_compile_definitions(${target} PRIVATE ${arg_DEFINITIONS})
    foreach(library IN LISTS arg_LIBS)
        if(TARGET fluxtrue_${library})
            set(library fluxtrue_${library})
        elseif(NOT TARGET ${library} AND NOT library STREQUAL m)
            message(FATAL_ERROR "fluxtrue_unity_test(${arg_NAME}): no library '${library}'")
        endif()
        target_link_libraries(${target} PRIVATE ${library})
    endforeach()
    target_link_libraries(${target} PRIVATE fluxtrue_unity m)
    target_link_libraries(${target} PRIVATE fluxtrue_strict fluxtrue_covered)
endfunction()

# Adds sources to a test. Those below tests/ are compiled once for all tests of the folder that have the same ones and
# compile them in the same way. The firmware's stay the test's own: there tools/fluxtrue mutate searches a source that a
# test compiles with other definitions.
function(_fluxtrue_unity_sources)
    set(common "")
    foreach(source IN LISTS ARGN)
        cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
        cmake_path(IS_PREFIX CMAKE_CURRENT_SOURCE_DIR "${source}" is_here)
        if(is_here)
            list(APPEND common "${source}")
        else()
            target_sources(${arg_NAME} PRIVATE "${source}")
        endif()
    endforeach()
    if(common)
        string(MD5 key "${common}|${arg_MOCKS}|${arg_LIBS}|${arg_INCLUDES}|${arg_DEFINITIONS}")
        string(SUBSTRING "${key}" 0 8 key)
        cmake_path(GET CMAKE_CURRENT_SOURCE_DIR FILENAME place)
        set(library fluxtrue_common_${place}_${key})
        if(NOT TARGET ${library})
            add_library(${library} OBJECT ${common})
            _fluxtrue_unity_environment(${library})
        endif()
        target_sources(${arg_NAME} PRIVATE $<TARGET_OBJECTS:${library}>)
    endif()
endfunction()

# fluxtrue_unity_test(NAME <n> SOURCES <test.c> [<more.c> ...] [LIBS <layer or library> ...]
#                     [MOCKS hal/adc.h ...] [MOTOR <shipped motor>] [INCLUDES <folder> ...]
#                     [DEFINITIONS <D> ...] [LABELS <label> ...])
# The first source holds the test functions. LIBS: fx, signal, ... or any target. Label: unit.
function(fluxtrue_unity_test)
    cmake_parse_arguments(PARSE_ARGV 0 arg "" "NAME;MOTOR"
        "SOURCES;LIBS;MOCKS;INCLUDES;DEFINITIONS;LABELS")
    if(arg_UNPARSED_ARGUMENTS OR NOT arg_NAME OR NOT arg_SOURCES)
        message(FATAL_ERROR "fluxtrue_unity_test: NAME and SOURCES wanted; unknown: "
                            "${arg_UNPARSED_ARGUMENTS}")
    endif()
    if(NOT FLUXTRUE_UNIT_TESTS)
        return()
    endif()
    set(folder "${CMAKE_CURRENT_BINARY_DIR}/${arg_NAME}.generated")
    list(POP_FRONT arg_SOURCES test)
    cmake_path(ABSOLUTE_PATH test BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}")
    set(runner "${folder}/runner.c")
    add_custom_command(
        OUTPUT "${runner}"
        COMMAND "${CMAKE_COMMAND}" -E make_directory "${folder}"
        COMMAND ${ruby} "${unity}/auto/generate_test_runner.rb"
            "${CMAKE_BINARY_DIR}/cmock.yml" "${test}" "${runner}"
        DEPENDS "${test}" "${CMAKE_BINARY_DIR}/cmock.yml"
        COMMENT "Test runner of ${arg_NAME}"
        VERBATIM)
    set_source_files_properties("${runner}" PROPERTIES COMPILE_OPTIONS -w)
    add_executable(${arg_NAME} "${test}" "${runner}")
    _fluxtrue_unity_sources(${arg_SOURCES})
    _fluxtrue_unity_environment(${arg_NAME})
    foreach(header IN LISTS arg_MOCKS)
        _fluxtrue_mock_library("${header}" mock copy)
        target_sources(${arg_NAME} PRIVATE $<TARGET_OBJECTS:${mock}>)
    endforeach()
    # The generated runner calls the test functions by name: they have no prototypes.
    set_source_files_properties("${test}" PROPERTIES COMPILE_OPTIONS -Wno-missing-prototypes)
    if(arg_MOTOR)
        target_sources(${arg_NAME} PRIVATE $<TARGET_OBJECTS:motor_${arg_MOTOR}>)
    endif()

    if(NOT arg_LABELS)
        set(arg_LABELS unit)
    endif()
    string(FIND "${CMAKE_CURRENT_SOURCE_DIR}/" "${CMAKE_SOURCE_DIR}/tests/unit/" place)
    list(FILTER arg_LIBS INCLUDE REGEX "^(fx|signal|control|safety|second_level|comm|drive|firmware)$")
    if(place EQUAL 0 AND arg_LIBS)
        list(APPEND arg_LABELS coverage)
        add_dependencies(fluxtrue_coverage_tests ${arg_NAME})
    endif()
    add_test(NAME ${arg_NAME} COMMAND ${arg_NAME})
    set_tests_properties(${arg_NAME} PROPERTIES LABELS "${arg_LABELS}")
    fluxtrue_test_time(${arg_NAME})
endfunction()
