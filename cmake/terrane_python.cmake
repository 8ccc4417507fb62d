# Whether the Python module can be built, and where it is installed.
#
# TERRANE_PYTHON_MODULE is on by default if this is the top project, collision is built, and pybind11 and Python's
# development files are found. It is an error to switch it on without collision or these files. A build with sanitizers
# has no module, because the interpreter itself would have to be built with them.
set(PYBIND11_FINDPYTHON ON)
# Debian's interpreter is used if there is one, because numpy is packaged for it.
if(NOT DEFINED Python_EXECUTABLE AND NOT DEFINED Python_ROOT_DIR AND EXISTS /usr/bin/python3)
    set(Python_EXECUTABLE /usr/bin/python3)
endif()
set(can_build FALSE)
if((PROJECT_IS_TOP_LEVEL OR TERRANE_PYTHON_MODULE) AND TERRANE_COLLISION AND NOT TERRANE_SANITIZE)
    find_package(Python 3.9 QUIET COMPONENTS Interpreter Development.Module)
    if(Python_Development.Module_FOUND)
        find_package(pybind11 2.10 QUIET)
    endif()
    if(pybind11_FOUND AND Python_Development.Module_FOUND)
        set(can_build TRUE)
    elseif(NOT DEFINED TERRANE_PYTHON_MODULE)
        message(STATUS "pybind11 or Python's development files were not found: the Python module is left out")
    endif()
endif()
option(TERRANE_PYTHON_MODULE "The Python module terrane, by pybind11; needs contact" ${can_build})
if(TERRANE_PYTHON_MODULE AND NOT can_build)
    message(FATAL_ERROR "TERRANE_PYTHON_MODULE needs TERRANE_COLLISION, no TERRANE_SANITIZE, pybind11 2.10 and the "
        "development files of Python 3.9: install pybind11-dev and python3-dev, or switch it off")
endif()
# The folder that the interpreter searches under the prefix /usr/local: dist-packages on Debian, else site-packages.
get_filename_component(packages "${Python_SITEARCH}" NAME)
set(TERRANE_PYTHON_DIR "lib/python${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}/${packages}" CACHE STRING
    "Where the Python package is installed, under the prefix")
