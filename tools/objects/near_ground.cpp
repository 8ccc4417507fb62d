// SPDX-License-Identifier: MIT
#include "objects/near_ground.h"

#include <algorithm>
#include <array>

namespace terrane::tools {
namespace {

// A part is halved so often: the ends are good to 1/256 of the segment within the extent.
constexpr int kHalvings = 8;

/// Halves a segment where the surface may be near.
class NearSearch {
public:
    NearSearch(const WorldPos& from_world, const WorldPos& displacement, const HeightSource& source,
               double margin)
        : from_(from_world), displacement_(displacement), source_(source), margin_(margin) {}

    /// Where the first part with such a point begins.
    std::optional<double> first(double begin, double end, int halvings = kHalvings) const {
        if (!may_be_near(begin, end)) return std::nullopt;
        if (halvings == 0) return begin;
        const double middle = 0.5 * (begin + end);
        const std::optional<double> found = first(begin, middle, halvings - 1);
        return found ? found : first(middle, end, halvings - 1);
    }

    /// Where the last part with such a point ends.
    std::optional<double> last(double begin, double end, int halvings = kHalvings) const {
        if (!may_be_near(begin, end)) return std::nullopt;
        if (halvings == 0) return end;
        const double middle = 0.5 * (begin + end);
        const std::optional<double> found = last(middle, end, halvings - 1);
        return found ? found : last(begin, middle, halvings - 1);
    }

private:
    bool may_be_near(double begin, double end) const {
        const WorldPos a = from_ + begin * displacement_, b = from_ + end * displacement_;
        const HeightInterval heights =
            source_.interval({std::min(a.x(), b.x()) - margin_, std::min(a.y(), b.y()) - margin_,
                              std::max(a.x(), b.x()) + margin_, std::max(a.y(), b.y()) + margin_});
        return !(std::min(a.z(), b.z()) > heights.high + margin_ ||
                 std::max(a.z(), b.z()) < heights.low - margin_);
    }

    WorldPos from_, displacement_;
    const HeightSource& source_;
    double margin_;
};

}  // namespace

std::optional<SegmentPart> near_ground(const WorldPos& from_world, const WorldPos& to_world,
                                       const HeightSource& source, double margin) {
    const WorldRect& extent = source.extent();
    const std::array low{extent.west - margin, extent.south - margin};
    const std::array high{extent.east + margin, extent.north + margin};
    const WorldPos displacement = to_world - from_world;
    SegmentPart part;
    for (const int axis : {0, 1}) {
        const auto a = static_cast<std::size_t>(axis);
        if (displacement[axis] == 0.0) {
            if (from_world[axis] < low[a] || from_world[axis] > high[a]) return std::nullopt;
            continue;
        }
        const double t0 = (low[a] - from_world[axis]) / displacement[axis];
        const double t1 = (high[a] - from_world[axis]) / displacement[axis];
        part.begin = std::max(part.begin, std::min(t0, t1));
        part.end = std::min(part.end, std::max(t0, t1));
    }
    if (!(part.begin <= part.end)) return std::nullopt;
    const NearSearch search(from_world, displacement, source, margin);
    const std::optional<double> first = search.first(part.begin, part.end);
    if (!first) return std::nullopt;
    return SegmentPart{*first, search.last(*first, part.end).value_or(part.end)};
}

}  // namespace terrane::tools
