# Steps of the test scripts in this folder.

# With a compiler cache, objects beside precompiled headers are found again, as in the presets.
set(ENV{CCACHE_SLOPPINESS} pch_defines,time_macros,include_file_mtime,include_file_ctime)

# Runs a command; its output goes to the variable `output`. On failure stops the test and shows the output.
function(run)
    execute_process(COMMAND ${ARGN}
        RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE errors)
    if(NOT result EQUAL 0)
        list(JOIN ARGN " " command)
        message(NOTICE "${output}\n${errors}")
        message(FATAL_ERROR "failed with ${result}: ${command}")
    endif()
    set(output "${output}" PARENT_SCOPE)
endfunction()

# Configures a project from scratch and builds it; reuses up-to-date objects.
function(build_project source build)
    run(${CMAKE_COMMAND} --fresh -S ${source} -B ${build} -G ${GENERATOR}
        -DCMAKE_BUILD_TYPE=${BUILD_TYPE}
        -DCMAKE_CXX_COMPILER=${COMPILER}
        -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}
        "-DCMAKE_CXX_FLAGS=${FLAGS}"
        ${ARGN})
    run(${CMAKE_COMMAND} --build ${build})
endfunction()

# Runs the tests of a project that was built.
function(test_project build)
    run(${CMAKE_CTEST_COMMAND} --test-dir ${build} --parallel 2 --output-on-failure --no-tests=error)
endfunction()

# Sets a variable to the names of all libraries that a program loads, directly or indirectly.
function(find_loaded_libraries program names_out)
    run(ldd ${program})
    if(output MATCHES "not found")
        message(FATAL_ERROR "${program} wants libraries that are not there:\n${output}")
    endif()
    string(REGEX REPLACE "[ \t]*([^ \n]*/)?([^ /\n]+) [^\n]*\n" "\\2;" libraries "${output}")
    string(REGEX REPLACE ";$" "" libraries "${libraries}")
    list(FILTER libraries EXCLUDE REGEX "^linux-(vdso|gate)")
    set(${names_out} ${libraries} PARENT_SCOPE)
endfunction()

# Reads the nth code block (from 1) of a language from a page of the repository.
function(read_block page language number text_out)
    set(path ${SOURCE_DIR}/${page})
    file(READ ${path} text)
    foreach(i RANGE 1 ${number})
        string(FIND "${text}" "\n```${language}\n" begin)
        if(begin LESS 0)
            message(FATAL_ERROR "${path} has no block number ${number} of ${language}")
        endif()
        string(LENGTH "\n```${language}\n" skipped)
        math(EXPR begin "${begin} + ${skipped}")
        string(SUBSTRING "${text}" ${begin} -1 text)
    endforeach()
    string(FIND "${text}" "```" end)
    string(SUBSTRING "${text}" 0 ${end} block)
    set(${text_out} "${block}" PARENT_SCOPE)
endfunction()

# Stops the test where the nth code block of a page differs from a program of the repository without its licence line.
function(expect_shown page number program)
    file(READ ${SOURCE_DIR}/${program} text)
    string(REGEX REPLACE "^// SPDX[^\n]*\n" "" text "${text}")
    read_block(${page} cpp ${number} shown)
    expect_same("the program of ${program} in ${page}" "${shown}" "${text}")
endfunction()

# Stops the test where a program of a page is not a part of one of examples/, word for word.
function(expect_excerpts page)
    file(GLOB examples ${SOURCE_DIR}/examples/*.cpp)
    set(all)
    foreach(example IN LISTS examples)
        file(READ ${example} text)
        string(APPEND all "${text}")
    endforeach()
    file(READ ${SOURCE_DIR}/${page} text)
    string(REGEX MATCHALL "\n```cpp\n" blocks "${text}")
    list(LENGTH blocks count)
    foreach(i RANGE 1 ${count})
        read_block(${page} cpp ${i} shown)
        string(FIND "${all}" "${shown}" place)
        if(place LESS 0)
            message(FATAL_ERROR "${page} shows a program that is in none of examples/:\n${shown}")
        endif()
    endforeach()
endfunction()

# Stops the test where a program of the repository is longer.
function(expect_at_most_lines program limit)
    file(READ ${SOURCE_DIR}/${program} text)
    string(REGEX MATCHALL "\n" lines "${text}")
    list(LENGTH lines count)
    if(count GREATER limit)
        message(FATAL_ERROR "${program} has ${count} lines, more than ${limit}")
    endif()
endfunction()

# Stops the test where a page has a link to a missing file or folder of the repository.
function(expect_links page)
    file(READ ${SOURCE_DIR}/${page} text)
    get_filename_component(folder ${SOURCE_DIR}/${page} DIRECTORY)
    string(REGEX REPLACE "```[^`]*```" "" text "${text}")
    # brackets would join list elements
    string(REPLACE "[" "<" text "${text}")
    string(REPLACE "]" ">" text "${text}")
    string(REGEX MATCHALL ">\\([^):]+\\)" links "${text}")
    foreach(link IN LISTS links)
        string(REGEX REPLACE "^>\\((.*)\\)$" "\\1" path "${link}")
        if(NOT EXISTS ${folder}/${path})
            message(FATAL_ERROR "${page} links to ${path}, which does not exist")
        endif()
    endforeach()
endfunction()

# Stops the test where two texts differ.
function(expect_same what actual expected)
    if(NOT actual STREQUAL expected)
        message(NOTICE "--- is\n${actual}\n--- should be\n${expected}")
        message(FATAL_ERROR "not as it should be: ${what}")
    endif()
endfunction()
