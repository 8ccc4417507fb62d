// SPDX-License-Identifier: MIT
// Prints layouts of public structs and the bits of what the library answers, to be compared between builds of this file
// with different flags against the same library. Everything is computed behind calls, as far as the flags of this file
// cannot reach.
#include <terrane/collision/ground_queries.h>
#include <terrane/collision/vehicle.h>
#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <bit>
#include <cstddef>
#include <cstdio>

using namespace terrane;

namespace {

// FNV-1a over the bits of numbers.
class Bits {
public:
    void add(std::uint64_t bits) { hash_ = (hash_ ^ bits) * 0x100000001b3u; }
    void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
    template <class Derived>
    void add(const Eigen::MatrixBase<Derived>& values) {
        for (Eigen::Index column = 0; column < values.cols(); ++column)
            for (Eigen::Index row = 0; row < values.rows(); ++row) add(values(row, column));
    }
    unsigned long long hash() const { return hash_; }

private:
    std::uint64_t hash_ = 0xcbf29ce484222325u;
};

#define PRINT_LAYOUT(type, last)                                                                  \
    std::printf("%s: %zu bytes, aligned to %zu, %s at %zu\n", #type, sizeof(type), alignof(type), \
                #last, offsetof(type, last))

}  // namespace

int main() {
    // The last member of a struct moves with any other before it.
    PRINT_LAYOUT(Pose, translation);
    PRINT_LAYOUT(View, height_px);
    PRINT_LAYOUT(CameraNeed, trajectory);
    PRINT_LAYOUT(BodySettings, rotates);
    PRINT_LAYOUT(BodyState, condition);
    PRINT_LAYOUT(CharacterControls, jump_speed);
    PRINT_LAYOUT(CharacterState, normal);
    PRINT_LAYOUT(ContactEvent, point_count);
    PRINT_LAYOUT(TerrainMesh, threshold_px);
    std::printf("PathDriver: %zu bytes, aligned to %zu\n", sizeof(PathDriver), alignof(PathDriver));
    std::printf("WorldSettings: %zu bytes; Triangulator: %zu; Pager: %zu; World: %zu\n",
                sizeof(WorldSettings), sizeof(Triangulator), sizeof(Pager), sizeof(World));

    const auto source = FractalHeights::create({.seed = 7}).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    Triangulator triangulator = Triangulator::create(*source, {.triangle_budget = 20'000}).value();
    World world = World::create({.worker_count = 2}).value();
    const auto above_ground = [&](double x, double y) {
        BodyState state;
        state.pose.translation = WorldPos(x, y, source->height(x, y) + 4.0);
        return state;
    };
    const BodyId truck = world.add_vehicle(make_truck(), above_ground(0, 0).pose).value();
    const BodyId walker = world.add_character({}, above_ground(0, 20).pose.translation).value();
    for (int i = 0; i < 12; ++i) {
        const BodySettings settings{.shape = i % 2 == 0
                                                 ? Shape(Sphere{.radius = 0.4})
                                                 : Shape(Box{.half_extents = {0.3, 0.4, 0.5}}),
                                    .mass = 30};
        world.add(settings, above_ground(6 + 0.875 * (i % 4), 0.875 * (i / 4))).value();
    }
    PathDriver driver = PathDriver::create({{0, 0}, {20, 5}, {40, -5}}, {}).value();
    CharacterControls controls;
    controls.velocity = Eigen::Vector2d(1.5, -0.5);
    Bits bits;
    CameraNeed camera;
    for (int frame = 0; frame < 120; ++frame) {
        const VehicleState* const state = world.vehicle(truck);
        if (!world.set_controls(truck,
                                driver.drive(*world.vehicle_settings(truck), *state, 1.0 / 60.0)) ||
            !world.set_controls(walker, controls))
            return 1;
        camera.view =
            look_at(WorldPos(-30, 3.0 * frame, 400), WorldPos(500, 100, 0), 1.0, 640, 360).value();
        pager.update({&camera, 1}, world.needs(), frame / 60.0);
        const Ground ground = pager.ground();
        const StepReport report = world.step(ground, 1.0 / 60.0);
        if (report.parked + report.too_deep > 0) return 1;
        for (const BodyState& body : world.states()) {
            bits.add(body.pose.rotation);
            bits.add(body.pose.translation);
            bits.add(body.velocity);
        }
        const TerrainMesh mesh = triangulator.update(pager.resident(), camera.view);
        camera.threshold_px = mesh.threshold_px;
        bits.add(static_cast<std::uint64_t>(mesh.triangle_count));
        bits.add(mesh.error_px);
        for (const std::uint16_t index : mesh.indices) bits.add(std::uint64_t{index});
        const HeightAnswer at = ground.height(0.75 * frame, 3.0);
        bits.add(at.height);
        bits.add(at.error_m);
        bits.add(at.normal);
    }
    std::printf("bits %016llx\n", bits.hash());
    return 0;
}
