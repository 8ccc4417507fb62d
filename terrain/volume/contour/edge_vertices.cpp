// SPDX-License-Identifier: MIT
#include "contour/edge_vertices.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrane::internal {
namespace {

constexpr double kLeastFraction = 0x1p-8;  // of the edge: least distance of a vertex from its ends
constexpr int kBisections = 12;            // of an interval of half a spacing

std::size_t hash_of(const LineNode& a, const LineNode& b) {
    const auto bits = [](std::int32_t value) {
        return std::uint64_t{static_cast<std::uint32_t>(value)};
    };
    std::uint64_t hash = (bits(a.line) << 16 ^ bits(b.line)) * 0x9e3779b97f4a7c15u;
    hash = (hash ^ (bits(a.k) << 32 | bits(b.k))) * 0xbf58476d1ce4e5b9u;
    return static_cast<std::size_t>(hash >> 24 ^ hash >> 48);
}

}  // namespace

TileFields::TileFields(const TileLevelSet& level_set, const TileLines& lines)
    : to_void(level_set.runs(Field::to_void, lines)),
      to_solid(level_set.runs(Field::to_solid, lines)) {
    for (int line = 0; line < kTileLines; ++line) {
        const LineNode sample{line, lines.surface[static_cast<std::size_t>(line)]};
        SampleState& state = states[static_cast<std::size_t>(line)];
        if (value(Field::to_void, sample) < 0.0) {
            state = SampleState::in_void;
        } else if (value(Field::to_solid, sample) < 0.0) {
            state = SampleState::in_solid;
        }
    }
}

double TileFields::value(Field field, const LineNode& node) const {
    const FieldRuns& runs = of(field);
    const std::span<const FieldRuns::Run> own = runs.of_line(node.line);
    if (own.empty()) return runs.far_value[static_cast<std::size_t>(node.line)];
    // The first run that does not end below the node; between runs, the end of the lower run gives the sign.
    const auto run = std::ranges::lower_bound(own, node.k, {}, &FieldRuns::Run::last);
    if (run != own.end() && run->first <= node.k) {
        return runs.values[run->begin + static_cast<std::uint32_t>(node.k - run->first)];
    }
    const bool below_all = run == own.begin();
    const FieldRuns::Run& near = below_all ? own.front() : *(run - 1);
    const std::uint32_t end =
        below_all ? near.begin : near.begin + static_cast<std::uint32_t>(near.last - near.first);
    return runs.values[end] < 0 ? -kBandSteps : kBandSteps;
}

void TileFields::copy_inside(Field field, int line, std::int32_t first, std::size_t count,
                             std::vector<std::uint8_t>& inside_out) const {
    const FieldRuns& runs = of(field);
    const bool negative_is_solid = field == Field::to_solid;
    const auto is_solid = [&](double value) {
        return std::uint8_t{(value < 0.0) == negative_is_solid};
    };
    const std::span<const FieldRuns::Run> own = runs.of_line(line);
    const std::int32_t end = first + static_cast<std::int32_t>(count);
    inside_out.resize(count);
    auto run = std::ranges::lower_bound(own, first, {}, &FieldRuns::Run::last);
    std::uint8_t sign = is_solid(value(field, {line, first}));
    std::int32_t k = first;
    for (; run != own.end() && run->first < end; ++run) {
        for (; k < run->first; ++k) inside_out[static_cast<std::size_t>(k - first)] = sign;
        for (; k <= std::min(run->last, end - 1); ++k) {
            sign = is_solid(runs.values[run->begin + static_cast<std::uint32_t>(k - run->first)]);
            inside_out[static_cast<std::size_t>(k - first)] = sign;
        }
    }
    for (; k < end; ++k) inside_out[static_cast<std::size_t>(k - first)] = sign;
}

EdgeVertices::EdgeVertices(const TileLines& lines, const TileFields& fields,
                           VolumeContour& contour_out)
    : lines_(lines), fields_(fields), contour_(contour_out), slots_(1024) {}

EdgeVertices::Slot& EdgeVertices::find_slot(const LineNode& first, const LineNode& second) {
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = hash_of(first, second) & mask;
    while (slots_[at].vertex != 0 && (slots_[at].first != first || slots_[at].second != second))
        at = (at + 1) & mask;
    return slots_[at];
}

void EdgeVertices::grow() {
    std::vector<Slot> old(2 * slots_.size());
    old.swap(slots_);
    for (const Slot& slot : old) {
        if (slot.vertex != 0) find_slot(slot.first, slot.second) = slot;
    }
}

std::uint32_t EdgeVertices::node(const LineNode& node) {
    Slot& slot = find_slot(node, node);
    if (slot.vertex != 0) return slot.vertex - 1;
    const VolumeNode name = lines_.node(node.line, node.k);
    contour_.keys.push_back({name, name});
    contour_.positions_world.push_back(lines_.position(node.line, node.k));
    slot = {node, node, static_cast<std::uint32_t>(contour_.keys.size())};
    if (2 * contour_.keys.size() > slots_.size()) grow();
    return static_cast<std::uint32_t>(contour_.keys.size()) - 1;
}

std::uint32_t EdgeVertices::crossing(const LineNode& a, const LineNode& b, Field field) {
    // Lines have the same order in all tiles, so that all compute the same bits.
    const auto [first, second] = std::minmax(a, b);
    Slot& slot = find_slot(first, second);
    if (slot.vertex != 0) return slot.vertex - 1;
    const double t = fraction(first, second, field);
    const WorldPos from = lines_.position(first.line, first.k),
                   to = lines_.position(second.line, second.k);
    const auto along = [t](double p, double q) { return p + t * (q - p); };
    const VolumeNode name_a = lines_.node(first.line, first.k),
                     name_b = lines_.node(second.line, second.k);
    contour_.keys.push_back({std::min(name_a, name_b), std::max(name_a, name_b)});
    contour_.positions_world.push_back(
        {along(from[0], to[0]), along(from[1], to[1]), along(from[2], to[2])});
    slot = {first, second, static_cast<std::uint32_t>(contour_.keys.size())};
    if (2 * contour_.keys.size() > slots_.size()) grow();
    return static_cast<std::uint32_t>(contour_.keys.size()) - 1;
}

double EdgeVertices::fraction(const LineNode& first, const LineNode& second, Field field) const {
    const auto a = static_cast<std::size_t>(first.line), b = static_cast<std::size_t>(second.line);
    if (first.line != second.line && first.k == lines_.surface[a] &&
        second.k == lines_.surface[b]) {
        const SampleState at_a = fields_.states[a], at_b = fields_.states[b];
        if (at_a != SampleState::natural && at_b != SampleState::natural) {
            return 0.5 * (fraction_of_zero(first, second, Field::to_void) +
                          fraction_of_zero(first, second, Field::to_solid));
        }
        const SampleState state = at_a != SampleState::natural ? at_a : at_b;
        field = state == SampleState::in_void ? Field::to_void : Field::to_solid;
    }
    return fraction_of_zero(first, second, field);
}

double EdgeVertices::fraction_of_zero(const LineNode& first, const LineNode& second,
                                      Field field) const {
    const double at_first = fields_.value(field, first), at_second = fields_.value(field, second);
    double from = 0.0, to = 1.0, below = at_first, above = at_second;
    if (std::abs(first.k - second.k) > 1) {
        // Long edges occur only beside steep parts of the heightfield. Finds the first change of sign in steps of half
        // a spacing.
        const double z0 = lines_.z(first.line, first.k), z1 = lines_.z(second.line, second.k);
        const auto along = [&](double t) {
            const double z = z0 + t * (z1 - z0);
            return (1.0 - t) * value_at(field, first.line, z) + t * value_at(field, second.line, z);
        };
        const bool starts_inside = at_first < 0.0;
        const int steps = 2 * std::abs(first.k - second.k);
        for (int i = 1; i <= steps; ++i) {
            to = static_cast<double>(i) / steps;
            above = i == steps ? at_second : along(to);
            if ((above < 0.0) != starts_inside) break;
            from = to;
            below = above;
        }
        for (int i = 0; i < kBisections; ++i) {
            const double middle = 0.5 * (from + to), value = along(middle);
            const bool changed = (value < 0.0) != starts_inside;
            (changed ? to : from) = middle;
            (changed ? above : below) = value;
        }
    }
    const double fall = below - above;
    const double t = from + (to - from) * (fall != 0.0 ? std::clamp(below / fall, 0.0, 1.0) : 0.5);
    return std::clamp(t, kLeastFraction, 1.0 - kLeastFraction);
}

double EdgeVertices::value_at(Field field, int line, double z) const {
    const auto l = static_cast<std::size_t>(line);
    const double node = (z - lines_.height[l]) / lines_.spacing, low = std::floor(node);
    const std::int32_t k = lines_.surface[l] + static_cast<std::int32_t>(low);
    const double at_low = fields_.value(field, {line, k}),
                 at_high = fields_.value(field, {line, k + 1});
    return at_low + (node - low) * (at_high - at_low);
}

}  // namespace terrane::internal
