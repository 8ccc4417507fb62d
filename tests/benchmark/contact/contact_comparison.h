// SPDX-License-Identifier: MIT
#pragma once

#include "contact_table.h"
#include "contact_workload.h"

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::bench {

/// How thorough a comparison is.
struct ComparisonSettings {
    bool is_quick = false;  ///< one round, cold
    bool is_alone = false;  ///< without the peers
    std::string_view only;  ///< questions whose name has this in it
    bool wants(std::string_view question) const {
        return question.find(only) != std::string_view::npos;
    }
};

/// The median over up to nine rounds after one that warms up, nanoseconds a query of the calling
/// thread's time. What needs seconds for a round, or is to be quick, is timed in the first one. None
/// where the round says that there is no answer.
std::optional<double> measure_ns(std::size_t queries, bool is_quick,
                                 const std::function<bool()>& round);

/// Puts questions about one map to all engines, and judges the answers by an oracle. The map outlives
/// it.
class ContactComparison {
public:
    ContactComparison(const ContactMap& map, const ComparisonSettings& settings);

    /// Whether vertical rays find the surface of every engine where the oracle has it; prints how far
    /// they are from it.
    bool check_surfaces() const;

    /// Each asks every engine, and keeps a row with the scores. Not where the settings leave the
    /// question out.
    void heights(Row row, const std::vector<Ray>& places);
    void rays(Row row, const std::vector<Ray>& rays);
    void contacts(Row row, const Shape& shape, const std::vector<Pose>& poses);
    /// Missed is what is in the ground at one of eight places on its way, and was not hit.
    void casts(Row row, const Shape& shape, const std::vector<Sweep>& sweeps);

    const std::vector<Row>& rows() const { return rows_; }
    std::vector<std::string> names() const;

private:
    template <class Answer>
    void ask(Row& row, std::size_t queries,
             const std::function<bool(ContactEngine&, std::span<Answer>)>& answer,
             const std::function<bool(Answer)>& is_found,
             const std::function<bool(const ContactEngine&, std::size_t)>& is_there = {});

    const ContactMap& map_;
    ComparisonSettings settings_;
    std::vector<std::unique_ptr<ContactEngine>> engines_;  ///< Terrane's first
    std::vector<Row> rows_;
};

}  // namespace terrane::bench
