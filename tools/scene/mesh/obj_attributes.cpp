// SPDX-License-Identifier: MIT
#include "scene/mesh/mesh_reader.h"
#include "scene/mesh/text_numbers.h"

#include <fmt/format.h>

#include <array>
#include <map>
#include <utility>

namespace terrane::tools {
namespace {

/// Counted from 0: point, texture coordinate, normal; -1 where a corner has none.
using ObjCorner = std::array<std::int64_t, 3>;

/// The corners of a line f. False where one names an attribute that the file does not have so far.
bool take_corners(std::string_view line, const std::array<std::size_t, 3>& counts,
                  std::vector<ObjCorner>& corners_out) {
    corners_out.clear();
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
        ObjCorner corner{-1, -1, -1};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t end = word.find('/');
            const std::string_view part = word.substr(0, end);
            if (!part.empty()) {
                const std::optional<std::int64_t> index = whole_number(part);
                if (!index || *index == 0) return false;
                const auto count = static_cast<std::int64_t>(counts[k]);
                corner[k] = *index > 0 ? *index - 1 : *index + count;
                if (corner[k] < 0 || corner[k] >= count) return false;
            }
            if (end == std::string_view::npos) break;
            word.remove_prefix(end + 1);
        }
        corners_out.push_back(corner);
    }
    return true;
}

/// The numbers of all lines with a keyword, `count` of each.
///
/// Fails: bad_data, naming the line, where one has fewer
Result<std::vector<std::array<float, 3>>> take_vectors(std::string_view text,
                                                       std::string_view wanted, std::size_t count) {
    std::vector<std::array<float, 3>> vectors;
    for (std::size_t number = 1; !text.empty(); ++number) {
        std::string_view line = take_line(text);
        if (take_word(line) != wanted) continue;
        std::array<float, 3> vector{};
        for (std::size_t k = 0; k < count; ++k) {
            const std::optional<double> value = real_number(take_word(line));
            if (!value) {
                return fail(ErrorCode::bad_data,
                            fmt::format("line {}: {} must have {} numbers", number, wanted, count));
            }
            vector[k] = static_cast<float>(*value);
        }
        vectors.push_back(vector);
    }
    return vectors;
}

}  // namespace

Result<TriangleMesh> parse_obj_with_attributes(std::string_view text) {
    // Checks everything but attributes; its polygons are the same fans.
    Result<TriangleMesh> plain = parse_obj(text);
    if (!plain) return plain;
    const auto texture = take_vectors(text, "vt", 2), normals = take_vectors(text, "vn", 3);
    if (!texture) return tl::unexpected<Error>(texture.error());
    if (!normals) return tl::unexpected<Error>(normals.error());
    TriangleMesh mesh;
    std::map<ObjCorner, std::uint32_t> numbers;
    std::vector<ObjCorner> used, corners;
    bool has_texture = true, has_normals = true;
    std::array<std::size_t, 3> so_far{};
    for (std::size_t number = 1; !text.empty(); ++number) {
        std::string_view line = take_line(text);
        const std::string_view keyword = take_word(line);
        so_far[0] += static_cast<std::size_t>(keyword == "v");
        so_far[1] += static_cast<std::size_t>(keyword == "vt");
        so_far[2] += static_cast<std::size_t>(keyword == "vn");
        if (keyword != "f") continue;
        if (!take_corners(line, so_far, corners)) {
            return fail(ErrorCode::bad_data,
                        fmt::format("line {}: '{:.40}' names a texture coordinate or normal that "
                                    "is not there",
                                    number, line));
        }
        std::vector<std::uint32_t> vertices;
        for (const ObjCorner& corner : corners) {
            has_texture = has_texture && corner[1] >= 0;
            has_normals = has_normals && corner[2] >= 0;
            const auto [at, is_new] =
                numbers.try_emplace(corner, static_cast<std::uint32_t>(used.size()));
            if (is_new) used.push_back(corner);
            vertices.push_back(at->second);
        }
        for (std::size_t i = 2; i < vertices.size(); ++i)
            mesh.triangles.push_back({vertices[0], vertices[i - 1], vertices[i]});
    }
    for (const ObjCorner& corner : used) {
        const auto point = static_cast<std::size_t>(corner[0]);
        mesh.positions.push_back(plain->positions[point]);
        if (!plain->colours.empty()) mesh.colours.push_back(plain->colours[point]);
        if (has_texture && !texture->empty()) {
            const auto& t = (*texture)[static_cast<std::size_t>(corner[1])];
            mesh.texture_coordinates.emplace_back(t[0], t[1]);
        }
        if (has_normals && !normals->empty()) {
            const auto& n = (*normals)[static_cast<std::size_t>(corner[2])];
            mesh.normals.emplace_back(n[0], n[1], n[2]);
        }
    }
    return mesh;
}

}  // namespace terrane::tools
