# Installs the CMake package: find_package(terrane COMPONENTS terrain dem volume collision playback render).
include(CMakePackageConfigHelpers)
configure_package_config_file(
    ${CMAKE_CURRENT_LIST_DIR}/terraneConfig.cmake.in
    ${CMAKE_CURRENT_BINARY_DIR}/terraneConfig.cmake
    INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/terrane)
write_basic_package_version_file(
    ${CMAKE_CURRENT_BINARY_DIR}/terraneConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES
    ${CMAKE_CURRENT_BINARY_DIR}/terraneConfig.cmake
    ${CMAKE_CURRENT_BINARY_DIR}/terraneConfigVersion.cmake
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/terrane)
# Pages keep their places relative to each other, so that their links work.
install(FILES LICENSE README.md CONVENTIONS.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/terrane)
install(DIRECTORY docs examples DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/terrane)

include(${CMAKE_CURRENT_LIST_DIR}/terrane_pkg_config.cmake)
if(PROJECT_IS_TOP_LEVEL)
    include(${CMAKE_CURRENT_LIST_DIR}/terrane_packages.cmake)
endif()
