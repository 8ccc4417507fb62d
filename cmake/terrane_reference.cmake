# The target `reference`, if Doxygen is installed: HTML of all public headers in <build>/reference/html.
find_package(Doxygen 1.9 QUIET)
if(NOT DOXYGEN_FOUND OR NOT TERRANE_PYTHON)
    return()
endif()
set(headers)
get_property(components GLOBAL PROPERTY TERRANE_COMPONENTS)
foreach(component IN LISTS components)
    get_target_property(of_component terrane_${component} HEADER_SET)
    list(APPEND headers ${of_component})
endforeach()
set(reference_folder ${PROJECT_BINARY_DIR}/reference)
list(JOIN headers "\n" headers)
file(CONFIGURE OUTPUT ${reference_folder}/headers.txt CONTENT "${headers}\n")
configure_file(${PROJECT_SOURCE_DIR}/docs/reference/Doxyfile.in ${reference_folder}/Doxyfile @ONLY)
add_custom_target(reference
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${reference_folder}/headers ${reference_folder}/html
    COMMAND ${TERRANE_PYTHON} -B ${PROJECT_SOURCE_DIR}/docs/reference/filter.py ${reference_folder}/headers
        ${reference_folder}/headers.txt
    COMMAND Doxygen::doxygen ${reference_folder}/Doxyfile
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} VERBATIM
    COMMENT "Reference of all public headers: ${reference_folder}/html/index.html")
