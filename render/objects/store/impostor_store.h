// SPDX-License-Identifier: MIT
#pragma once

#include "objects/store/mesh_store.h"

#include <terrane/render/object_settings.h>

#include <map>

namespace terrane::internal {

/// Views of a mesh on the device.
struct StoredImpostor {
    ImpostorSettings settings;
    Eigen::Vector3f centre =
        Eigen::Vector3f::Zero();  ///< of the bounds, the object's frame, metres
    float half_width = 0.0f;  ///< largest distance of the bounds from the z axis through the centre
    float half_height = 0.0f;  ///< metres
    float radius = 0.0f;       ///< of the bounding sphere: range of depths
    /// [views] layers: views around the axis, then those above. Roots of the linear colour times opacity, opacity.
    GlTexture colours;
    GlTexture
        shapes;  ///< normal (0.5 + 0.5 n) and depth (0.5 + 0.5 towards the viewer / radius), times opacity
    std::size_t bytes = 0;
};

/// Makes impostors: a mesh is drawn from each direction without perspective and without light, four times as large as
/// its view, and averaged.
///
/// Source: P. Maciel, P. Shirley. Visual Navigation of Large Environments Using Textured Clusters. I3D 1995
///         (impostors).
class ImpostorStore {
public:
    /// Fails: invalid_argument for settings out of range or a mesh without triangles; device_unavailable where OpenGL
    ///        reports an error
    Result<ImpostorId> add(const StoredMesh& mesh, const ImpostorSettings& settings);
    void remove(ImpostorId impostor) { impostors_.erase(impostor); }
    const StoredImpostor* find(ImpostorId impostor) const;
    /// On the device.
    std::size_t bytes() const;

private:
    Result<void> make_program();

    GlProgram program_;
    GLint centre_ = -1, axes_ = -1;
    GlVertexArray layout_;
    std::uint32_t next_ = 0;
    std::map<ImpostorId, StoredImpostor> impostors_;
};

}  // namespace terrane::internal
