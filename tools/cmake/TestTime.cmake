# SPDX-License-Identifier: Apache-2.0
# How long a test may take, and which one begins first: both follow from tests/seconds.txt, nothing is set by hand.
# The time-out only ends a hang: at least ten times what the test takes on an idle computer, and never less than
# FLUXTRUE_LEAST_TIMEOUT_S, which is enough for every test that is not in the file. The longest test begins first.

set(FLUXTRUE_LEAST_TIMEOUT_S 3600)
set(FLUXTRUE_TIMEOUT_FACTOR 10)
if(FLUXTRUE_SANITIZE OR FLUXTRUE_COVERAGE)
    set(FLUXTRUE_TIMEOUT_FACTOR 40) # instrumented code runs up to four times slower
endif()

set(test_seconds "${CMAKE_SOURCE_DIR}/tests/seconds.txt")
set_property(DIRECTORY "${CMAKE_SOURCE_DIR}" APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${test_seconds}")
file(STRINGS "${test_seconds}" FLUXTRUE_TEST_SECONDS REGEX "^[a-z]")

# fluxtrue_test_time(<test>)
function(fluxtrue_test_time name)
    set(seconds 1)
    foreach(line IN LISTS FLUXTRUE_TEST_SECONDS)
        if(line MATCHES "^([^ ]+) +([0-9]+)$" AND CMAKE_MATCH_1 STREQUAL name)
            set(seconds ${CMAKE_MATCH_2})
        endif()
    endforeach()
    math(EXPR timeout "${FLUXTRUE_TIMEOUT_FACTOR} * ${seconds}")
    if(timeout LESS FLUXTRUE_LEAST_TIMEOUT_S)
        set(timeout ${FLUXTRUE_LEAST_TIMEOUT_S})
    endif()
    set_tests_properties(${name} PROPERTIES TIMEOUT ${timeout} COST ${seconds})
endfunction()
