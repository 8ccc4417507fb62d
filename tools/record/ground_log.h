// SPDX-License-Identifier: MIT
#pragma once

#include "scene/ground_editor.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace terrane::tools {

/// The digs and fills of a run, with the steps between which each of them is in force. A step is named by the number of
/// steps before it.
class GroundLog {
public:
    static constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();

    struct Entry {
        GroundEdit edit;
        std::uint64_t first_step = 0;     ///< in which it is in force
        std::uint64_t end_step = kNever;  ///< in which it has been undone
        friend bool operator==(const Entry&, const Entry&) = default;
    };

    GroundLog() = default;
    /// @param entries of another log
    explicit GroundLog(std::vector<Entry> entries) : entries_(std::move(entries)) {}

    /// The ground has these edits from a step on, which is no earlier than those of the calls before.
    void set(std::uint64_t step, std::span<const GroundEdit> edits);
    /// Forgets what happened after a step.
    void forget_after(std::uint64_t step);

    /// The edits in force in a step, in the order in which they apply.
    std::vector<GroundEdit> at(std::uint64_t step) const;
    /// The first step after this one that has other edits; kNever if none has.
    std::uint64_t next_change(std::uint64_t step) const;

    bool is_empty() const { return entries_.empty(); }
    std::span<const Entry> entries() const { return entries_; }

private:
    std::vector<Entry> entries_;  // in the order in which they apply
};

}  // namespace terrane::tools
