# Builds all components as shared libraries, installs them, looks at what they export, and builds programs against them.
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/steps.cmake)

set(build ${WORK_DIR}/build)
set(prefix ${WORK_DIR}/prefix)
file(REMOVE_RECURSE ${prefix})
build_project(${SOURCE_DIR} ${build} -DBUILD_SHARED_LIBS=ON -DCMAKE_UNITY_BUILD=ON
    -DTERRANE_TESTS=OFF -DTERRANE_TOOLS=OFF -DTERRANE_ASSERTS=${ASSERTS})
run(${CMAKE_COMMAND} --install ${build} --prefix ${prefix})

string(REGEX MATCH "^[0-9]+\\.[0-9]+" soversion "${VERSION}")
string(REPLACE "," ";" components "${COMPONENTS}")
list(REMOVE_ITEM components adapters) # headers alone
foreach(component IN LISTS components)
    set(library ${prefix}/lib/libterrane_${component}.so)
    run(readelf --dynamic ${library})
    if(NOT output MATCHES "soname: \\[libterrane_${component}\\.so\\.${soversion}\\]")
        message(FATAL_ERROR "the soname of ${library} should end in .so.${soversion}:\n${output}")
    endif()
    run(nm --dynamic --defined-only --demangle --format=posix ${library})
    string(REPLACE "[" "<" output "${output}") # brackets would join list elements
    string(REPLACE "]" ">" output "${output}")
    string(REPLACE ";" "," output "${output}")
    string(REPLACE "\n" ";" symbols "${output}")
    list(FILTER symbols EXCLUDE REGEX "^$|^TERRANE_")
    list(LENGTH symbols count)
    message(STATUS "libterrane_${component}.so exports ${count} symbols")
    # One for each public header, or more.
    file(GLOB headers ${prefix}/include/terrane/${component}/*.h)
    list(LENGTH headers header_count)
    if(header_count EQUAL 0 OR count LESS header_count)
        message(FATAL_ERROR "${library} exports ${count} symbols of ${header_count} public headers")
    endif()
    # Names of others, and what belongs to one component alone.
    list(FILTER symbols EXCLUDE REGEX "^((vtable|typeinfo|typeinfo name|VTT|guard variable) for )?terrane::")
    expect_same("symbols of others that ${library} exports" "${symbols}" "")
endforeach()
# Private classes are in the libraries, and not among what they export.
set(private_of_terrain terrane::AmplitudeField terrane::internal::SourceChecks)
set(private_of_collision terrane::internal::LocalGround terrane::internal::PlacedHull)
set(private_of_dem terrane::internal::RasterStore)
set(private_of_volume terrane::internal::TileLevelSet openvdb::)
foreach(component IN LISTS components)
    foreach(name IN LISTS private_of_${component})
        run(nm --demangle --defined-only ${prefix}/lib/libterrane_${component}.so)
        if(NOT output MATCHES "${name}")
            message(FATAL_ERROR "libterrane_${component}.so has no ${name}: this test should know another")
        endif()
        run(nm --demangle --defined-only --dynamic ${prefix}/lib/libterrane_${component}.so)
        if(output MATCHES "${name}")
            message(FATAL_ERROR "libterrane_${component}.so exports its private ${name}")
        endif()
    endforeach()
endforeach()

build_project(${CMAKE_CURRENT_LIST_DIR}/stranger ${WORK_DIR}/stranger
    -DCMAKE_PREFIX_PATH=${prefix} -DCOMPONENTS=${COMPONENTS})
test_project(${WORK_DIR}/stranger)

# pkg-config names what public headers need, and nothing else.
set(ENV{PKG_CONFIG_PATH} ${prefix}/lib/pkgconfig)
foreach(component IN LISTS components)
    run(pkg-config --libs terrane-${component})
    if(output MATCHES "gdal|openvdb|zstd|epoxy|png|tbb")
        message(FATAL_ERROR "a program would link what libterrane_${component}.so links itself: ${output}")
    endif()
endforeach()
