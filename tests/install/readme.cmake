# README shows the program and the project that tests/install builds, word for word.
include(${CMAKE_CURRENT_LIST_DIR}/steps.cmake)

file(READ ${CMAKE_CURRENT_LIST_DIR}/readme_example/main.cpp program)
string(REGEX REPLACE "^// SPDX[^\n]*\n" "" program "${program}")
read_readme_block(cpp 1 shown)
expect_same("README's program" "${shown}" "${program}")

file(READ ${CMAKE_CURRENT_LIST_DIR}/readme_example/CMakeLists.txt project)
read_readme_block(cmake 1 shown)
expect_same("README's project" "${shown}" "${project}")

# Every file and folder that README links to exists.
file(READ ${SOURCE_DIR}/README.md text)
# brackets join what stands between them in a list
string(REPLACE "[" "<" text "${text}")
string(REPLACE "]" ">" text "${text}")
string(REGEX MATCHALL ">\\([^):]+\\)" links "${text}")
foreach(link IN LISTS links)
    string(REGEX REPLACE "^>\\((.*)\\)$" "\\1" path "${link}")
    if(NOT EXISTS ${SOURCE_DIR}/${path})
        message(FATAL_ERROR "README links to ${path}, which does not exist")
    endif()
endforeach()
