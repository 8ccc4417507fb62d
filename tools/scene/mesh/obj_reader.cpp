// SPDX-License-Identifier: MIT
#include "scene/mesh/mesh_reader.h"
#include "scene/mesh/text_numbers.h"

#include <fmt/format.h>

namespace terrane::tools {
namespace {

tl::unexpected<Error> bad_line(std::size_t number, std::string_view what) {
    return fail(ErrorCode::bad_data, fmt::format("line {}: {}", number, what));
}

/// The point of "7", "7/1", "7//3" or "-1/..": counted from 0. Negative numbers count back from the last point.
std::optional<std::int64_t> corner_of(std::string_view word, std::size_t point_count) {
    const std::optional<std::int64_t> index = whole_number(word.substr(0, word.find('/')));
    if (!index || *index == 0) return std::nullopt;
    return *index > 0 ? *index - 1 : *index + static_cast<std::int64_t>(point_count);
}

/// The colour after a position, where there is one.
void add_colour(std::string_view line, TriangleMesh& mesh) {
    std::array<std::uint8_t, 4> colour{0, 0, 0, 255};
    for (std::size_t i = 0; i < 3; ++i) {
        const std::optional<double> value = real_number(take_word(line));
        if (!value || !(*value >= 0.0 && *value <= 1.0)) return;
        colour[i] = static_cast<std::uint8_t>(255.0 * *value + 0.5);
    }
    mesh.colours.push_back(colour);
}

}  // namespace

Result<TriangleMesh> parse_obj(std::string_view text) {
    TriangleMesh mesh;
    std::vector<std::int64_t> corners;
    for (std::size_t number = 1; !text.empty(); ++number) {
        std::string_view line = take_line(text);
        const std::string_view keyword = take_word(line);
        if (keyword == "v") {
            Eigen::Vector3d point;
            for (int axis = 0; axis < 3; ++axis) {
                const std::optional<double> value = real_number(take_word(line));
                if (!value) return bad_line(number, "a point needs 3 numbers");
                point[axis] = *value;
            }
            if (mesh.positions.size() == kMostMeshParts) {
                return bad_line(number, fmt::format("more than {} points", kMostMeshParts));
            }
            mesh.positions.push_back(point);
            add_colour(line, mesh);
        } else if (keyword == "f") {
            corners.clear();
            for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
                const auto corner = corner_of(word, mesh.positions.size());
                if (!corner) {
                    return bad_line(number, fmt::format("'{:.40}' is no corner of a face", word));
                }
                corners.push_back(*corner);
            }
            if (auto added = add_polygon(corners, mesh); !added) {
                return bad_line(number, added.error().message);
            }
        }
    }
    if (mesh.colours.size() != mesh.positions.size()) mesh.colours.clear();
    return mesh;
}

}  // namespace terrane::tools
