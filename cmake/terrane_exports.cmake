# What a shared library exports (BUILD_SHARED_LIBS): the names of its public headers in namespace terrane, and nothing
# of Eigen, the standard library, OpenVDB or its own private classes.
#
# A version script decides it, made from the headers in one place, instead of a macro on every class and function: the
# headers stay readable, and a new one needs nothing. A name is exported if a public header has a class or function of
# that name, and a class with all that is nested in it. What components share (base/, and a chunk's private part) is
# exported too, from terrane::internal.

# terrane_limit_exports(target headers...)
function(terrane_limit_exports target)
    get_target_property(type ${target} TYPE)
    if(NOT type STREQUAL "SHARED_LIBRARY")
        return()
    endif()
    set(names)
    foreach(header IN LISTS ARGN)
        terrane_declared_names(${CMAKE_CURRENT_SOURCE_DIR}/${header} declared)
        list(APPEND names ${declared})
    endforeach()
    set(shared internal::library_is_version_${PROJECT_VERSION_MAJOR}_${PROJECT_VERSION_MINOR} internal::assert_failed)
    # Private headers whose functions other components call.
    file(GLOB private_headers ${PROJECT_SOURCE_DIR}/base/*.h)
    if(target STREQUAL "terrane_terrain")
        set(private_headers ${PROJECT_SOURCE_DIR}/terrain/chunk/chunk_vertices.h)
    elseif(NOT target STREQUAL "terrane_base")
        set(private_headers)
    endif()
    foreach(header IN LISTS private_headers)
        terrane_declared_names(${header} declared)
        list(TRANSFORM declared PREPEND internal::)
        list(APPEND shared ${declared})
    endforeach()
    list(APPEND names ${shared})
    list(REMOVE_DUPLICATES names)
    set(patterns)
    foreach(name IN LISTS names)
        # a function, a class, their overloads, and what the compiler makes of a class
        string(APPEND patterns
            "      terrane::${name};\n      terrane::${name}[!A-Za-z0-9_]*;\n      *?for?terrane::${name};\n      *?for?terrane::${name}::*;\n")
    endforeach()
    set(map ${CMAKE_CURRENT_BINARY_DIR}/${target}.map)
    file(CONFIGURE OUTPUT ${map} CONTENT
        "TERRANE_${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} {\n  global:\n    extern \"C++\" {\n${patterns}    };\n  local:\n    *;\n};\n" @ONLY)
    target_link_options(${target} PRIVATE -Wl,--version-script=${map} -Wl,--no-undefined)
    # Components find each other beside themselves, wherever they are installed.
    set_target_properties(${target} PROPERTIES INSTALL_RPATH "\$ORIGIN")
    # Functions of the library call each other directly; inline ones of others are not exported.
    target_compile_options(${target} PRIVATE -fno-semantic-interposition -fvisibility-inlines-hidden)
    set_property(TARGET ${target} APPEND PROPERTY LINK_DEPENDS ${map})
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${ARGN})
endfunction()

# The names of classes and functions that a header declares, and of parameters' types with them.
function(terrane_declared_names header names_out)
    file(READ ${header} text)
    string(REGEX REPLACE "//[^\n]*" "" text "${text}")
    string(REGEX MATCHALL "(class|struct) +[A-Za-z0-9_]+|[A-Za-z0-9_]+\\(|const [a-z_]+ k[A-Za-z0-9_]+" found "${text}")
    list(TRANSFORM found REPLACE "^(.* )?([A-Za-z0-9_]+)\\(?$" "\\2")
    set(${names_out} ${found} PARENT_SCOPE)
endfunction()
