// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/column.h"
#include "ground/column/ground_lift.h"

#include <terrane/collision/ground_queries.h>

#include <array>
#include <span>

namespace terrane::internal {

/// A contact in a local frame.
inline Contact make_contact(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                            double depth, const ShapeFeature& feature, std::uint32_t part) {
    Contact contact;
    contact.point_world = point;
    contact.normal = normal;
    contact.depth = depth;
    contact.feature = feature;
    contact.part = part;
    return contact;
}

/// Contacts in a local frame, merged as they are added: contacts with nearly equal normals form a patch, which keeps
/// its deepest point and up to three more that span the largest area.
class ContactPatches {
public:
    ContactPatches() {}
    ContactPatches(const ContactPatches&) = delete;
    ContactPatches& operator=(const ContactPatches&) = delete;

    void clear() { count_ = 0; }
    void add(const Contact& contact);
    /// Merges the contacts and returns them, deepest first, ties ordered by position. Valid until the next call.
    std::span<const Contact> finish();

private:
    void merge();

    static constexpr std::size_t kMost = 192;
    // Not initialised: only the first count_ are constructed.
    union {
        std::array<Contact, kMost> contacts_;  // NOLINT(readability-identifier-naming): private
    };
    std::size_t count_ = 0;
};

/// find_contacts() for a shape that is known not to penetrate the ground. Cheaper, because the lift is not computed:
/// the answer contains 0 as an upper bound of the lift.
ContactAnswer find_separated_contacts(const Shape& shape, const Pose& world_from_shape,
                                      const Ground& ground, double margin,
                                      std::span<Contact> contacts_out);

/// Finds all contacts of a body. Features are paired at the pose after a separating translation; the depths are then
/// converted to those at the untranslated pose.
///
/// @param translation separates the body. May be zero for an overlapping round shape whose core is clear of the ground:
///                    features are then paired by the distance from the ground to the core
/// @param margin      gaps up to this are contacts too, metres
/// @param patches     receives the contacts at the untranslated pose, in the local frame
/// @param error_out   raised to the largest error_m of the cells tested
///
/// Returns false if a cell in reach is not resident.
bool find_patches(const LocalGround& local, const LocalBody& body,
                  const Eigen::Vector3d& translation, double margin, ContactPatches& patches,
                  double& error_out);

/// The point of a separated shape that is closest to the ground.
struct Nearest {
    bool is_found = false;  ///< ground is within the largest distance
    double distance = 0.0;  ///< metres
    Eigen::Vector3d on_shape = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, from the ground to the shape
    bool is_missing = false;                            ///< a possibly nearer cell is not resident
    double error_m = 0.0;
    std::uint32_t part = 0;  ///< of a compound; else 0
    Triangle triangle;       ///< the closest triangle
};

/// The nearest point over all parts of a body, which must be separated.
Nearest find_nearest(const LocalGround& local, const LocalBody& body, double max_distance);

/// Adds the nearest points of a separated body as a contact if they are within the margin and not at the border of the
/// ground. False if a cell in reach is not resident.
///
/// Feature pairing omits edges of the shape paired with vertices of the ground, and vertices of the shape paired with
/// edges or vertices of the ground. If shape and ground nearly touch, adjacent features give the same contacts, but
/// across a gap only an omitted pair may be within the margin. For round shapes the pairing is complete.
bool add_nearest(const LocalGround& local, const LocalBody& body, double margin,
                 ContactPatches& patches);

/// Closest points of a shape and a triangle that do not intersect.
ClosestPair find_closest(const LocalShape& shape, const Triangle& triangle);

}  // namespace terrane::internal
