// SPDX-License-Identifier: MIT
#include "objects/mesh_store.h"

#include "base/settings_check.h"
#include "gl/gl_object.h"
#include "gl/shader.h"

#include <terrane/base/text.h>
#include <terrane/scene/culling.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

namespace terrane::internal {
namespace {

using Triangle = TriangleMesh::Triangle;

// Levels with fewer triangles have no clusters: few clusters with wide cones are rarely culled.
constexpr std::size_t kLeastClustered = 256;

Result<void> check_levels(const TriangleMesh& mesh, std::span<const MeshLevel> levels) {
    std::size_t indices = 0;
    for (std::size_t level = 0; level < levels.size(); ++level) {
        const auto& [triangles, targets] = levels[level];
        indices += 3 * triangles.size();
        const auto refuse = [&](const char* what, std::uint32_t vertex, std::size_t count) {
            return fail(ErrorCode::invalid_argument, "level " + number_text(level) + what +
                                                         number_text(vertex) + " of " +
                                                         number_text(count));
        };
        for (const Triangle& t : triangles) {
            const std::uint32_t most = std::max({t[0], t[1], t[2]});
            if (most >= mesh.positions.size())
                return refuse(" names vertex ", most, mesh.positions.size());
            if (!targets.empty() && most >= targets.size())
                return refuse(" has no morph target for vertex ", most, targets.size());
        }
        for (const std::uint32_t target : targets) {
            if (target >= mesh.positions.size())
                return refuse(" morphs to vertex ", target, mesh.positions.size());
        }
    }
    if (indices > std::numeric_limits<std::int32_t>::max()) {
        return fail(ErrorCode::invalid_argument,
                    "a mesh must have fewer than 2^31 indices, got " + number_text(indices));
    }
    return {};
}

Result<void> check_materials(const TriangleMesh& mesh, std::size_t count) {
    if (count == 0 || count > std::size_t{std::numeric_limits<std::uint16_t>::max()} + 1)
        return fail(ErrorCode::invalid_argument,
                    "a mesh must have 1 to 65536 materials, got " + number_text(count));
    for (std::size_t i = 0; i < mesh.materials.size(); ++i) {
        if (mesh.materials[i] < count) continue;
        return fail(ErrorCode::invalid_argument, "vertex " + number_text(i) + " names material " +
                                                     number_text(mesh.materials[i]) + " of " +
                                                     number_text(count));
    }
    return {};
}

std::vector<ObjectVertex> make_vertices(const TriangleMesh& mesh,
                                        std::span<const MeshMaterial> materials) {
    const std::vector<Eigen::Vector3f> normals =
        mesh.normals.empty() ? vertex_normals(mesh) : mesh.normals;
    std::vector<ObjectVertex> vertices(mesh.positions.size());
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        ObjectVertex& vertex = vertices[i];
        for (int axis = 0; axis < 3; ++axis) {
            vertex.position[axis] = static_cast<float>(mesh.positions[i][axis]);
            vertex.normal[axis] = normals[i][axis];
        }
        if (mesh.colours.empty()) {
            const MeshMaterial& material =
                materials[mesh.materials.empty() ? 0 : mesh.materials[i]];
            std::copy(material.colour.begin(), material.colour.end(), vertex.colour);
            vertex.colour[3] = 255;
        } else {
            std::copy(mesh.colours[i].begin(), mesh.colours[i].end(), vertex.colour);
        }
    }
    return vertices;
}

}  // namespace

std::vector<Eigen::Vector3f> vertex_normals(const TriangleMesh& mesh) {
    std::vector<Eigen::Vector3d> sums(mesh.positions.size(), Eigen::Vector3d::Zero());
    for (const Triangle& t : mesh.triangles) {
        const Eigen::Vector3d& a = mesh.positions[t[0]];
        const Eigen::Vector3d normal = (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a);
        for (const std::uint32_t vertex : t) sums[vertex] += normal;
    }
    std::vector<Eigen::Vector3f> normals;
    for (const Eigen::Vector3d& sum : sums) {
        const double length = sum.norm();
        normals.push_back(length > 0.0 ? Eigen::Vector3f((sum / length).cast<float>())
                                       : Eigen::Vector3f(Eigen::Vector3f::UnitZ()));
    }
    return normals;
}

Result<MeshId> MeshStore::add(const TriangleMesh& mesh, std::span<const MeshLevel> levels,
                              std::span<const MeshMaterial> materials, TextureStore& textures) {
    TERRANE_TRY(mesh.validate());
    const MeshLevel whole = {.triangles = mesh.triangles};
    if (levels.empty()) levels = {&whole, 1};
    TERRANE_TRY(check_levels(mesh, levels));
    TERRANE_TRY(check_materials(mesh, materials.size()));
    StoredMesh stored;
    stored.vertices = make_vertices(mesh, materials);
    stored.bounds = bounding_box(mesh.positions);
    bool is_plain = true;
    for (const MeshMaterial& material : materials) {
        TERRANE_TRY(StoredMaterial made, textures.add(material));
        is_plain = is_plain && made.features == 0;
        stored.materials.push_back(std::move(made));
    }
    if (materials.size() > 1) {
        stored.materials_of_vertices = mesh.materials;
        stored.materials_of_vertices.resize(mesh.positions.size());
    }
    std::vector<Eigen::Vector2f> coordinates;
    if (!is_plain) {
        coordinates = mesh.texture_coordinates;
        coordinates.resize(mesh.positions.size(), Eigen::Vector2f::Zero());
    }
    const auto upload = [&](const void* data, std::size_t bytes) {
        GlBuffer buffer = make_buffer();
        // OpenGL allows no empty buffer
        glNamedBufferStorage(buffer.name(),
                             static_cast<GLsizeiptr>(std::max<std::size_t>(bytes, 4)),
                             bytes > 0 ? data : nullptr, 0);
        stored.bytes += bytes;
        return buffer;
    };
    std::vector<Triangle> indices;
    for (const MeshLevel& level : levels) {
        StoredMesh::Level& made = stored.levels.emplace_back();
        made.index_count = static_cast<std::uint32_t>(3 * level.triangles.size());
        std::vector<Triangle> of_material;
        for (std::uint32_t material = 0; material < materials.size(); ++material) {
            std::span<const Triangle> triangles = level.triangles;
            if (materials.size() > 1) {
                of_material.clear();
                for (const Triangle& t : level.triangles) {
                    if (stored.materials_of_vertices[t[0]] == material) of_material.push_back(t);
                }
                if (of_material.empty()) continue;
                triangles = of_material;
            }
            StoredMesh::Group& group = made.groups.emplace_back();
            group.material = material;
            group.first_index = static_cast<std::uint32_t>(3 * indices.size());
            group.index_count = static_cast<std::uint32_t>(3 * triangles.size());
            if (!materials[material].is_two_sided && triangles.size() >= kLeastClustered) {
                TERRANE_TRY(MeshClusters clusters, MeshClusters::create(mesh.positions, triangles));
                for (const std::uint32_t i : clusters.order()) indices.push_back(triangles[i]);
                group.clusters = std::move(clusters);
            } else {
                indices.insert(indices.end(), triangles.begin(), triangles.end());
            }
        }
        if (level.morph_targets.empty()) continue;
        std::vector<ObjectVertex> moved;
        for (const std::uint32_t target : level.morph_targets)
            moved.push_back(stored.vertices[target]);
        made.targets = upload(moved.data(), moved.size() * sizeof(ObjectVertex));
        if (is_plain) continue;
        std::vector<Eigen::Vector2f> moved_coordinates;
        for (const std::uint32_t target : level.morph_targets)
            moved_coordinates.push_back(coordinates[target]);
        made.texture_targets =
            upload(moved_coordinates.data(), moved_coordinates.size() * sizeof(Eigen::Vector2f));
    }
    if (!is_plain) {
        stored.texture_buffer =
            upload(coordinates.data(), coordinates.size() * sizeof(Eigen::Vector2f));
    }
    stored.vertex_buffer =
        upload(stored.vertices.data(), stored.vertices.size() * sizeof(ObjectVertex));
    stored.index_buffer = upload(indices.data(), indices.size() * sizeof(Triangle));
    TERRANE_TRY(check_gl("keep a mesh of " + number_text(indices.size()) + " triangles"));
    const MeshId id{next_++};
    meshes_.emplace(id, std::move(stored));
    return id;
}

const StoredMesh* MeshStore::find(MeshId mesh) const {
    const auto found = meshes_.find(mesh);
    return found == meshes_.end() ? nullptr : &found->second;
}

std::set<unsigned> MeshStore::features() const {
    std::set<unsigned> found;
    for (const auto& [id, mesh] : meshes_) {
        for (const StoredMaterial& material : mesh.materials)
            if (material.features != 0) found.insert(material.features);
    }
    return found;
}

std::size_t MeshStore::bytes() const {
    std::size_t bytes = 0;
    for (const auto& [id, mesh] : meshes_) bytes += mesh.bytes;
    return bytes;
}

namespace {

void add_floats(GLuint layout, GLuint attribute, GLint count, std::size_t byte, GLuint binding) {
    glEnableVertexArrayAttrib(layout, attribute);
    glVertexArrayAttribFormat(layout, attribute, count, GL_FLOAT, GL_FALSE,
                              static_cast<GLuint>(byte));
    glVertexArrayAttribBinding(layout, attribute, binding);
}

void add_vertex(GLuint layout, GLuint first_attribute, GLuint binding) {
    add_floats(layout, first_attribute, 3, offsetof(ObjectVertex, position), binding);
    add_floats(layout, first_attribute + 1, 3, offsetof(ObjectVertex, normal), binding);
    const GLuint colour = first_attribute + 2;
    glEnableVertexArrayAttrib(layout, colour);
    glVertexArrayAttribFormat(layout, colour, 4, GL_UNSIGNED_BYTE, GL_TRUE,
                              offsetof(ObjectVertex, colour));
    glVertexArrayAttribBinding(layout, colour, binding);
}

}  // namespace

GlVertexArray make_object_layout() {
    GlVertexArray layout = make_vertex_array();
    const GLuint name = layout.name();
    add_vertex(name, 0, 0);
    add_floats(name, 3, 4, offsetof(ObjectInstance, offset_eye), 1);  // and scale
    add_floats(name, 4, 4, offsetof(ObjectInstance, rotation), 1);
    add_floats(name, 5, 4, offsetof(ObjectInstance, coverage), 1);  // and tint
    glVertexArrayBindingDivisor(name, 1, 1);
    add_vertex(name, 6, 2);
    return layout;
}

GlVertexArray make_textured_layout() {
    GlVertexArray layout = make_object_layout();
    add_floats(layout.name(), 9, 2, 0, 3);
    add_floats(layout.name(), 10, 2, 0, 4);
    return layout;
}

void bind_mesh(GLuint layout, const StoredMesh& mesh, GLuint targets) {
    glBindVertexArray(layout);
    glVertexArrayVertexBuffer(layout, 0, mesh.vertex_buffer.name(), 0, sizeof(ObjectVertex));
    glVertexArrayVertexBuffer(layout, 2, targets != 0 ? targets : mesh.vertex_buffer.name(), 0,
                              sizeof(ObjectVertex));
    glVertexArrayElementBuffer(layout, mesh.index_buffer.name());
}

void bind_texture_coordinates(GLuint layout, const StoredMesh& mesh, GLuint targets) {
    const GLuint own = mesh.texture_buffer.name();
    glVertexArrayVertexBuffer(layout, 3, own, 0, sizeof(Eigen::Vector2f));
    glVertexArrayVertexBuffer(layout, 4, targets != 0 ? targets : own, 0, sizeof(Eigen::Vector2f));
}

void bind_own_vertices(GLuint layout, GLuint buffer, std::size_t byte) {
    for (const GLuint binding : {0u, 2u}) {
        glVertexArrayVertexBuffer(layout, binding, buffer, static_cast<GLintptr>(byte),
                                  sizeof(ObjectVertex));
    }
}

namespace {

// A view is rendered at kOversampling times its stored size; kOversamplingLevel is the base-2 logarithm.
constexpr int kOversampling = 4;
constexpr int kOversamplingLevel = 2;

Result<void> check_impostor(const StoredMesh& mesh, const ImpostorSettings& settings) {
    TERRANE_TRY(check_range("views_around", settings.views_around, 4, 64));
    TERRANE_TRY(check_range("views_above", settings.views_above, 1, 16));
    TERRANE_TRY(check_range("texels", settings.texels, 8, 512));
    if (mesh.levels.empty() || mesh.levels[0].index_count == 0)
        return fail(ErrorCode::invalid_argument, "an impostor needs a mesh with triangles");
    return {};
}

StoredImpostor measure(const StoredMesh& mesh, const ImpostorSettings& settings) {
    StoredImpostor made;
    made.settings = settings;
    const Eigen::Vector3d centre = 0.5 * (mesh.bounds.low + mesh.bounds.high);
    made.centre = centre.cast<float>();
    double squared = 0.0, radius = 0.0, height = 0.0;
    for (const ObjectVertex& vertex : mesh.vertices) {
        const Eigen::Vector3d p = Eigen::Vector3f(vertex.position).cast<double>() - centre;
        squared = std::max(squared, p.x() * p.x() + p.y() * p.y());
        height = std::max(height, std::abs(p.z()));
        radius = std::max(radius, p.norm());
    }
    // A margin of a texel keeps the object's edges. A least extent keeps views of a flat object from being empty.
    const double margin = 1.0 + 2.0 / settings.texels;
    const double least = 1e-3 * radius + 1e-6;
    made.half_width = static_cast<float>(std::max(std::sqrt(squared), least) * margin);
    made.half_height = static_cast<float>(std::max(height, least) * margin);
    made.radius = static_cast<float>(std::max(radius, least) * margin);
    return made;
}

// Axes of a view as rows: right, up and towards the viewer.
Eigen::Matrix3d axes_of(const ImpostorSettings& settings, int around, int above) {
    const double azimuth = 2.0 * std::numbers::pi * around / settings.views_around;
    const double elevation = settings.views_above > 1
                                 ? 0.5 * std::numbers::pi * above / (settings.views_above - 1)
                                 : 0.0;
    Eigen::Matrix3d axes;
    axes.row(0) << -std::sin(azimuth), std::cos(azimuth), 0.0;
    axes.row(2) << std::cos(azimuth) * std::cos(elevation), std::sin(azimuth) * std::cos(elevation),
        std::sin(elevation);
    axes.row(1) = Eigen::Vector3d(axes.row(2)).cross(Eigen::Vector3d(axes.row(0)));
    return axes;
}

int mipmap_count(int texels) {
    return static_cast<int>(std::bit_width(static_cast<unsigned>(texels)));
}

GlTexture make_layers(int texels, int layers) {
    GlTexture texture = make_texture_2d_array();
    const GLuint name = texture.name();
    glTextureStorage3D(name, mipmap_count(texels), GL_RGBA8, texels, texels, layers);
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    // transparent black around every view
    glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
    glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
    return texture;
}

// A large picture, which is averaged to give a view.
struct BakeTarget {
    GlTexture colours = make_texture_2d(), shapes = make_texture_2d(), depths = make_texture_2d();
    GlFramebuffer framebuffer = make_framebuffer();

    explicit BakeTarget(int side) {
        for (const GlTexture* texture : {&colours, &shapes})
            glTextureStorage2D(texture->name(), 1 + kOversamplingLevel, GL_RGBA8, side, side);
        glTextureStorage2D(depths.name(), 1, GL_DEPTH_COMPONENT32F, side, side);
        const GLuint name = framebuffer.name();
        glNamedFramebufferTexture(name, GL_COLOR_ATTACHMENT0, colours.name(), 0);
        glNamedFramebufferTexture(name, GL_COLOR_ATTACHMENT1, shapes.name(), 0);
        glNamedFramebufferTexture(name, GL_DEPTH_ATTACHMENT, depths.name(), 0);
        const std::array<GLenum, 2> buffers = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
        glNamedFramebufferDrawBuffers(name, 2, buffers.data());
    }
};

}  // namespace

MaterialPrograms bake_programs() {
    return {"textured impostors' views",
            kColourTexture | kNormalTexture | kGloss | kGlossTexture | kCut,
            std::string(impostor_bake_vert), "#define SAMPLES 1\n",
            std::string(impostor_bake_frag)};
}

Result<void> ImpostorStore::make_programs(const StoredMesh& mesh) {
    for (const StoredMaterial& material : mesh.materials) {
        if (material.features == 0) continue;
        TERRANE_TRY(material_programs_.make(material.features));
        if (textured_layout_.name() == 0) textured_layout_ = make_textured_layout();
    }
    if (program_.name() != 0) return {};
    TERRANE_TRY(GlProgram made,
                internal::make_program("impostors' views", impostor_bake_vert, impostor_bake_frag));
    centre_ = glGetUniformLocation(made.name(), "centre");
    axes_ = glGetUniformLocation(made.name(), "axes");
    program_ = std::move(made);
    layout_ = make_object_layout();
    return {};
}

void ImpostorStore::draw_view(const StoredMesh& mesh, const Eigen::Vector3f& centre,
                              const Eigen::Matrix3f& axes) const {
    for (const StoredMesh::Group& group : mesh.levels[0].groups) {
        const StoredMaterial& material = mesh.materials[group.material];
        if (material.features == 0) {
            glUseProgram(program_.name());
            bind_mesh(layout_.name(), mesh, 0);
            glUniform3fv(centre_, 1, centre.data());
            glUniformMatrix3fv(axes_, 1, GL_FALSE, axes.data());
        } else {
            const MaterialProgram& program = material_programs_.of(material.features);
            program.use(material);
            bind_mesh(textured_layout_.name(), mesh, 0);
            bind_texture_coordinates(textured_layout_.name(), mesh, 0);
            glUniform3fv(program.centre, 1, centre.data());
            glUniformMatrix3fv(program.axes, 1, GL_FALSE, axes.data());
        }
        // OpenGL passes the offset in the index buffer as a pointer
        glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(group.index_count), GL_UNSIGNED_INT,
                       reinterpret_cast<const void*>(group.first_index * sizeof(std::uint32_t)));
    }
}

Result<ImpostorId> ImpostorStore::add(const StoredMesh& mesh, const ImpostorSettings& settings) {
    TERRANE_TRY(check_impostor(mesh, settings));
    TERRANE_TRY(make_programs(mesh));
    StoredImpostor made = measure(mesh, settings);
    const int layers = settings.views_around * settings.views_above;
    made.colours = make_layers(settings.texels, layers);
    made.shapes = make_layers(settings.texels, layers);
    const int side = kOversampling * settings.texels;
    const BakeTarget target(side);

    glBindFramebuffer(GL_FRAMEBUFFER, target.framebuffer.name());
    glViewport(0, 0, side, side);
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GEQUAL);
    glClearDepth(0.0);
    glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
    for (int layer = 0; layer < layers; ++layer) {
        const Eigen::Matrix3d axes =
            axes_of(settings, layer % settings.views_around, layer / settings.views_around);
        const auto width = static_cast<double>(made.half_width);
        const double height =
            static_cast<double>(made.half_height) * axes(1, 2) + width * std::abs(axes(2, 2));
        const Eigen::Vector3d scale(1.0 / width, 1.0 / height,
                                    1.0 / static_cast<double>(made.radius));
        const Eigen::Matrix3f scaled = (scale.asDiagonal() * axes).cast<float>();
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_view(mesh, made.centre, scaled);
        for (const auto& [large, small] :
             {std::pair(&target.colours, &made.colours), std::pair(&target.shapes, &made.shapes)}) {
            glGenerateTextureMipmap(large->name());
            glCopyImageSubData(large->name(), GL_TEXTURE_2D, kOversamplingLevel, 0, 0, 0,
                               small->name(), GL_TEXTURE_2D_ARRAY, 0, 0, 0, layer, settings.texels,
                               settings.texels, 1);
        }
    }
    glGenerateTextureMipmap(made.colours.name());
    glGenerateTextureMipmap(made.shapes.name());
    // two textures of 4 bytes a texel, and a third more for mipmaps
    made.bytes = std::size_t{32} * static_cast<std::size_t>(settings.texels) *
                 static_cast<std::size_t>(settings.texels) * static_cast<std::size_t>(layers) / 3;
    TERRANE_TRY(check_gl("make " + number_text(layers) + " views of an impostor"));
    const ImpostorId id{next_++};
    impostors_.emplace(id, std::move(made));
    return id;
}

const StoredImpostor* ImpostorStore::find(ImpostorId impostor) const {
    const auto found = impostors_.find(impostor);
    return found == impostors_.end() ? nullptr : &found->second;
}

std::size_t ImpostorStore::bytes() const {
    std::size_t bytes = 0;
    for (const auto& [id, impostor] : impostors_) bytes += impostor.bytes;
    return bytes;
}

}  // namespace terrane::internal
