// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/body.h>
#include <terrane/collision/world.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace terrane::internal {

/// Ids of bodies, and free slots of removed bodies. Free slots are reused in last-in, first-out order before new ones
/// are added.
class SlotIds {
public:
    BodyId acquire() {
        if (free_.empty()) {
            generations_.push_back(0);
            is_used_.push_back(1);
            return {static_cast<std::uint32_t>(generations_.size() - 1), 0};
        }
        const std::uint32_t slot = free_.back();
        free_.pop_back();
        is_used_[slot] = 1;
        return {slot, generations_[slot]};
    }
    /// @param id one for which contains() is true
    void release(BodyId id) {
        ++generations_[id.index];
        is_used_[id.index] = 0;
        free_.push_back(id.index);
    }

    bool contains(BodyId id) const {
        return id.index < generations_.size() && is_used_[id.index] != 0 &&
               generations_[id.index] == id.generation;
    }
    bool is_used(std::size_t slot) const { return is_used_[slot] != 0; }
    /// The id of a slot's body; none if the slot is free.
    BodyId id(std::size_t slot) const {
        if (slot >= generations_.size() || is_used_[slot] == 0) return {};
        return {static_cast<std::uint32_t>(slot), generations_[slot]};
    }
    /// Number of slots that ever had a body.
    std::size_t slot_count() const { return generations_.size(); }

    /// The state from which restore() makes a copy.
    const std::vector<std::uint32_t>& generations() const { return generations_; }
    const std::vector<std::uint32_t>& free_slots() const { return free_; }
    /// @param free slots without a body, unique and below the number of generations
    void restore(std::vector<std::uint32_t> generations, std::vector<std::uint32_t> free) {
        generations_ = std::move(generations);
        free_ = std::move(free);
        is_used_.assign(generations_.size(), 1);
        for (const std::uint32_t slot : free_) is_used_[slot] = 0;
    }

private:
    std::vector<std::uint32_t> generations_;  // of the slot's current or next body
    std::vector<std::uint8_t> is_used_;
    std::vector<std::uint32_t> free_;
};

// Checks of settings and states. All fail with invalid_argument, naming the field and its value.

/// A field and its range.
struct FieldRange {
    const char* name;
    double value, low, high;
    const char* unit = "";  ///< unit of all three, such as "m"
};
Result<void> check_fields(std::span<const FieldRange> fields);
Result<void> check_value(const char* name, double value, double low, double high,
                         const char* unit = "");
/// @param limit of the absolute value of each component
Result<void> check_vector(const char* name, const Eigen::Vector3d& value, double limit,
                          const char* unit = "");
Result<void> check_state(const BodyPlacement& placement);
/// "static", "kinematic" or "dynamic".
std::string to_string(BodyType type);
/// Checks a body's settings, its placement, and their consistency.
Result<void> check_body(const BodySettings& settings, const BodyPlacement& placement);
Result<void> check_world(const WorldSettings& settings);
/// Checks WorldSettings::max_substep.
Result<void> check_substep(double max_substep);

/// Largest component of a body's position, metres. A body that would move beyond it is parked.
inline constexpr double kMaxPlace = 2e9;
/// Largest component of a velocity, m/s.
inline constexpr double kMaxSpeed = 1e6;
/// Largest component of a spin, rad/s.
inline constexpr double kMaxSpin = 1e6;

}  // namespace terrane::internal
