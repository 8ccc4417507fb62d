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

/// The ids of bodies, and the slots that removed bodies have left. A free slot is used again before a new one is added,
/// in last-in, first-out order.
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
    /// @param id contains() it
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
    /// The id of a slot's body; none where it has none.
    BodyId id(std::size_t slot) const {
        if (slot >= generations_.size() || is_used_[slot] == 0) return {};
        return {static_cast<std::uint32_t>(slot), generations_[slot]};
    }
    /// Slots that ever had a body.
    std::size_t slot_count() const { return generations_.size(); }

    /// What a copy needs: see restore().
    const std::vector<std::uint32_t>& generations() const { return generations_; }
    const std::vector<std::uint32_t>& free_slots() const { return free_; }
    /// @param free slots without a body, each below the number of generations and only once
    void restore(std::vector<std::uint32_t> generations, std::vector<std::uint32_t> free) {
        generations_ = std::move(generations);
        free_ = std::move(free);
        is_used_.assign(generations_.size(), 1);
        for (const std::uint32_t slot : free_) is_used_[slot] = 0;
    }

private:
    std::vector<std::uint32_t> generations_;  // of the slot's body, or of its next one
    std::vector<std::uint8_t> is_used_;
    std::vector<std::uint32_t> free_;
};

// Checks of settings and states. All fail with invalid_argument, naming the field and its value.

/// A field and its range.
struct FieldRange {
    const char* name;
    double value, low, high;
    const char* unit = "";  ///< of all three: "m"
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
/// A body's settings, its state, and whether they go together.
Result<void> check_body(const BodySettings& settings, const BodyPlacement& placement);
Result<void> check_world(const WorldSettings& settings);

/// Largest component of a body's place, metres. A body that would move beyond it is parked.
inline constexpr double kMaxPlace = 2e9;
/// Largest component of a velocity, m/s.
inline constexpr double kMaxSpeed = 1e6;
/// Largest component of a spin, rad/s.
inline constexpr double kMaxSpin = 1e6;

}  // namespace terrane::internal
