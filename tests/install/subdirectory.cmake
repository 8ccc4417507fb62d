# Builds Terrane as a subdirectory of another project.
include(${CMAKE_CURRENT_LIST_DIR}/steps.cmake)

# One translation unit a room and no optimisation: the test is about the build, and takes minutes otherwise.
set(BUILD_TYPE None)
set(FLAGS "${FLAGS} -O0")
build_project(${CMAKE_CURRENT_LIST_DIR}/stranger ${WORK_DIR}
    -DTERRANE_SOURCE=${SOURCE_DIR} -DCOMPONENTS=${COMPONENTS} -DCMAKE_UNITY_BUILD=ON
    -DTERRANE_WARNINGS_AS_ERRORS=ON -DTERRANE_ASSERTS=${ASSERTS})

# A subdirectory build has the libraries, without tests and program.
foreach(unwanted IN ITEMS terrane/tests terrane/tools)
    if(EXISTS ${WORK_DIR}/${unwanted})
        message(FATAL_ERROR "${unwanted} was built, and nobody asked for it")
    endif()
endforeach()
test_project(${WORK_DIR})
