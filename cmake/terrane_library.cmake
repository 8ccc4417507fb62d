# How every library of Terrane is built.

# The compile options of all of Terrane's own code, which are never exported.
add_library(terrane_options INTERFACE)
target_compile_options(terrane_options INTERFACE
    # No fused multiply-add, so that every compiler and processor gives the same bits.
    -ffp-contract=off
    # No code reads errno or floating-point traps: square roots and selections may be vectorised, with the same results.
    -fno-math-errno -fno-trapping-math
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wnon-virtual-dtor
    -Wold-style-cast -Woverloaded-virtual
    # GCC takes the sources in a unity build for headers, and would warn of classes with members of internal linkage.
    $<$<AND:$<BOOL:${CMAKE_UNITY_BUILD}>,$<CXX_COMPILER_ID:GNU>>:-Wno-subobject-linkage>
    $<$<BOOL:${TERRANE_WARNINGS_AS_ERRORS}>:-Werror>)
if(TERRANE_SANITIZE)
    target_compile_options(terrane_options INTERFACE -fsanitize=${TERRANE_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(terrane_options INTERFACE -fsanitize=${TERRANE_SANITIZE})
    if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
        target_compile_options(terrane_options INTERFACE
            -fsanitize-ignorelist=${CMAKE_CURRENT_LIST_DIR}/sanitizer_ignorelist.txt)
    endif()
endif()
if(TERRANE_FUZZ)
    # Records executed edges and compared values, which guide libFuzzer.
    target_compile_options(terrane_options INTERFACE -fsanitize=fuzzer-no-link
        -fsanitize-coverage-ignorelist=${PROJECT_SOURCE_DIR}/cmake/coverage_ignorelist.txt
        -fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/cmake/fuzz_ignorelist.txt)
endif()

include(${CMAKE_CURRENT_LIST_DIR}/terrane_exports.cmake)

# terrane_glob_rooms(<out> rooms...)
#
# The sources of some folders, without their sub-folders, in the order given. If CMAKE_UNITY_BUILD is on, the sources of
# a room are compiled as a few translation units of about 60 kB, the size that compiles fastest: headers take half of
# the time of a small unit, and the optimizer's time and memory grow faster than the size of a large unit. A source
# whose names clash with those of its room sets SKIP_UNITY_BUILD_INCLUSION. Sources named *_avx2.cpp and *_avx512.cpp
# are left out, because they are compiled with flags of their own.
function(terrane_glob_rooms out)
    set(all)
    foreach(room IN LISTS ARGN)
        file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${room}/*.cpp)
        list(FILTER sources EXCLUDE REGEX "_avx(2|512)\\.cpp$")
        if(NOT sources)
            message(FATAL_ERROR "no sources in ${CMAKE_CURRENT_SOURCE_DIR}/${room}")
        endif()
        string(MAKE_C_IDENTIFIER "${room}" group)
        set(unit 0)
        set(unit_bytes 0)
        foreach(source IN LISTS sources)
            file(SIZE ${source} bytes)
            if(unit_bytes GREATER_EQUAL 60000)
                math(EXPR unit "${unit} + 1")
                set(unit_bytes 0)
            endif()
            math(EXPR unit_bytes "${unit_bytes} + ${bytes}")
            set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${group}_${unit})
        endforeach()
        list(APPEND all ${sources})
    endforeach()
    set(${out} ${all} PARENT_SCOPE)
endfunction()

# Precompiles headers of the standard library, Eigen and tl::expected, which are most of what a source of Terrane
# includes. All libraries share the precompiled header of terrane_base; a target with additional headers gets its own.
# Sources must still include what they use: tools/check compiles changed sources without precompiled headers.
option(TERRANE_PRECOMPILED_HEADERS "Precompile the headers that most sources include" ON)
function(terrane_precompile_headers target)
    if(NOT TERRANE_PRECOMPILED_HEADERS)
        return()
    endif()
    if(ARGN OR target STREQUAL "terrane_base")
        target_precompile_headers(${target} PRIVATE
            <algorithm> <array> <cmath> <cstddef> <cstdint> <functional> <limits> <map> <memory> <optional>
            <span> <string> <string_view> <utility> <vector> <Eigen/Geometry> <tl/expected.hpp> ${ARGN})
    else()
        target_precompile_headers(${target} REUSE_FROM terrane_base)
    endif()
endfunction()

# terrane_add_library(NAME name ROOMS ... PUBLIC_LINK ... PRIVATE_LINK ...)
#
# Makes terrane_<name> with the alias terrane::<name> from the sources in ROOMS, which are folders in the order of
# docs/rooms.md, the lowest first. All headers in include/terrane/<name>/ are public. A wrong include across components
# does not compile, because a target sees only the include folders of what it links. Private headers are included by
# their path from the component's folder, which begins with the room; those of base/ can be included everywhere.
function(terrane_add_library)
    cmake_parse_arguments(arg "" "NAME" "ROOMS;SOURCES;PUBLIC_LINK;PRIVATE_LINK" ${ARGN})
    set(target terrane_${arg_NAME})
    terrane_glob_rooms(sources ${arg_ROOMS})
    add_library(${target} ${sources} ${arg_SOURCES})
    add_library(terrane::${arg_NAME} ALIAS ${target})
    file(GLOB headers CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} include/terrane/${arg_NAME}/*.h)
    target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS include FILES ${headers})
    target_include_directories(${target} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR} ${PROJECT_SOURCE_DIR})
    target_link_libraries(${target} PUBLIC ${arg_PUBLIC_LINK}
        PRIVATE $<BUILD_INTERFACE:terrane_options> ${arg_PRIVATE_LINK})
    target_compile_features(${target} PUBLIC cxx_std_20)
    terrane_precompile_headers(${target})
    set_target_properties(${target} PROPERTIES
        EXPORT_NAME ${arg_NAME}
        CXX_EXTENSIONS OFF
        POSITION_INDEPENDENT_CODE ON
        UNITY_BUILD_MODE GROUP
        VERSION ${PROJECT_VERSION}
        SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
        VERIFY_INTERFACE_HEADER_SETS ON)
    terrane_limit_exports(${target} ${headers})

    # A component that links a foreign library has a package of its own (terrane_packages.cmake).
    set(foreign ${arg_PRIVATE_LINK})
    list(FILTER foreign EXCLUDE REGEX "^terrane::")
    set(install_component dev)
    if(foreign)
        set(install_component ${arg_NAME})
    endif()
    install(TARGETS ${target} EXPORT terrane_${arg_NAME}_targets FILE_SET HEADERS COMPONENT ${install_component}
        LIBRARY COMPONENT ${install_component} ARCHIVE COMPONENT ${install_component})
    install(EXPORT terrane_${arg_NAME}_targets NAMESPACE terrane::
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/terrane COMPONENT ${install_component})
    set_target_properties(${target} PROPERTIES TERRANE_INSTALL_COMPONENT ${install_component})
    set_property(GLOBAL APPEND PROPERTY TERRANE_COMPONENTS ${arg_NAME})
endfunction()
