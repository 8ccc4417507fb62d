# Builds Terrane as a part of a stranger's project.
include(${CMAKE_CURRENT_LIST_DIR}/steps.cmake)

# The settings that change how Terrane compiles are those of the build that this test belongs to, so
# that a compiler cache has everything already.
build_project(${CMAKE_CURRENT_LIST_DIR}/stranger ${WORK_DIR}
    -DTERRANE_SOURCE=${SOURCE_DIR} -DCOMPONENTS=${COMPONENTS}
    -DTERRANE_WARNINGS_AS_ERRORS=ON -DTERRANE_ASSERTS=${ASSERTS})

# Somebody else's build gets the libraries, and neither our tests nor our program.
foreach(unwanted IN ITEMS terrane/tests terrane/tools)
    if(EXISTS ${WORK_DIR}/${unwanted})
        message(FATAL_ERROR "${unwanted} was built, and nobody asked for it")
    endif()
endforeach()
run(${CMAKE_CTEST_COMMAND} --test-dir ${WORK_DIR} --output-on-failure --no-tests=error)
