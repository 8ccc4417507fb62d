// SPDX-License-Identifier: MIT
#include "terrain/ground_draws.h"

#include "gl/frame_resources.h"
#include "gl/gl_object.h"
#include "gl/shader.h"
#include "light/frame_uniforms.h"
#include "light/ground_shade.h"
#include "light/shadow_maps.h"
#include "render/render_scene.h"
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/render/offscreen.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

namespace terrane::internal {
namespace chunk_pool_test {

// 6 x 6 roots and no finer level.
class ChunkPoolTest : public test::GlTest {
protected:
    void SetUp() override {
        GlTest::SetUp();
        if (IsSkipped()) return;
        lattice_.root_count_x = lattice_.root_count_y = 6;
        const test::WaveHeights source(lattice_, 12.0, 90.0);
        for (std::int32_t y = 0; y < 6; ++y) {
            for (std::int32_t x = 0; x < 6; ++x) {
                Result<std::shared_ptr<const Chunk>> chunk = make_chunk(source, {x, y, 0});
                ASSERT_TRUE(chunk) << chunk.error().message;
                chunks_.push_back(std::move(*chunk));
            }
        }
    }

    ResidentSet first_chunks(std::size_t count) const {
        return {lattice_,
                WorldRect{},
                {chunks_.begin(), chunks_.begin() + static_cast<int>(count)},
                count};
    }

    // Finds every chunk of a set, in its order; pairs of page and slot.
    static std::vector<std::pair<int, int>> find_all(ChunkPool& pool, const ResidentSet& resident) {
        pool.follow(resident);
        std::vector<std::pair<int, int>> places;
        for (const std::shared_ptr<const Chunk>& chunk : resident.chunks()) {
            const ChunkSlot* slot = pool.find(resident, *chunk);
            EXPECT_NE(slot, nullptr);
            if (slot == nullptr) return places;
            places.emplace_back(slot->page, slot->slot);
        }
        return places;
    }

    // Compares the slot of a chunk on the device with the heights of the chunk.
    static void expect_content(ChunkPool& pool, const ResidentSet& resident, const Chunk& chunk) {
        const ChunkSlot* slot = pool.find(resident, chunk);
        ASSERT_NE(slot, nullptr);
        const ChunkPage& page = pool.page(slot->page);
        std::vector<std::int32_t> heights(kSlotSamples);
        const auto bytes = static_cast<GLsizeiptr>(heights.size() * sizeof(std::int32_t));
        glGetNamedBufferSubData(page.heights.name(), slot->slot * bytes, bytes, heights.data());
        EXPECT_EQ(heights, chunk.heights);
    }

    Lattice lattice_;
    std::vector<std::shared_ptr<const Chunk>> chunks_;
};

TEST_F(ChunkPoolTest, APageThatGrowsKeepsWhatItHolds) {
    ChunkPool pool(ChunkPool::largest_page());
    const ResidentSet few = first_chunks(30), all = first_chunks(36);
    find_all(pool, few);
    const int capacity = pool.page(0).capacity;
    ASSERT_LT(capacity, 36);
    const std::vector<std::pair<int, int>> places = find_all(pool, all);
    EXPECT_EQ(pool.page_count(), 1);
    EXPECT_GT(pool.page(0).capacity, capacity);
    EXPECT_EQ(std::set(places.begin(), places.end()).size(), 36u);
    for (const std::size_t i : {0u, 1u, 7u, 29u, 35u}) expect_content(pool, all, *chunks_[i]);
    EXPECT_TRUE(check_gl("grow"));
}

TEST_F(ChunkPoolTest, BeginsAPageWhereTheLastIsFullAndGivesEmptyOnesBack) {
    ChunkPool pool(10);
    const ResidentSet all = first_chunks(36);
    const std::vector<std::pair<int, int>> places = find_all(pool, all);
    EXPECT_EQ(pool.page_count(), 4);
    EXPECT_EQ(std::set(places.begin(), places.end()).size(), 36u);
    for (const auto& [page, slot] : places) {
        EXPECT_TRUE(slot >= 0 && slot < 10) << page << ", " << slot;
    }
    for (const std::size_t i : {0u, 9u, 10u, 35u}) expect_content(pool, all, *chunks_[i]);
    const std::size_t bytes = pool.bytes();

    pool.follow(first_chunks(12));
    EXPECT_EQ(pool.page_count(), 2);
    EXPECT_EQ(pool.bytes(), bytes / 3);
    pool.follow(first_chunks(0));
    EXPECT_EQ(pool.page_count(), 0);
    EXPECT_EQ(pool.bytes(), 0u);
    EXPECT_TRUE(check_gl("follow"));
}

TEST_F(ChunkPoolTest, TakesTheSlotsOfChunksThatLeftBeforeItGrows) {
    ChunkPool pool(16);
    const ResidentSet first = first_chunks(16);
    find_all(pool, first);
    // rows one to three leave, but for four chunks of the last row
    std::vector<std::shared_ptr<const Chunk>> later(chunks_.begin() + 12, chunks_.begin() + 28);
    const ResidentSet second(lattice_, WorldRect{}, later, 2);
    find_all(pool, second);
    EXPECT_EQ(pool.page_count(), 1);
    for (const std::size_t i : {12u, 15u, 16u, 27u}) expect_content(pool, second, *chunks_[i]);
}

TEST_F(ChunkPoolTest, FindsNoChunkOutsideTheSet) {
    ChunkPool pool(16);
    const ResidentSet few = first_chunks(3);
    pool.follow(few);
    EXPECT_EQ(pool.find(few, *chunks_[3]), nullptr);
    // another chunk with the same key
    const Chunk other = *chunks_[0];
    EXPECT_EQ(pool.find(few, other), nullptr);
    EXPECT_NE(pool.find(few, *chunks_[0]), nullptr);
    EXPECT_EQ(pool.find(few, other), nullptr);
}

}  // namespace chunk_pool_test

namespace eye_frame_test {

TEST(SplitInteger, RecombinesExactlyAndKeepsSmallNumbersInTheLowPart) {
    constexpr std::uint64_t kSeed = 11;
    test::Random random(kSeed);
    for (int i = 0; i < 10'000; ++i) {
        const std::int64_t value = static_cast<std::int64_t>(random.bits()) >> (14 + i % 50);
        const SplitInteger parts = split(value, kIndexBits);
        ASSERT_EQ(std::int64_t{parts.high} * (1 << kIndexBits) + parts.low, value) << kSeed;
        ASSERT_LT(std::abs(parts.low), (1 << (kIndexBits - 1)) + 1);
        if (std::abs(value) < (1 << (kIndexBits - 1))) {
            ASSERT_EQ(parts.high, 0) << value;
        }
    }
}

TEST(EyeFrame, LeavesLessThanAStepAndLosesNothingFarFromTheOrigin) {
    constexpr std::uint64_t kSeed = 12;
    test::Random random(kSeed);
    Lattice lattice;
    lattice.origin_x = -17.25;
    lattice.origin_y = 3.5;
    lattice.spacing = 0.75;
    for (int i = 0; i < 1000; ++i) {
        const WorldPos eye(random.between(-1e7, 1e7), random.between(-1e7, 1e7),
                           random.between(-1e5, 1e5));
        const Result<EyeFrame> frame = make_eye_frame(lattice, eye);
        ASSERT_TRUE(frame);
        EXPECT_LE(std::abs(frame->remainder_x), 0.3751) << kSeed;
        EXPECT_LE(std::abs(frame->remainder_y), 0.3751);
        EXPECT_LE(std::abs(frame->remainder_z), 0.51 * lattice.quantum);
        EXPECT_NEAR(lattice.x(frame->x) + frame->remainder_x, eye.x(), 1e-8);
        EXPECT_NEAR(lattice.y(frame->y) + frame->remainder_y, eye.y(), 1e-8);
    }
}

TEST(EyeFrame, RefusesAnEyeWhoseIntegersDoNotFit) {
    const Lattice lattice;
    const double infinity = std::numeric_limits<double>::infinity();
    for (const double far : {1e300, -1e300, infinity, std::nan("")}) {
        EXPECT_FALSE(make_eye_frame(lattice, {far, 0.0, 0.0}));
        EXPECT_FALSE(make_eye_frame(lattice, {0.0, far, 0.0}));
        EXPECT_FALSE(make_eye_frame(lattice, {0.0, 0.0, far}));
    }
}

}  // namespace eye_frame_test

namespace ground_draws_test {

using test::add_offsets;
using test::make_scene;
using test::Scene;

constexpr int kWidth = 320;
constexpr int kHeight = 180;

// Output of terrain.vert for one vertex: p_eye and gl_Position.
struct Displayed {
    std::array<float, 3> p_eye{};
    std::array<float, 4> p_clip{};
    std::array<std::uint32_t, 7> bits() const {
        return std::bit_cast<std::array<std::uint32_t, 7>>(*this);
    }
};

// A vertex and the sample that it displays.
struct Vertex {
    const MeshChunk* chunk = nullptr;
    std::uint16_t sample = 0;
    LatticePoint point;  // from the world's south-west corner
    Displayed displayed;
};

// Down on the world from far above, so that no chunk is left out.
View view_of_all() {
    View view;
    view.eye_world = {0.0, 0.0, 1e9};
    view.forward = -Eigen::Vector3d::UnitZ();
    view.up = Eigen::Vector3d::UnitY();
    return view;
}

class GroundDrawsTest : public test::GlTest {
protected:
    void SetUp() override {
        GlTest::SetUp();
        if (IsSkipped()) return;
        // without a window drawing needs a target, even with rasterisation disabled
        picture_.emplace(std::move(*Framebuffer::create(kWidth, kHeight, 4)));
        picture_->bind_depth();
    }

    // The vertex shader of the library without a fragment shader, with transform feedback.
    static GlProgram make_capture() {
        const GlShader shader(glCreateShader(GL_VERTEX_SHADER));
        const std::array<const GLchar*, 2> texts{light_glsl.data(), terrain_vert.data()};
        const std::array<GLint, 2> lengths{static_cast<GLint>(light_glsl.size()),
                                           static_cast<GLint>(terrain_vert.size())};
        glShaderSource(shader.name(), 2, texts.data(), lengths.data());
        glCompileShader(shader.name());
        GlProgram program(glCreateProgram());
        glAttachShader(program.name(), shader.name());
        const std::array<const GLchar*, 2> captured{"p_eye", "gl_Position"};
        glTransformFeedbackVaryings(program.name(), 2, captured.data(), GL_INTERLEAVED_ATTRIBS);
        glLinkProgram(program.name());
        GLint is_good = 0;
        glGetProgramiv(program.name(), GL_LINK_STATUS, &is_good);
        EXPECT_EQ(is_good, GL_TRUE);
        return program;
    }

    static GlBuffer bind_uniforms(const Lattice& lattice, const View& view, const EyeFrame& eye) {
        const FrameUniforms uniforms = make_frame_uniforms({}, lattice, view, eye);
        GlBuffer buffer = make_buffer();
        glNamedBufferStorage(buffer.name(), sizeof(uniforms), &uniforms, 0);
        glBindBufferBase(GL_UNIFORM_BUFFER, 0, buffer.name());
        return buffer;
    }

    // The displayed position of every vertex of every triangle, in drawing order.
    static std::vector<Vertex> capture(GroundDraws& draws, const Scene& scene, const View& view) {
        const Lattice& lattice = scene.resident->lattice();
        const EyeFrame eye = *make_eye_frame(lattice, view.eye_world);
        const TerrainMesh mesh = scene.mesh();
        const Result<void> ready = draws.prepare(mesh, view_of_all(), eye);
        EXPECT_TRUE(ready) << (ready ? "" : ready.error().message);

        std::vector<Vertex> vertices;
        for (std::size_t i = scene.chunks.size(); i-- > 0;) {
            const MeshChunk& drawn = scene.chunks[i];
            for (const std::uint16_t sample :
                 mesh.indices.subspan(drawn.first_index, drawn.index_count)) {
                const LatticePoint corner = drawn.chunk->corner;
                vertices.push_back(
                    {&drawn,
                     sample,
                     {corner.x - lattice.west() + sample % kChunkSamples * drawn.chunk->step,
                      corner.y - lattice.south() + sample / kChunkSamples * drawn.chunk->step},
                     {}});
            }
        }
        const GlBuffer uniforms = bind_uniforms(lattice, view, eye);
        const GlProgram program = make_capture();
        const GlBuffer results = make_buffer();
        const auto bytes = static_cast<GLsizeiptr>(vertices.size() * sizeof(Displayed));
        glNamedBufferStorage(results.name(), bytes, nullptr, 0);
        glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, results.name());
        glEnable(GL_RASTERIZER_DISCARD);
        glUseProgram(program.name());
        glBeginTransformFeedback(GL_TRIANGLES);
        draws.draw();
        glEndTransformFeedback();
        glDisable(GL_RASTERIZER_DISCARD);
        draws.finish();
        std::vector<Displayed> displayed(vertices.size());
        glGetNamedBufferSubData(results.name(), 0, bytes, displayed.data());
        for (std::size_t i = 0; i < vertices.size(); ++i) vertices[i].displayed = displayed[i];
        const Result<void> good = check_gl("capture");
        EXPECT_TRUE(good) << (good ? "" : good.error().message);
        return vertices;
    }

    // The picture of prepared draws, lit.
    Image draw(GroundDraws& draws, const GlProgram& program, GroundShade& shade) {
        picture_->bind_depth();
        glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
        glEnable(GL_DEPTH_TEST);
        glDepthFunc(GL_GEQUAL);
        glClearDepth(0.0);
        glClear(GL_DEPTH_BUFFER_BIT);
        glUseProgram(program.name());
        draws.draw();
        draws.finish();
        shade.draw(*picture_, false);
        return picture_->read();
    }

    std::optional<Framebuffer> picture_;
};

View view_from(const WorldPos& eye, const WorldPos& target) {
    return *look_at(eye, target, 1.0, kWidth, kHeight);
}

struct Agreement {
    int shared = 0;     // lattice points displayed by chunks of different levels
    int morphing = 0;   // of these, with an offset
    int different = 0;  // lattice points with more than one position
};

Agreement compare(const std::vector<Vertex>& vertices) {
    struct Point {
        std::array<std::uint32_t, 7> bits{};
        int level = 0;
        bool is_shared = false, is_different = false, is_morphing = false;
    };
    std::map<LatticePoint, Point> points;
    for (const Vertex& vertex : vertices) {
        const int level = vertex.chunk->chunk->key.level;
        const auto [at, is_new] =
            points.try_emplace(vertex.point, Point{vertex.displayed.bits(), level});
        Point& point = at->second;
        point.is_shared = point.is_shared || point.level != level;
        point.is_different = point.is_different || point.bits != vertex.displayed.bits();
        point.is_morphing = point.is_morphing || (vertex.chunk->offsets != nullptr &&
                                                  vertex.chunk->offsets[vertex.sample] != 0.0f);
    }
    Agreement agreement;
    for (const auto& [place, point] : points) {
        agreement.shared += point.is_shared ? 1 : 0;
        agreement.morphing += point.is_shared && point.is_morphing ? 1 : 0;
        agreement.different += point.is_different ? 1 : 0;
    }
    return agreement;
}

TEST_F(GroundDrawsTest, ChunksThatShareASampleDisplayItAtTheSameBits) {
    for (const std::int32_t roots_east : {0, -3, 39'063}) {
        Scene scene = make_scene(roots_east);
        add_offsets(scene);
        GroundDraws draws;
        const double west = 256.0 * roots_east;
        for (int i = 0; i < 4; ++i) {
            const WorldPos eye(west + 131.137 + 40.3 * i, 127.71 - 11.9 * i, 9.013 + 30.7 * i);
            const Agreement agreement =
                compare(capture(draws, scene, view_from(eye, {west + 190.0, 140.0 + i, 0.0})));
            // 65 samples 2 m apart along three edges of the fine chunk, two of them common
            EXPECT_EQ(agreement.shared, 193);
            EXPECT_GT(agreement.morphing, 90);
            EXPECT_EQ(agreement.different, 0) << "roots east " << roots_east << ", view " << i;
        }
    }
}

TEST_F(GroundDrawsTest, TheComparisonSeesATenThousandthOfAnOffset) {
    Scene scene = make_scene();
    add_offsets(scene);
    float& offset = scene.offsets[1][sample_index(0, 64)];
    ASSERT_NE(offset, 0.0f);
    offset *= 1.0001f;
    GroundDraws draws;
    const View view = view_from({128.2, 190.1, 20.0}, {128.0, 192.0, 0.0});
    EXPECT_EQ(compare(capture(draws, scene, view)).different, 1);
}

TEST_F(GroundDrawsTest, AnOffsetIsOneSumAfterAllElse) {
    Scene scene = make_scene(39'063);
    GroundDraws draws;
    const double west = 256.0 * 39'063;
    // close to the hills: sums whose exponent changes reveal the order of rounding
    const View view = view_from({west + 131.137, 87.71, 2.0131}, {west + 190.0, 140.0, 0.0});
    const std::vector<Vertex> still = capture(draws, scene, view);
    add_offsets(scene);
    const std::vector<Vertex> moved = capture(draws, scene, view);
    ASSERT_EQ(still.size(), moved.size());
    int moved_count = 0;
    for (std::size_t i = 0; i < still.size(); ++i) {
        const std::array<float, 3>& before = still[i].displayed.p_eye;
        const std::array<float, 3>& after = moved[i].displayed.p_eye;
        const float offset = test::offset_at(moved[i].point.x, moved[i].point.y);
        ASSERT_EQ(after[0], before[0]);
        ASSERT_EQ(after[1], before[1]);
        ASSERT_EQ(after[2], before[2] + offset) << moved[i].point.x << ", " << moved[i].point.y;
        moved_count += after[2] != before[2] ? 1 : 0;
    }
    EXPECT_GT(moved_count, 10'000);
}

TEST_F(GroundDrawsTest, EverySampleIsDisplayedWhereItLies) {
    Scene scene = make_scene();
    add_offsets(scene);
    GroundDraws draws;
    const View view = view_from({131.137, 87.71, 29.013}, {190.0, 140.0, 0.0});
    const Lattice& lattice = scene.resident->lattice();
    for (const Vertex& vertex : capture(draws, scene, view)) {
        const WorldPos p_world(lattice.x(vertex.point.x), lattice.y(vertex.point.y),
                               vertex.chunk->displayed_height(vertex.sample, lattice.quantum));
        const Eigen::Vector3d wanted = p_world - view.eye_world;
        for (int axis = 0; axis < 3; ++axis) {
            // three roundings of numbers below 512
            ASSERT_NEAR(vertex.displayed.p_eye[static_cast<std::size_t>(axis)], wanted[axis], 1e-4);
        }
    }
}

TEST_F(GroundDrawsTest, PagesOfOneSlotDrawTheSamePositionsAndPicture) {
    Scene scene = make_scene();
    add_offsets(scene);
    const View view = view_from({190.0, 20.0, 60.0}, {200.0, 140.0, 0.0});
    const Lattice& lattice = scene.resident->lattice();
    const EyeFrame eye = *make_eye_frame(lattice, view.eye_world);
    const GlProgram program = *make_program("the terrain", terrain_vert, depth_frag);
    GroundShade shade = std::move(*GroundShade::create(picture_->sample_count()));
    std::vector<std::vector<Vertex>> vertices;
    std::vector<Image> images;
    std::vector<std::size_t> batch_counts;
    for (const int max_page_slots : {ChunkPool::largest_page(), 1, 2}) {
        GroundDraws draws(max_page_slots);
        vertices.push_back(capture(draws, scene, view));
        const GlBuffer uniforms = bind_uniforms(lattice, view, eye);
        ASSERT_TRUE(draws.prepare(scene.mesh(), view_of_all(), eye));
        batch_counts.push_back(draws.batch_count());
        ASSERT_TRUE(shade.prepare(scene.resident, view, eye));
        images.push_back(draw(draws, program, shade));
        shade.finish();
    }
    EXPECT_EQ(batch_counts, (std::vector<std::size_t>{1, 3, 2}));
    for (std::size_t other : {1u, 2u}) {
        EXPECT_EQ(test::count_different(images[0], images[other]), 0);
        for (std::size_t i = 0; i < vertices[0].size(); ++i) {
            ASSERT_EQ(vertices[0][i].displayed.bits(), vertices[other][i].displayed.bits());
        }
    }
    // the picture shows ground
    int bright = 0;
    for (const std::uint8_t value : images[0].rgb) bright += value > 30 ? 1 : 0;
    EXPECT_GT(bright, kWidth * kHeight);
    EXPECT_TRUE(check_gl("draw pages"));
}

TEST_F(GroundDrawsTest, TheCastersAreTheBackFacesThatTheDeviceKeeps) {
    Scene scene = make_scene();
    add_offsets(scene);
    const View view = view_from({190.0, 20.0, 60.0}, {200.0, 140.0, 0.0});
    const Lattice& lattice = scene.resident->lattice();
    const EyeFrame eye = *make_eye_frame(lattice, view.eye_world);
    const GlProgram program = *make_program("the terrain", terrain_vert, depth_frag);
    constexpr int kTexels = 256;
    const ShadowMaps maps(kTexels, 0.0);
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GEQUAL);
    glClearDepth(0.0);
    // elevations of 5 and 17 degrees, and of 83, for which no slope is steep enough
    int covered = 0;
    for (const double rise : {0.09, 0.3, 8.0}) {
        for (const double azimuth : {0.4, 2.5, 4.6}) {
            SCOPED_TRACE(testing::Message() << rise << " " << azimuth);
            const Eigen::Vector3d sun(std::sin(azimuth), std::cos(azimuth), rise);
            const auto cascades = make_sun_cascades(view, sun, 400.0, kTexels);
            FrameUniforms uniforms = make_frame_uniforms({}, lattice, view, eye);
            uniforms.clip_from_eye = cascades[2].clip_from_eye(view.eye_world);
            const GlBuffer buffer = make_buffer();
            glNamedBufferStorage(buffer.name(), sizeof(uniforms), &uniforms, 0);
            glBindBufferBase(GL_UNIFORM_BUFFER, 0, buffer.name());
            std::vector<std::vector<float>> depths;
            for (const GroundCasters casters : {GroundCasters::all, GroundCasters::backs}) {
                GroundDraws draws;
                ASSERT_TRUE(
                    draws.prepare(scene.mesh(), view, eye, GroundCulling::view, cascades, casters));
                maps.begin_cascade(2);
                // what the selection leaves out is what the device would cull
                if (casters == GroundCasters::all) ShadowMaps::begin_ground();
                glPolygonOffset(0.0f, 0.0f);
                glUseProgram(program.name());
                draws.draw_casters(2);
                draws.finish();
                depths.emplace_back(std::size_t{kTexels} * kTexels);
                glReadPixels(0, 0, kTexels, kTexels, GL_DEPTH_COMPONENT, GL_FLOAT,
                             depths.back().data());
                ShadowMaps::end_ground();
                maps.end_cascades();
            }
            EXPECT_EQ(depths[0], depths[1]);
            const auto count =
                std::ranges::count_if(depths[1], [](float depth) { return depth > 0.0f; });
            EXPECT_LT(count, kTexels * kTexels / 2);
            covered += count > 100 ? 1 : 0;
            if (rise > 1.0) {
                EXPECT_EQ(count, 0);
            }
        }
    }
    EXPECT_EQ(covered, 6);
    EXPECT_TRUE(check_gl("draw casters"));
}

TEST_F(GroundDrawsTest, ChunksOutOfViewDoNotChangeThePicture) {
    Scene scene = make_scene();
    add_offsets(scene);
    // a root far above its samples: only its offsets are in view of who looks along at 300 m
    test::raise_western_root(scene, 300.0f);
    std::vector<View> views{view_from({-300.0, 60.0, 300.0}, {0.0, 60.0, 300.0})};
    views.back().vertical_fov = 0.3;
    for (int i = 0; i < 16; ++i) {
        const WorldPos eye(150.0 + 14.0 * i, 130.0 - 20.0 * (i % 3), 30.0 + 4.0 * i);
        views.push_back(
            view_from(eye, eye + Eigen::Vector3d(std::cos(0.41 * i), std::sin(0.41 * i), -0.3)));
        views.back().vertical_fov = 0.3;
    }
    const Lattice& lattice = scene.resident->lattice();
    const GlProgram program = *make_program("the terrain", terrain_vert, depth_frag);
    GroundShade shade = std::move(*GroundShade::create(picture_->sample_count()));
    std::size_t culled = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
        const EyeFrame eye = *make_eye_frame(lattice, views[i].eye_world);
        const GlBuffer uniforms = bind_uniforms(lattice, views[i], eye);
        ASSERT_TRUE(shade.prepare(scene.resident, views[i], eye));
        std::vector<Image> images;
        for (const GroundCulling culling : {GroundCulling::none, GroundCulling::view}) {
            GroundDraws draws;
            ASSERT_TRUE(draws.prepare(scene.mesh(), views[i], eye, culling));
            EXPECT_EQ(draws.drawn_count() + draws.culled_count(), scene.chunks.size());
            if (culling == GroundCulling::none) {
                EXPECT_EQ(draws.culled_count(), 0u);
            }
            culled += draws.culled_count();
            if (i == 0) {
                EXPECT_GE(draws.drawn_count(), 1u);
            }
            images.push_back(draw(draws, program, shade));
        }
        shade.finish();
        EXPECT_EQ(test::count_different(images[0], images[1]), 0) << "view " << i;
    }
    EXPECT_GT(culled, views.size());
    EXPECT_TRUE(check_gl("draw without chunks out of view"));
}

}  // namespace ground_draws_test
}  // namespace terrane::internal
