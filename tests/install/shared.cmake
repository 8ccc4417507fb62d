# Builds all components as shared libraries, installs them, looks at what they export, and builds programs against them.
include(${CMAKE_CURRENT_LIST_DIR}/steps.cmake)

set(build ${WORK_DIR}/build)
set(prefix ${WORK_DIR}/prefix)
file(REMOVE_RECURSE ${prefix})
build_project(${SOURCE_DIR} ${build} -DBUILD_SHARED_LIBS=ON -DCMAKE_UNITY_BUILD=ON
    -DTERRANE_TESTS=OFF -DTERRANE_TOOLS=OFF -DTERRANE_ASSERTS=${ASSERTS})
run(${CMAKE_COMMAND} --install ${build} --prefix ${prefix})

string(REGEX MATCH "^[0-9]+\\.[0-9]+" soversion "${VERSION}")
string(REPLACE "," ";" components "${COMPONENTS}")
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
    if(count LESS 5)
        message(FATAL_ERROR "${library} exports nothing")
    endif()
    # Names of others, and what belongs to one component alone.
    list(FILTER symbols EXCLUDE REGEX "^((vtable|typeinfo|typeinfo name|VTT|guard variable) for )?terrane::")
    expect_same("symbols of others that ${library} exports" "${symbols}" "")
endforeach()
foreach(private IN ITEMS terrain:internal::NoiseKeys terrain:AmplitudeField collision:internal::ContactSolver
        dem:internal::RasterStore volume:openvdb)
    string(REGEX MATCH "^(.*):(.*)$" matched "${private}")
    string(REGEX REPLACE "^([a-z]+):.*$" "\\1" component "${private}")
    string(REGEX REPLACE "^[a-z]+:" "" name "${private}")
    if(NOT component IN_LIST components)
        continue()
    endif()
    run(nm --dynamic --defined-only --demangle ${prefix}/lib/libterrane_${component}.so)
    if(output MATCHES " [A-Z] [^\n]*${name}::")
        message(FATAL_ERROR "libterrane_${component}.so exports its private ${name}")
    endif()
endforeach()

build_project(${CMAKE_CURRENT_LIST_DIR}/stranger ${WORK_DIR}/stranger
    -DCMAKE_PREFIX_PATH=${prefix} -DCOMPONENTS=${COMPONENTS})
run(${CMAKE_CTEST_COMMAND} --test-dir ${WORK_DIR}/stranger --output-on-failure --no-tests=error)

# pkg-config names what public headers need, and nothing else.
set(ENV{PKG_CONFIG_PATH} ${prefix}/lib/pkgconfig)
foreach(component IN LISTS components)
    run(pkg-config --libs terrane-${component})
    if(output MATCHES "gdal|openvdb|zstd|epoxy|png|tbb")
        message(FATAL_ERROR "a program would link what libterrane_${component}.so links itself: ${output}")
    endif()
endforeach()
