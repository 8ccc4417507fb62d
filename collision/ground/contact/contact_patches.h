// SPDX-License-Identifier: MIT
#pragma once

#include "ground/lift/ground_lift.h"

#include <terrane/collision/ground_contact.h>

#include <array>
#include <span>

namespace terrane::internal {

/// Contacts in a local frame, merged as they come: contacts with nearly the same normal are a patch,
/// and a patch keeps its deepest point and up to three more that span the most.
class ContactPatches {
public:
    ContactPatches() {}
    ContactPatches(const ContactPatches&) = delete;
    ContactPatches& operator=(const ContactPatches&) = delete;

    void clear() { count_ = 0; }
    void add(const Contact& contact);
    /// Merges, then sorts: deepest first, ties by place.
    std::span<const Contact> finish();

private:
    void merge();

    static constexpr std::size_t kMost = 192;
    // Made as they are added: the others cost nothing.
    union {
        std::array<Contact, kMost> contacts_;
    };
    std::size_t count_ = 0;
};

/// Finds all contacts of a body that is free after moving by `translation`.
///
/// @param margin  gaps up to this are contacts too, metres
/// @param patches gets contacts of the body where it is, in the local frame
///
/// Of a round shape whose core is clear of the ground, `translation` may be zero although it overlaps: then
/// features are paired where it is, by the shortest ways from the ground to the core.
///
/// Returns false where a cell in reach is not resident.
bool find_patches(const LocalGround& local, const LocalBody& body, const Eigen::Vector3d& translation,
                  double margin, ContactPatches& patches, double& error_out);

}  // namespace terrane::internal
