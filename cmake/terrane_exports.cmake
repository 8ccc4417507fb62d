# Limits what a shared library exports (BUILD_SHARED_LIBS) to the names in namespace terrane that its public headers
# declare. Names of Eigen, the standard library, OpenVDB and the library's own private classes are not exported.
#
# A version script, generated from the headers, does this instead of a macro on every class and function, so that
# headers stay readable and new headers need nothing. It exports the functions and classes that a public header
# declares, all names nested in these classes, and names in terrane::internal that other components use: those of base/,
# of a chunk's private part and of a raster's surface.

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
        file(GLOB private_headers ${PROJECT_SOURCE_DIR}/terrain/bilinear/*.h)
        list(APPEND private_headers ${PROJECT_SOURCE_DIR}/terrain/chunk/chunk_vertices.h)
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
        # functions and classes of this name, overloads, nested names, and what the compiler generates for a class
        string(APPEND patterns
            "      terrane::${name};\n      terrane::${name}[!A-Za-z0-9_]*;\n      *?for?terrane::${name};\n      *?for?terrane::${name}::*;\n")
    endforeach()
    set(map ${CMAKE_CURRENT_BINARY_DIR}/${target}.map)
    file(CONFIGURE OUTPUT ${map} CONTENT
        "TERRANE_${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} {\n  global:\n    extern \"C++\" {\n${patterns}    };\n  local:\n    *;\n};\n" @ONLY)
    target_link_options(${target} PRIVATE -Wl,--version-script=${map} -Wl,--no-undefined)
    # A library looks for other components in its own folder, wherever they are installed.
    set_target_properties(${target} PROPERTIES INSTALL_RPATH "\$ORIGIN")
    # Functions of the library call each other directly. Inline functions of other libraries are not exported.
    target_compile_options(${target} PRIVATE -fno-semantic-interposition -fvisibility-inlines-hidden)
    set_property(TARGET ${target} APPEND PROPERTY LINK_DEPENDS ${map})
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${ARGN})
endfunction()

# The names of the classes, functions and constants that a header declares; also returns some names that it only uses.
function(terrane_declared_names header names_out)
    file(READ ${header} text)
    string(REGEX REPLACE "//[^\n]*" "" text "${text}")
    string(REGEX MATCHALL "(class|struct) +[A-Za-z0-9_]+|[A-Za-z0-9_]+\\(|const [a-z_]+ k[A-Za-z0-9_]+" found "${text}")
    list(TRANSFORM found REPLACE "^(.* )?([A-Za-z0-9_]+)\\(?$" "\\2")
    set(${names_out} ${found} PARENT_SCOPE)
endfunction()
