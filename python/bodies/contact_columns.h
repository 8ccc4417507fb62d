// SPDX-License-Identifier: MIT
#pragma once

#include "values/arrays.h"

#include <terrane/collision/motion.h>
#include <terrane/collision/query_status.h>

#include <cstdint>
#include <vector>

namespace terrane::python {

/// Fails: ValueError for a margin that is negative or not finite, or no or more than 2^20 contacts
void check_margin(double margin, std::size_t max_contacts);

/// The arrays of terrane.Contacts while they grow. Threads: without the interpreter lock, but for answer().
class ContactColumns {
public:
    explicit ContactColumns(std::size_t pose_count);

    void add(const WorldPos& point_world, const Eigen::Vector3d& normal, double depth,
             std::uint32_t part, std::uint32_t part_b);
    /// Ends the contacts of a pose; poses in ascending order.
    void finish(std::size_t pose, double lift, double error_m, QueryStatus status);

    py::object answer() const;

private:
    std::vector<std::int64_t> first_;
    std::vector<double> points_, normals_, depths_, lifts_, errors_;
    std::vector<std::uint32_t> parts_, parts_b_;
    std::vector<std::int8_t> statuses_;
};

/// Motions of a shape: arguments of casts.
class Motions {
public:
    Motions(py::handle position, py::handle rotation, py::handle translation,
            py::handle rotation_vector);

    Motion operator[](std::size_t index) const;
    Batch batch() const {
        return Batch({&start_.positions(), &start_.rotations(), &translations_, &turns_});
    }

private:
    Poses start_;
    Rows translations_;
    Rows turns_;
};

/// The answer of one cast.
struct CastRow {
    QueryStatus status;
    bool hit;
    double fraction;
    bool started_in_contact;
    WorldPos point_world;
    Eigen::Vector3d normal;
    double depth;
    double error_m;
};

/// The arrays of terrane.Casts. Threads: as of ContactColumns.
class CastColumns {
public:
    explicit CastColumns(const Batch& batch);
    void write(std::size_t index, const CastRow& row);
    py::object answer() const;

private:
    py::array_t<bool> hit_, started_;
    py::array_t<double> fraction_, point_, normal_, depth_, error_;
    py::array_t<std::int8_t> status_;
    bool* hit_out_;
    bool* started_out_;
    double* fraction_out_;
    double* point_out_;
    double* normal_out_;
    double* depth_out_;
    double* error_out_;
    std::int8_t* status_out_;
};

}  // namespace terrane::python
