# SPDX-License-Identifier: Apache-2.0
# Tests written in Python, and the checkers of tools/checks, as ctest tests.
include(TestTime)

# One thread for linear algebra: ctest runs more tests at a time than there are processors, and OpenBLAS lets threads
# that have nothing to do spin.
set(FLUXTRUE_TEST_ENVIRONMENT
    "PYTHONPATH=${CMAKE_SOURCE_DIR}/tools" PYTHONDONTWRITEBYTECODE=1 MPLBACKEND=Agg OPENBLAS_NUM_THREADS=1
    "FLUXTRUE_BUILD_DIR=${CMAKE_BINARY_DIR}")
if(FLUXTRUE_SANITIZE)
    # Python itself is not instrumented: the sanitizer must be there before our library is loaded,
    # and what the interpreter leaks at exit is not our concern.
    execute_process(COMMAND "${CMAKE_C_COMPILER}" -print-file-name=libasan.so
        OUTPUT_VARIABLE libasan OUTPUT_STRIP_TRAILING_WHITESPACE)
    # Without the C++ library beside it the sanitizer dies of the first exception that SciPy throws.
    execute_process(COMMAND "${CMAKE_C_COMPILER}" -print-file-name=libstdc++.so.6
        OUTPUT_VARIABLE libstdcxx OUTPUT_STRIP_TRAILING_WHITESPACE)
    set(FLUXTRUE_PRELOAD "LD_PRELOAD=${libasan}:${libstdcxx}" ASAN_OPTIONS=detect_leaks=0)
endif()

function(_fluxtrue_python_test name labels)
    set_tests_properties(${name} PROPERTIES LABELS "${labels}" ENVIRONMENT "${FLUXTRUE_TEST_ENVIRONMENT}")
    fluxtrue_test_time(${name})
endfunction()

# fluxtrue_pytest(NAME <n> PATH <file or folder> [ARGS <pytest argument> ...] [LABELS <label> ...]
#                 [IMPORTS <folder below tests, whose modules the test imports> ...])
function(fluxtrue_pytest)
    cmake_parse_arguments(PARSE_ARGV 0 arg "" "NAME;PATH" "ARGS;LABELS;IMPORTS")
    if(arg_UNPARSED_ARGUMENTS OR NOT arg_NAME OR NOT arg_PATH)
        message(FATAL_ERROR "fluxtrue_pytest: NAME and PATH wanted; unknown: "
                            "${arg_UNPARSED_ARGUMENTS}")
    endif()
    if(FLUXTRUE_TESTS STREQUAL OFF)
        return()
    endif()
    # Hypothesis loads a module of its own at a session's very end, which CPython 3.11 refuses after a test has met the
    # limit of recursion (a broken MDF file does that): only the tests that use Hypothesis get its plugin.
    set(plugins -p no:hypothesispytest)
    if(arg_NAME MATCHES "abuse")
        set(plugins "")
    endif()
    # Relative to tests/pytest.ini: pytest splits the value at blanks, which the path of the checkout may contain.
    set(imports)
    if(arg_IMPORTS)
        list(JOIN arg_IMPORTS " " folders)
        set(imports -o "pythonpath=support motors ${folders}")
    endif()
    cmake_path(ABSOLUTE_PATH arg_PATH BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}")
    add_test(NAME ${arg_NAME}
        COMMAND "${CMAKE_COMMAND}" -E env ${FLUXTRUE_PRELOAD}
            "${FLUXTRUE_PYTHON}" -m pytest -q -c "${CMAKE_SOURCE_DIR}/tests/pytest.ini"
            -p no:cacheprovider ${plugins} ${imports} ${arg_ARGS} "${arg_PATH}"
        WORKING_DIRECTORY "${CMAKE_SOURCE_DIR}")
    _fluxtrue_python_test(${arg_NAME} "${arg_LABELS}")
endfunction()

# fluxtrue_check(NAME <n> SCRIPT <file of tools/checks> [ARGS <argument> ...])
function(fluxtrue_check)
    cmake_parse_arguments(PARSE_ARGV 0 arg "" "NAME;SCRIPT" "ARGS")
    if(FLUXTRUE_TESTS STREQUAL OFF)
        return()
    endif()
    add_test(NAME ${arg_NAME}
        COMMAND "${FLUXTRUE_PYTHON}" "${CMAKE_SOURCE_DIR}/tools/checks/${arg_SCRIPT}" ${arg_ARGS}
        WORKING_DIRECTORY "${CMAKE_SOURCE_DIR}")
    _fluxtrue_python_test(${arg_NAME} check)
endfunction()
