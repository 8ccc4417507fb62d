# Steps of the test scripts in this folder.

# Runs a command; its output goes to the variable `output`. Stops the test, and shows all of it, where
# it fails.
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

# Configures a project from scratch and builds it. What was compiled before is kept where it is the
# same.
function(build_project source build)
    run(${CMAKE_COMMAND} --fresh -S ${source} -B ${build} -G ${GENERATOR}
        -DCMAKE_BUILD_TYPE=${BUILD_TYPE}
        -DCMAKE_CXX_COMPILER=${COMPILER}
        -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}
        "-DCMAKE_CXX_FLAGS=${FLAGS}"
        ${ARGN})
    run(${CMAKE_COMMAND} --build ${build})
endfunction()

# Puts the names of all libraries that a program loads, directly or not, into a variable.
function(find_loaded_libraries program names_out)
    file(GET_RUNTIME_DEPENDENCIES EXECUTABLES ${program} RESOLVED_DEPENDENCIES_VAR libraries
        UNRESOLVED_DEPENDENCIES_VAR missing)
    if(missing)
        message(FATAL_ERROR "${program} wants libraries that are not there: ${missing}")
    endif()
    list(TRANSFORM libraries REPLACE "^.*/" "")
    set(${names_out} ${libraries} PARENT_SCOPE)
endfunction()

# Reads the nth block (from 1) of a language out of README.md.
function(read_readme_block language number text_out)
    set(readme ${SOURCE_DIR}/README.md)
    file(READ ${readme} text)
    foreach(i RANGE 1 ${number})
        string(FIND "${text}" "\n```${language}\n" begin)
        if(begin LESS 0)
            message(FATAL_ERROR "${readme} has no block number ${number} of ${language}")
        endif()
        string(LENGTH "\n```${language}\n" skipped)
        math(EXPR begin "${begin} + ${skipped}")
        string(SUBSTRING "${text}" ${begin} -1 text)
    endforeach()
    string(FIND "${text}" "```" end)
    string(SUBSTRING "${text}" 0 ${end} block)
    set(${text_out} "${block}" PARENT_SCOPE)
endfunction()

# Stops the test where two texts differ.
function(expect_same what actual expected)
    if(NOT actual STREQUAL expected)
        message(NOTICE "--- is\n${actual}\n--- should be\n${expected}")
        message(FATAL_ERROR "not as it should be: ${what}")
    endif()
endfunction()
