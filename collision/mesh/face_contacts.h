// SPDX-License-Identifier: MIT
#pragma once

#include "ground/contact/contact_patches.h"
#include "mesh/mesh_part.h"

namespace terrane::internal {

/// Contacts of one part with the faces of triangles. Of the points that lie on no corner and no end of the part only
/// the deepest are kept: on a floor of many triangles the others say the same.
class FaceContacts {
public:
    /// @param margin gaps of the whole up to this are contacts, metres
    FaceContacts(const MeshPart& part, double margin) : part_(part), margin_(margin) {}

    struct Found {
        double
            depth;  ///< largest of the whole, metres; minus infinity where they do not overlap in projection
        bool is_flat;  ///< a face of a box, or the side of a capsule, lies along the triangle
    };
    /// Adds the contacts of the part's support feature over a triangle, along its normal.
    Found add(const SurfaceTriangle& triangle);
    /// Moves the contacts to the patches.
    void finish(ContactPatches& patches) const {
        for (std::size_t i = 0; i < count_; ++i) patches.add(contacts_[i]);
        for (std::size_t i = 0; i < inner_count_; ++i) patches.add(inner_[i]);
    }

private:
    double add_segment(const SurfaceTriangle& triangle);
    double add_box_face(const SurfaceTriangle& triangle, std::size_t axis, double up);
    double add_support(const SurfaceTriangle& triangle);
    void add_outer(const Contact& contact);
    void add_inner(const Contact& contact);
    bool wants_inner(double depth) const {
        return inner_count_ < kMostInner || depth > inner_[shallowest_].depth;
    }

    static constexpr std::size_t kMostOuter = 64, kMostInner = 12;
    const MeshPart& part_;
    double margin_;
    // Not initialised beyond the counts.
    union {
        std::array<Contact, kMostOuter> contacts_;  // NOLINT(readability-identifier-naming)
    };
    union {
        std::array<Contact, kMostInner> inner_;  // NOLINT(readability-identifier-naming)
    };
    std::size_t count_ = 0, inner_count_ = 0;
    std::size_t shallowest_ = 0;  // of the inner ones, where there is no room for more
};

}  // namespace terrane::internal
