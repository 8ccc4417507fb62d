// SPDX-License-Identifier: MIT
#include "comparison_meshes.h"

#include <terrane/terrain/fractal_heights.h>

#include <array>
#include <fstream>
#include <map>
#include <sstream>

namespace terrane::bench {

using test::ShapeMesh;

ShapeMesh make_fractal_mesh(int side) {
    constexpr double kCell = 4.0;
    const auto source = FractalHeights::create({.seed = 20}).value();
    return test::make_grid(side, side, [&](int column, int row) {
        const double x = kCell * column, y = kCell * row;
        return Eigen::Vector3d(x, y, source->height(x, y));
    });
}

std::optional<ShapeMesh> read_obj_mesh(const std::string& path) {
    std::ifstream file(path);
    if (!file) return std::nullopt;
    ShapeMesh mesh;
    std::vector<std::uint32_t> numbers;  // of the file's points
    std::map<std::array<double, 3>, std::uint32_t> places;
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        std::string kind;
        words >> kind;
        if (kind == "v") {
            std::array<double, 3> p{};
            words >> p[0] >> p[1] >> p[2];
            const auto [at, is_new] =
                places.try_emplace(p, static_cast<std::uint32_t>(mesh.vertices.size()));
            if (is_new) mesh.vertices.emplace_back(p[0], p[1], p[2]);
            numbers.push_back(at->second);
        } else if (kind == "f") {
            std::array<std::uint32_t, 3> t{};
            for (std::uint32_t& corner : t) {
                std::string word;
                words >> word;
                corner = numbers.at(std::stoul(word) - 1);
            }
            if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
        }
    }
    return mesh;
}

ShapeMesh compacted(const ShapeMesh& mesh) {
    constexpr std::uint32_t kUnused = ~std::uint32_t{0};
    ShapeMesh result;
    std::vector<std::uint32_t> numbers(mesh.vertices.size(), kUnused);
    for (auto t : mesh.triangles) {
        for (std::uint32_t& v : t) {
            if (numbers[v] == kUnused) {
                numbers[v] = static_cast<std::uint32_t>(result.vertices.size());
                result.vertices.push_back(mesh.vertices[v]);
            }
            v = numbers[v];
        }
        result.triangles.push_back(t);
    }
    return result;
}

}  // namespace terrane::bench
