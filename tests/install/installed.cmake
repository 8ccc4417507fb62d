# Builds two projects against an installed Terrane: README's program with only the dependencies of heights, and a
# simulator with every component.
include(${CMAKE_CURRENT_LIST_DIR}/steps.cmake)

set(prefix ${PREFIX})

# The component `terrain` neither searches for GDAL, zstd, OpenVDB, PNG and epoxy nor loads them.
build_project(${CMAKE_CURRENT_LIST_DIR}/readme_example ${WORK_DIR}/readme_example
    -DCMAKE_PREFIX_PATH=${prefix}
    -DCMAKE_DISABLE_FIND_PACKAGE_GDAL=ON
    -DCMAKE_DISABLE_FIND_PACKAGE_OpenVDB=ON
    -DCMAKE_DISABLE_FIND_PACKAGE_TBB=ON
    -DCMAKE_DISABLE_FIND_PACKAGE_EXPAT=ON
    -DCMAKE_DISABLE_FIND_PACKAGE_PNG=ON
    -DCMAKE_DISABLE_FIND_PACKAGE_PkgConfig=ON)
set(foreign "^lib(gdal|zstd|expat|openvdb|tbb|png|epoxy|EGL|GL|GLX|GLdispatch|OpenGL)[^a-z]")
find_loaded_libraries(${WORK_DIR}/readme_example/first_ground loaded)
list(FILTER loaded INCLUDE REGEX "${foreign}")
expect_same("the libraries that heights load for nothing" "${loaded}" "")
run(${WORK_DIR}/readme_example/first_ground)
read_block(README.md text 1 told)
expect_same("what README's program prints" "${output}" "${told}")

# The installed examples.
file(GLOB pages RELATIVE ${SOURCE_DIR}/docs ${SOURCE_DIR}/docs/*.md)
foreach(page IN LISTS pages)
    if(NOT EXISTS ${prefix}/share/doc/terrane/docs/${page})
        message(FATAL_ERROR "docs/${page} was not installed")
    endif()
endforeach()
build_project(${prefix}/share/doc/terrane/examples ${WORK_DIR}/examples -DCMAKE_PREFIX_PATH=${prefix})
test_project(${WORK_DIR}/examples)

build_project(${CMAKE_CURRENT_LIST_DIR}/stranger ${WORK_DIR}/stranger
    -DCMAKE_PREFIX_PATH=${prefix} -DCOMPONENTS=${COMPONENTS})
test_project(${WORK_DIR}/stranger)

# Foreign libraries that programs load: OpenVDB and TBB only with volumes, GDAL with rasters (the test of the check
# above), and Expat alone for camera paths, which come without the program, GDAL and OpenGL.
set(must_load_raster "libgdal")
set(must_load_cave "libopenvdb")
set(must_load_flown "^libexpat[^;]*$")
foreach(program IN ITEMS height ball baked raster flown picture cave)
    if(NOT EXISTS ${WORK_DIR}/stranger/${program})
        continue()
    endif()
    find_loaded_libraries(${WORK_DIR}/stranger/${program} loaded)
    list(FILTER loaded INCLUDE REGEX "${foreign}")
    if(DEFINED must_load_${program} AND NOT loaded MATCHES "${must_load_${program}}")
        message(FATAL_ERROR "${program} loads '${loaded}', which should match ${must_load_${program}}")
    endif()
    if(NOT program STREQUAL "cave" AND loaded MATCHES "lib(openvdb|tbb)[^a-z]")
        message(FATAL_ERROR "${program} loads the libraries of volumes for nothing: ${loaded}")
    endif()
endforeach()

# Heights and contact alone: the libraries of the C++ compiler and no others, and at most 3 MB.
if(COMPONENTS MATCHES "collision" AND BUILD_TYPE STREQUAL "Release")
    find_loaded_libraries(${WORK_DIR}/stranger/ball loaded)
    list(FILTER loaded EXCLUDE REGEX "^(lib(stdc\\+\\+|m|gcc_s|c|pthread)|ld-linux.*)\\.so")
    expect_same("the libraries that heights and contact load" "${loaded}" "")
    run(strip -o ${WORK_DIR}/ball ${WORK_DIR}/stranger/ball)
    file(SIZE ${WORK_DIR}/ball bytes)
    message(STATUS "a program with heights and contact has ${bytes} bytes")
    if(bytes GREATER 3000000)
        message(FATAL_ERROR "a program with heights and contact has ${bytes} bytes, more than 3,000,000")
    endif()
endif()

# A component that is not installed is an error that names it.
execute_process(
    COMMAND ${CMAKE_COMMAND} --fresh -S ${CMAKE_CURRENT_LIST_DIR}/stranger -B ${WORK_DIR}/missing
        -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_PREFIX_PATH=${prefix}
        -DCOMPONENTS=terrain,no_such_component
    RESULT_VARIABLE result OUTPUT_QUIET ERROR_VARIABLE errors)
if(result EQUAL 0 OR NOT errors MATCHES "no_such_component")
    message(NOTICE "${errors}")
    message(FATAL_ERROR "a missing component was not named")
endif()
