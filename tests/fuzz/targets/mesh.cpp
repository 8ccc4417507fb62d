// SPDX-License-Identifier: MIT
// Mesh files: the first byte chooses the format, the rest is the file.
#include "scene/mesh_files.h"
#include "support/input.h"

#include <algorithm>
#include <array>

using namespace terrane;

namespace {

void check_mesh(const Result<TriangleMesh>& mesh) {
    if (!fuzz::is_accepted(mesh)) return;
    const std::size_t count = mesh->positions.size();
    fuzz::require(!mesh->triangles.empty(), "a mesh has a triangle");
    for (const auto& triangle : mesh->triangles) {
        fuzz::require(std::ranges::all_of(triangle, [&](auto index) { return index < count; }),
                      "triangles name points of the mesh");
    }
    const auto is_for_all = [&](const auto& values) {
        return values.empty() || values.size() == count;
    };
    fuzz::require(is_for_all(mesh->colours) && is_for_all(mesh->normals) &&
                      is_for_all(mesh->texture_coordinates),
                  "attributes are of all points or of none");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const fuzz::ScratchFolder folder;
    constexpr std::array<const char*, 5> kNames{"mesh.ply", "mesh.obj", "mesh.stl", "mesh.glb",
                                                "mesh.gltf"};
    fuzz::Input input(data, size);
    const char* const name = input.one_of(kNames);
    const std::string path = folder.write(name, input.rest());
    check_mesh(tools::read_mesh(path));
    check_mesh(tools::read_mesh_with_attributes(path));
    return 0;
}
