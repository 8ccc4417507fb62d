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

/// Extent of a comparison.
struct ComparisonSettings {
    bool is_quick = false;  ///< one round, cold
    bool is_alone = false;  ///< without the peers
    std::string_view only;  ///< queries whose name contains this
    bool wants(std::string_view question) const {
        return question.find(only) != std::string_view::npos;
    }
};

/// Median over up to nine rounds after a warm-up, nanoseconds a query of the calling thread's time. Rounds of seconds,
/// and quick runs, are timed in the first round. None where the round has no result.
std::optional<double> measure_ns(std::size_t queries, bool is_quick,
                                 const std::function<bool()>& round);

/// Runs queries about one map on all engines, and checks the results by an oracle. The map must outlive it.
class ContactComparison {
public:
    ContactComparison(const ContactMap& map, const ComparisonSettings& settings);

    /// Whether vertical rays hit the surface of every engine where the oracle has it; prints the errors.
    bool check_surfaces() const;

    /// Each runs a query on every engine and adds a row of scores. Skipped where the settings exclude it.
    void heights(Row row, const std::vector<Ray>& places);
    void rays(Row row, const std::vector<Ray>& rays);
    void contacts(Row row, const Shape& shape, const std::vector<Pose>& poses);
    /// Contacts of bodies that rest or land. Every engine has its poses on its own surface, at the same places with the
    /// same gaps. Missed: overlapping, or with a gap within the margin of an engine that has one, but no contact.
    void shallow_contacts(Row row, const Shape& shape, std::size_t count, std::uint64_t seed);
    /// Missed: in the ground at one of eight times of the sweep, but no hit.
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
