// SPDX-License-Identifier: MIT
#include "body_drop.h"

#include "support/random.h"

namespace terrane::bench {

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
