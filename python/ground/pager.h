// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/pager.h>

#include <pybind11/pybind11.h>

#include <memory>
#include <vector>

namespace terrane::python {

namespace py = pybind11;

/// Bodies that need ground, as Python passes them to a pager. Their trajectories are not kept.
struct BodyNeeds {
    std::vector<BodyNeed> needs;
};

/// Resident chunks, as Python holds them. Immutable.
struct Resident {
    std::shared_ptr<const ResidentSet> set;
};

/// Adds View and look_at().
void bind_views(py::module_& module);
/// Adds ResidentSet and Chunk.
void bind_resident(py::module_& module);
/// Adds Ground and its batches of heights and rays.
void bind_ground(py::module_& module);
/// Adds GroundBatch.
void bind_batches(py::module_& module);
/// Adds Camera, BodyNeeds and Pager.
void bind_pager(py::module_& module);

}  // namespace terrane::python
