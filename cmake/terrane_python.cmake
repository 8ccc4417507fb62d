# The interpreter of scripts, whether the Python module is built, and where it is installed.
#
# TERRANE_PYTHON_MODULE is ON, OFF or AUTO: built if this is the top project and all that it needs is found. What was
# found is not kept in the cache, so that a build folder made before pybind11 was installed gets the module later.
# TERRANE_WITHOUT_PYTHON is the reason for which the module is left out; empty if it is built. A build with sanitizers
# has no module, because the interpreter itself would have to be built with them.
set(TERRANE_PYTHON_MODULE AUTO CACHE STRING "The Python module terrane, by pybind11: ON, OFF or AUTO, where it can be built")
set_property(CACHE TERRANE_PYTHON_MODULE PROPERTY STRINGS AUTO ON OFF)
# Debian's interpreter is used if there is one, because numpy is packaged for it.
find_program(TERRANE_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH NO_CACHE)
find_program(TERRANE_PYTHON NAMES python3 NO_CACHE)
set(PYBIND11_FINDPYTHON ON)
if(NOT DEFINED Python_EXECUTABLE AND NOT DEFINED Python_ROOT_DIR AND EXISTS /usr/bin/python3)
    set(Python_EXECUTABLE /usr/bin/python3)
endif()
set(TERRANE_WITHOUT_PYTHON)
if(NOT TERRANE_PYTHON_MODULE OR (TERRANE_PYTHON_MODULE STREQUAL "AUTO" AND NOT PROJECT_IS_TOP_LEVEL))
    set(TERRANE_WITHOUT_PYTHON "TERRANE_PYTHON_MODULE is ${TERRANE_PYTHON_MODULE}")
elseif(NOT TERRANE_COLLISION)
    set(TERRANE_WITHOUT_PYTHON "TERRANE_COLLISION is OFF")
elseif(TERRANE_SANITIZE)
    set(TERRANE_WITHOUT_PYTHON "TERRANE_SANITIZE is ${TERRANE_SANITIZE}")
else()
    find_package(Python 3.9 QUIET COMPONENTS Interpreter Development.Module)
    if(NOT Python_Development.Module_FOUND)
        set(TERRANE_WITHOUT_PYTHON "Python 3.9 with its development files, Debian's python3-dev, was not found")
    else()
        find_package(pybind11 2.10 QUIET)
        if(NOT pybind11_FOUND)
            set(TERRANE_WITHOUT_PYTHON "pybind11 2.10, Debian's pybind11-dev, was not found")
        endif()
    endif()
endif()
if(NOT TERRANE_WITHOUT_PYTHON)
    message(STATUS "The Python module is built for ${Python_EXECUTABLE}, version ${Python_VERSION}")
elseif(TERRANE_PYTHON_MODULE AND NOT TERRANE_PYTHON_MODULE STREQUAL "AUTO")
    message(FATAL_ERROR "TERRANE_PYTHON_MODULE is ${TERRANE_PYTHON_MODULE}, but ${TERRANE_WITHOUT_PYTHON}")
elseif(PROJECT_IS_TOP_LEVEL)
    message(STATUS "The Python module is left out: ${TERRANE_WITHOUT_PYTHON}")
endif()
# By default the folder that the interpreter searches under the prefix /usr/local: dist-packages on Debian, else
# site-packages.
set(TERRANE_PYTHON_DIR "" CACHE STRING "Where the Python package is installed, under the prefix; empty: the interpreter's folder")
if(NOT TERRANE_PYTHON_DIR)
    get_filename_component(packages "${Python_SITEARCH}" NAME)
    set(TERRANE_PYTHON_DIR "lib/python${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}/${packages}")
endif()
