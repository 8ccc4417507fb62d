// Wheels that ask for height, normal and friction below a point, as Project Chrono's tyres ask a ChTerrain. With Chrono
// the two types below are chrono::ChVector3d and chrono::vehicle::ChTerrain; the rest stays the same.
#include "motion_trace.h"

#include <terrane/adapters/chrono_terrain.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/terrain.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace {

// The parts of Chrono's interface that ChronoTerrain uses.
class ChVector3d {
public:
    ChVector3d(double x, double y, double z) : xyz_{x, y, z} {}
    double x() const { return xyz_[0]; }
    double y() const { return xyz_[1]; }
    double z() const { return xyz_[2]; }

private:
    std::array<double, 3> xyz_;
};
// NOLINTBEGIN(readability-identifier-naming): Chrono's names
struct ChTerrain {
    virtual ~ChTerrain() = default;
    virtual double GetHeight(const ChVector3d& loc) const = 0;
    virtual ChVector3d GetNormal(const ChVector3d& loc) const = 0;
    virtual float GetCoefficientFriction(const ChVector3d& loc) const = 0;
};
// NOLINTEND(readability-identifier-naming)

}  // namespace

int main(int argc, char** argv) {
    using namespace terrane;
    MotionTrace trace(argc, argv);
    const auto source = FractalHeights::create({.seed = 7}).value();
    Terrain terrain = Terrain::create(source, {.paging = {.worker_count = 0}}).value();
    adapters::ChronoTerrain<ChTerrain, ChVector3d> chrono_terrain(
        adapters::TyreGround::create({.friction = 0.7f}).value());
    const ChTerrain& as_chrono_sees_it = chrono_terrain;

    double x = 0.0, lowest = 1e9, highest = -1e9;
    const double dt = 0.01, speed = 20.0;
    for (int step = 0; step < 500; ++step) {
        // 1. The needs of the vehicle. 2. The ground of this step. 3. The step of the vehicle.
        const BodyNeed need{.centre_world = {x, 0.0, source->height(x, 0.0)},
                            .velocity = {speed, 0.0, 0.0},
                            .radius = 3.0};
        chrono_terrain.tyre_ground().set_ground(terrain.update({}, {&need, 1}, step * dt).ground);
        for (const double wheel : {-1.5, 1.5}) {
            const ChVector3d below(x + wheel, 0.9, 1e4);
            const double height = as_chrono_sees_it.GetHeight(below);
            lowest = std::min(lowest, height);
            highest = std::max(highest, height);
            trace.add(wheel < 0.0 ? "rear wheel" : "front wheel", step * dt,
                      {x + wheel, 0.9, height}, source->height(x + wheel, 0.9));
        }
        x += speed * dt;
    }
    const adapters::StatusCounter& counts = chrono_terrain.tyre_ground().counts();
    std::printf("%llu answers between %.2f and %.2f m, %llu without ground\n",
                static_cast<unsigned long long>(counts.of(QueryStatus::ok)), lowest, highest,
                static_cast<unsigned long long>(counts.failed()));
    return counts.failed() == 0 && std::isfinite(lowest) ? 0 : 1;
}
