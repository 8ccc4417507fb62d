# How every library of Terrane is built.

# What all of our own code is compiled with; never exported.
add_library(terrane_options INTERFACE)
target_compile_options(terrane_options INTERFACE
    # The same bits with every compiler and processor: no fused multiply-add behind our back.
    -ffp-contract=off
    # Nobody reads errno or floating-point traps: square roots and choices may become vectors. No bit changes.
    -fno-math-errno -fno-trapping-math
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wnon-virtual-dtor
    -Wold-style-cast -Woverloaded-virtual
    $<$<BOOL:${TERRANE_WARNINGS_AS_ERRORS}>:-Werror>)
if(TERRANE_SANITIZE)
    target_compile_options(terrane_options INTERFACE -fsanitize=${TERRANE_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(terrane_options INTERFACE -fsanitize=${TERRANE_SANITIZE})
endif()

# terrane_add_library(NAME name SOURCES ... HEADERS ... PRIVATE_DIRS ... PUBLIC_LINK ... PRIVATE_LINK ...)
#
# Makes terrane_<name> with the alias terrane::<name>. Public headers live in
# include/terrane/<name>/; a wrong include across components does not compile, because a target sees
# only the include folders of what it links.
function(terrane_add_library)
    cmake_parse_arguments(arg "" "NAME" "SOURCES;HEADERS;PRIVATE_DIRS;PUBLIC_LINK;PRIVATE_LINK" ${ARGN})
    set(target terrane_${arg_NAME})
    add_library(${target} ${arg_SOURCES})
    add_library(terrane::${arg_NAME} ALIAS ${target})
    target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS include FILES ${arg_HEADERS})
    target_include_directories(${target} PRIVATE ${arg_PRIVATE_DIRS})
    target_link_libraries(${target} PUBLIC ${arg_PUBLIC_LINK}
        PRIVATE $<BUILD_INTERFACE:terrane_options> ${arg_PRIVATE_LINK})
    target_compile_features(${target} PUBLIC cxx_std_20)
    set_target_properties(${target} PROPERTIES
        EXPORT_NAME ${arg_NAME}
        CXX_EXTENSIONS OFF
        POSITION_INDEPENDENT_CODE ON
        VERIFY_INTERFACE_HEADER_SETS ON)
    install(TARGETS ${target} EXPORT terrane_${arg_NAME}_targets FILE_SET HEADERS)
    install(EXPORT terrane_${arg_NAME}_targets NAMESPACE terrane::
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/terrane)
    set_property(GLOBAL APPEND PROPERTY TERRANE_COMPONENTS ${arg_NAME})
endfunction()
