// SPDX-License-Identifier: MIT
#include "record/ground_log.h"

#include <algorithm>

namespace terrane::tools {

void GroundLog::set(std::uint64_t step, std::span<const GroundEdit> edits) {
    std::size_t kept = 0;
    bool is_same = true;
    for (Entry& entry : entries_) {
        if (entry.end_step != kNever) continue;
        is_same = is_same && kept < edits.size() && entry.edit == edits[kept];
        if (is_same) {
            ++kept;
        } else {
            entry.end_step = step;
        }
    }
    // edits that were undone before a step
    std::erase_if(entries_, [](const Entry& entry) { return entry.first_step == entry.end_step; });
    for (const GroundEdit& edit : edits.subspan(kept)) entries_.push_back({edit, step});
}

void GroundLog::forget_after(std::uint64_t step) {
    std::erase_if(entries_, [step](const Entry& entry) { return entry.first_step > step; });
    for (Entry& entry : entries_) {
        if (entry.end_step > step) entry.end_step = kNever;
    }
}

std::vector<GroundEdit> GroundLog::at(std::uint64_t step) const {
    std::vector<GroundEdit> edits;
    for (const Entry& entry : entries_) {
        if (entry.first_step <= step && step < entry.end_step) edits.push_back(entry.edit);
    }
    return edits;
}

std::uint64_t GroundLog::next_change(std::uint64_t step) const {
    std::uint64_t next = kNever;
    for (const Entry& entry : entries_) {
        for (const std::uint64_t change : {entry.first_step, entry.end_step})
            if (change > step) next = std::min(next, change);
    }
    return next;
}

}  // namespace terrane::tools
