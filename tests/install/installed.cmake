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

# What is wrong with a component is an error that names it; an optional component that cannot be used is none.
function(find_components word components)
    file(WRITE ${WORK_DIR}/components/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)
project(components LANGUAGES CXX)
find_package(terrane REQUIRED COMPONENTS ${components})
foreach(component IN ITEMS scene dem volumes)
    message(STATUS \"\${component}=\${terrane_\${component}_FOUND}\")
endforeach()
")
    execute_process(
        COMMAND ${CMAKE_COMMAND} --fresh -S ${WORK_DIR}/components -B ${WORK_DIR}/components/build
            -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_PREFIX_PATH=${prefix} ${ARGN}
        OUTPUT_VARIABLE output ERROR_VARIABLE output)
    string(REGEX REPLACE "[ \n]+" " " output "${output}")  # CMake wraps messages
    if(NOT output MATCHES "${word}")
        message(FATAL_ERROR "find_package() with the components ${components} does not say '${word}':\n${output}")
    endif()
    set(output "${output}" PARENT_SCOPE)
endfunction()
find_components("The component 'volumes' of Terrane is not found; known are base, terrain, .* render\\." "terrain volumes")
if(COMPONENTS MATCHES "scene" AND COMPONENTS MATCHES "dem")
    find_components("The component 'dem' of Terrane needs GDAL 3.3, which was not found\\." "terrain dem"
        -DCMAKE_DISABLE_FIND_PACKAGE_GDAL=ON)
    find_components("scene=TRUE -- dem=FALSE -- volumes=FALSE"
        "terrain OPTIONAL_COMPONENTS scene dem volumes" -DCMAKE_DISABLE_FIND_PACKAGE_GDAL=ON)
    file(COPY ${prefix}/ DESTINATION ${WORK_DIR}/without_store)
    file(GLOB targets ${WORK_DIR}/without_store/lib/*/cmake/terrane/terrane_store_targets*.cmake
        ${WORK_DIR}/without_store/lib/cmake/terrane/terrane_store_targets*.cmake)
    file(REMOVE ${targets})
    find_components("The component 'dem' of Terrane needs the component 'store', which is not installed in [^ ]*without_store[^ ]*\\."
        "terrain dem" -DCMAKE_PREFIX_PATH=${WORK_DIR}/without_store)
    file(REMOVE_RECURSE ${WORK_DIR}/without_store)
endif()
