# README shows the program and project of readme_example word for word, docs/ those of examples/; links resolve.
include(${CMAKE_CURRENT_LIST_DIR}/steps.cmake)

expect_shown(README.md 1 tests/install/readme_example/main.cpp)
file(READ ${CMAKE_CURRENT_LIST_DIR}/readme_example/CMakeLists.txt project)
read_block(README.md cmake 1 shown)
expect_same("README's project" "${shown}" "${project}")
expect_links(README.md)

file(GLOB pages RELATIVE ${SOURCE_DIR} ${SOURCE_DIR}/docs/*.md)
foreach(page IN LISTS pages)
    expect_links(${page})
endforeach()
expect_shown(docs/integration.md 1 examples/minimal_integration.cpp)
expect_excerpts(docs/integration.md)
expect_at_most_lines(examples/minimal_integration.cpp 25)
expect_shown(docs/integration.md 6 examples/simulator_loop.cpp)
expect_shown(docs/mesh_layout.md 1 examples/mesh_uploader.cpp)
expect_shown(docs/height_source.md 2 examples/own_source.cpp)
expect_shown(docs/mesh_layout.md 2 examples/gl_uploader.h)

# Public headers include Eigen only through math.h, which provides cross products, quaternions and transforms.
file(GLOB_RECURSE headers ${SOURCE_DIR}/*/include/terrane/*.h)
foreach(header IN LISTS headers)
    file(STRINGS ${header} includes REGEX "#include <Eigen/")
    if(includes AND NOT header MATCHES "terrane/base/math.h$")
        message(FATAL_ERROR "${header} includes Eigen itself, not through <terrane/base/math.h>: ${includes}")
    endif()
endforeach()
