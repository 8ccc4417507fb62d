# A build folder that was configured before pybind11 was installed gets the Python module at the next configuration, and
# CTest says until then that the tests of the module are left out.
include(${CMAKE_CURRENT_LIST_DIR}/steps.cmake)

function(configure)
    run(${CMAKE_COMMAND} ${ARGN} -S ${SOURCE_DIR} -B ${WORK_DIR} -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${COMPILER}
        -DTERRANE_REMOTE=OFF -DTERRANE_DEM=OFF -DTERRANE_VOLUME=OFF -DTERRANE_PLAYBACK=OFF -DTERRANE_RENDER=OFF -DTERRANE_TOOLS=OFF)
    set(status "${output}")
    run(${CMAKE_CTEST_COMMAND} --test-dir ${WORK_DIR} -N -R "^python")
    set(output "${status}${output}" PARENT_SCOPE)
endfunction()

configure(--fresh -DCMAKE_DISABLE_FIND_PACKAGE_pybind11=ON)
foreach(said IN ITEMS "Python module is left out: pybind11 2.10" "python \\(left out: pybind11 2.10.*\\(Disabled\\)")
    if(NOT output MATCHES "${said}")
        message(FATAL_ERROR "without pybind11 nothing says '${said}':\n${output}")
    endif()
endforeach()

configure(-DCMAKE_DISABLE_FIND_PACKAGE_pybind11=OFF)
if(NOT output MATCHES "Python module is built" OR NOT output MATCHES "python(.installed| .left out: numpy)")
    message(FATAL_ERROR "pybind11 came later, and the Python module did not:\n${output}")
endif()

configure(-DTERRANE_PYTHON_MODULE=OFF)
if(NOT output MATCHES "python \\(left out: TERRANE_PYTHON_MODULE is OFF\\)")
    message(FATAL_ERROR "nothing says that the Python module is switched off:\n${output}")
endif()
