// SPDX-License-Identifier: MIT
#include "benchmark/collision/contact_workload.h"

#include "benchmark/bench.h"
#include "support/random.h"

#include <terrane/terrain/pager.h>

namespace terrane::bench {

Ground load_ground(const std::shared_ptr<const HeightSource>& source) {
    Pager pager = value_or_exit(
        Pager::create(source, {.memory_bytes = std::size_t{2} << 30, .worker_count = 0}));
    const RequiredRegion required = pager.require(source->extent(), 0.0);
    pager.update({}, {}, 0.0);
    pager.finish();
    if (!required.is_ready()) {
        std::fprintf(stderr, "the ground with samples every %g m is not resident\n",
                     source->lattice().spacing);
        std::exit(1);
    }
    return pager.ground();
}

bool ContactMap::is_below(const WorldPos& place) const {
    const HeightAnswer at = ground.height(place.x(), place.y());
    return at.status != QueryStatus::ok || place.z() < at.height;
}

ContactMap make_contact_map(int side, double spacing) {
    return make_map(test::make_contact_table(side, spacing));
}

ContactMap make_map(const test::HeightTable& heights) {
    const int side = heights.columns;
    ContactMap map{load_ground(std::make_shared<const test::TableHeights>(heights)), {}};
    map.table.columns = map.table.rows = side;
    map.table.spacing = heights.spacing;
    const double quantum = map.ground.lattice().quantum;
    for (int row = 0; row < side; ++row) {
        for (int column = 0; column < side; ++column) {
            const bool last_column = column + 1 == side, last_row = row + 1 == side;
            const GroundCell cell = map.ground.cell(column - last_column, row - last_row);
            const std::int32_t quanta = last_row
                                            ? (last_column ? cell.north_east : cell.north_west)
                                            : (last_column ? cell.south_east : cell.south_west);
            map.table.heights.push_back(static_cast<float>(quantum * quanta));
        }
    }
    return map;
}

std::array<DropKind, 4> drop_kinds() {
    const Shape sphere = Sphere{0.5}, capsule = Capsule{0.4, 0.8}, box = Box{{1.0, 2.0, 0.5}};
    return {DropKind{"spheres", {sphere}}, DropKind{"capsules", {capsule}},
            DropKind{"boxes", {box}}, DropKind{"mixed", {sphere, capsule, box}}};
}

BodyDrop lay_out_drop(const ContactMap& map, std::span<const Shape> shapes, std::size_t count,
                      double half_width, double distance, const Eigen::Vector3d& velocity) {
    test::Random random(5);
    const auto row = static_cast<std::size_t>(2.0 * half_width / distance);
    const double middle = 0.5 * map.width();
    BodyDrop drop;
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t layer = i / (row * row), place = i % (row * row);
        const double x = middle - half_width + distance * (0.5 + static_cast<double>(place % row));
        const double y = middle - half_width + distance * (0.5 + static_cast<double>(place / row));
        BodyState state;
        state.pose.translation = {
            x, y, map.ground.height(x, y).height + 5.0 + distance * static_cast<double>(layer)};
        const Eigen::Vector3d turn = 3.0 * random.direction();
        state.pose.rotation = Motion{{}, Eigen::Vector3d::Zero(), turn}.at(1.0).rotation;
        state.velocity = velocity;
        drop.settings.push_back({.shape = shapes[i % shapes.size()]});
        drop.states.push_back(state);
    }
    return drop;
}

}  // namespace terrane::bench
