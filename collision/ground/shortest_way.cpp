// SPDX-License-Identifier: MIT
//
// Sources: A. Land, A. Doig. An automatic method of solving discrete programming problems. Econometrica 1960
//          (branch and bound).
// Each column that stands in the way is left along one of the directions of the separating axis theorem. So
// the shortest way out is the shortest translation inside some choice of half-spaces, one a column: choices are
// tried, the least first, while they are shorter than the best so far.
#include "shortest_way.h"

#include "freeing.h"
#include "half_spaces.h"

#include <algorithm>

namespace terrane::internal {
namespace {

class Search {
public:
    Search(const LocalGround& local, const LocalBody& body, const Eigen::Vector3d& known)
        : local_(local), body_(body), best_(known), least_(length(known)) {}

    Eigen::Vector3d run() {
        HalfSpaces spaces;
        look(spaces, Eigen::Vector3d::Zero(), 0);
        return best_;
    }

private:
    static constexpr int kMostLooks = 512;
    static constexpr int kMostColumns = 24;       // that hold a body at once: three do
    static constexpr int kMostSteps = 4;          // away from columns that are touched
    static constexpr std::size_t kMostWays = 32;  // out of a column, shorter than the best

    struct Way {
        HalfSpace plane;
        Eigen::Vector3d d;
        double size = 0.0;
    };

    // `d` is the shortest translation inside all half-spaces.
    void look(HalfSpaces& spaces, const Eigen::Vector3d& d, int columns) {
        if (++looks_ > kMostLooks) return;
        Eigen::Vector3d place = d;
        std::array<Way, kMostWays> ways;
        std::size_t count = 0;
        for (int step = 0;; ++step) {
            const GroundLift lift = find_lift(local_, body_, place, 0.5 * kTouch);
            if (!(lift.lift > 0.5 * kTouch)) {
                take(place);
                return;
            }
            // A column that is only touched says nothing about those beside it: a hair away from it.
            Eigen::Vector3d away;
            if (!find_ways(spaces, lift, d, ways, count, away)) break;
            if (step == kMostSteps) return;
            place += 0.25 * kTouch * away;
        }
        if (columns == kMostColumns) return;
        for (std::size_t i = 0; i < count; ++i) {
            if (!(ways[i].size < least_)) break;
            spaces.planes[spaces.count++] = ways[i].plane;
            look(spaces, ways[i].d, columns + 1);
            --spaces.count;
        }
    }

    void take(const Eigen::Vector3d& d) {
        // Planes were made for other places: a round column may let it pass nearer.
        const Eigen::Vector3d shorter =
            body_.whole().kind == ShapeKind::round ? shorten(local_, body_, d) : d;
        if (!(length(shorter) < least_)) return;
        best_ = shorter;
        least_ = length(shorter);
    }

    // The ways out of the column that holds a body at `d`, shortest first. True, and the way that was taken, where
    // it has left the column.
    bool find_ways(HalfSpaces& spaces, const GroundLift& lift, const Eigen::Vector3d& d,
                   std::array<Way, kMostWays>& ways_out, std::size_t& count_out,
                   Eigen::Vector3d& away_out) {
        LocalHull hull;
        const LocalShape shape = body_.part(lift.part, hull);
        std::size_t count = 0;
        bool has_left = false;
        const auto take_plane = [&](const Eigen::Vector3d& n, double gap) {
            const HalfSpace plane{n, -gap};
            if (dot(n, d) >= plane.depth - 0.01 * kTouch) {
                has_left = true;
                away_out = n;
            }
            if (has_left || !(plane.depth < least_) || count == kMostWays) return;
            Way way{plane, Eigen::Vector3d::Zero(), 0.0};
            spaces.planes[spaces.count++] = plane;
            const bool is_possible = find_shortest(spaces, way.d);
            --spaces.count;
            way.size = length(way.d);
            if (is_possible && way.size < least_) ways_out[count++] = way;
        };
        visit_tops(shape, lift.triangle, take_plane);
        visit_walls(shape, lift.triangle, take_plane);
        count_out = count;
        if (has_left) return true;
        // By insertion: nothing is allocated, and ties keep the order in which they came.
        for (std::size_t i = 1; i < count; ++i) {
            for (std::size_t j = i; j > 0 && ways_out[j].size < ways_out[j - 1].size; --j) {
                std::swap(ways_out[j], ways_out[j - 1]);
            }
        }
        return false;
    }

    const LocalGround& local_;
    const LocalBody& body_;
    Eigen::Vector3d best_;
    double least_;
    int looks_ = 0;
};

}  // namespace

Eigen::Vector3d find_shortest_way(const LocalGround& local, const LocalBody& body,
                                  const Eigen::Vector3d& known) {
    return Search(local, body, known).run();
}

}  // namespace terrane::internal
