// SPDX-License-Identifier: MIT
#include "query/object_picker.h"

#include "scene/scene_objects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <tuple>
#include <utility>

namespace terrane::tools {
namespace {

// Number of halvings: ends are accurate to 1/256 of the segment within the extent.
constexpr int kHalvings = 8;

/// Finds the ends of the part of a segment near the surface, by bisection.
class NearSearch {
public:
    NearSearch(const WorldPos& from_world, const WorldPos& displacement, const HeightSource& source,
               double margin)
        : from_(from_world), displacement_(displacement), source_(source), margin_(margin) {}

    /// Start of the first part that may be near the surface.
    std::optional<double> first(double begin, double end, int halvings = kHalvings) const {
        if (!may_be_near(begin, end)) return std::nullopt;
        if (halvings == 0) return begin;
        const double middle = 0.5 * (begin + end);
        const std::optional<double> found = first(begin, middle, halvings - 1);
        return found ? found : first(middle, end, halvings - 1);
    }

    /// End of the last part that may be near the surface.
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

namespace {

// Cached squares are dropped beyond this number of objects: 2^20 take about 50 MB.
constexpr std::size_t kMostKeptPoints = std::size_t{1} << 20;
// Relative margin, larger than the rounding errors of positions and radii.
constexpr double kReachSlack = 1e-9;

double radius_of(const TriangleMesh& mesh) {
    double most = 0.0;
    for (const Eigen::Vector3d& p : mesh.positions) most = std::max(most, p.norm());
    return most;
}

auto order_of(const PickedObject& picked) {
    const ScatterSquare square = picked.square.value_or(ScatterSquare());
    return std::tuple(picked.fraction, picked.entry, square.y, square.x, picked.index);
}

}  // namespace

/// One segment, with the first object hit so far.
class ObjectPicker::Search {
public:
    Search(const WorldPos& from_world, const WorldPos& to_world, double limit)
        : from_(from_world), displacement_(to_world - from_world), limit_(limit) {}

    /// Records the object if the segment hits it before all objects visited so far.
    void visit(const MeshRays& rays, const Pose& world_from_object, PickedObject object) {
        const Eigen::Matrix3d object_from_world =
            world_from_object.rotation.transpose() / object.scale;
        const Eigen::Vector3d start =
            object_from_world * Eigen::Vector3d(from_ - world_from_object.translation);
        const std::optional<MeshHit> hit =
            rays.ray(start, start + object_from_world * displacement_);
        if (!hit || hit->fraction > limit_) return;
        object.fraction = hit->fraction;
        if (first_ && !(order_of(object) < order_of(*first_))) return;
        object.position_world = world_from_object.translation;
        object.point_world = at(hit->fraction);
        object.normal = world_from_object.rotation * hit->normal;
        object.triangle = hit->triangle;
        first_ = object;
    }

    WorldPos at(double fraction) const { return from_ + fraction * displacement_; }
    /// Fraction beyond which no object is the answer.
    double limit() const { return first_ ? first_->fraction : limit_; }
    const std::optional<PickedObject>& first() const { return first_; }

private:
    WorldPos from_, displacement_;
    double limit_;
    std::optional<PickedObject> first_;
};

Result<ObjectPicker> ObjectPicker::create(std::shared_ptr<const HeightSource> source,
                                          const SceneObjects& objects) {
    ObjectPicker made(source);
    std::vector<double> radii;
    const auto about = [&](std::size_t mesh, const Error& error) {
        return fail(error.code, objects.files[mesh] + ": " + error.message);
    };
    for (std::size_t i = 0; i < objects.meshes.size(); ++i) {
        Result<MeshRays> rays = MeshRays::create(objects.meshes[i]);
        if (!rays) return about(i, rays.error());
        made.meshes_.push_back(*std::move(rays));
        radii.push_back(radius_of(objects.meshes[i]));
    }
    for (const SceneObject& object : objects.objects) {
        made.placed_.push_back({object.entry, object.mesh, object.world_from_object, object.scale});
    }
    for (const SceneScatter& wanted : objects.scatters) {
        Result<Scatter> scatter = Scatter::create(source, wanted.settings);
        if (!scatter) return about(wanted.mesh, scatter.error());
        made.scattered_.push_back(
            {.entry = wanted.entry,
             .mesh = wanted.mesh,
             .scatter = *std::move(scatter),
             .reach = radii[wanted.mesh] * wanted.settings.max_scale * (1.0 + kReachSlack) +
                      source->lattice().quantum});
    }
    return made;
}

Result<std::optional<PickedObject>> ObjectPicker::ray(const WorldPos& from_world,
                                                      const WorldPos& to_world, double limit) {
    Search search(from_world, to_world, limit);
    for (const Placed& placed : placed_) {
        PickedObject object;
        object.entry = placed.entry;
        object.mesh = placed.mesh;
        object.scale = placed.scale;
        search.visit(meshes_[placed.mesh], placed.world_from_object, object);
    }
    for (Scattered& scattered : scattered_) {
        TERRANE_TRY(search_scatter(scattered, search));
    }
    return search.first();
}

// Visits the squares near the segment, up to the first hit. The segment is divided into pieces as long as a square's
// side: an object that a piece hits has its origin within `reach` of the piece.
Result<void> ObjectPicker::search_scatter(Scattered& scattered, Search& search) {
    const WorldPos from = search.at(0.0), to = search.at(search.limit());
    // objects stand on triangles, whose corners are at most a cell away
    const double margin = scattered.reach + source_->lattice().spacing;
    const std::optional<SegmentPart> part = near_ground(from, to, *source_, margin);
    if (!part) return {};
    const double begin = part->begin * search.limit(), end = part->end * search.limit();
    const WorldPos way = search.at(end) - search.at(begin);
    const double length = std::sqrt(way.x() * way.x() + way.y() * way.y());
    const double piece_count = std::max(1.0, std::ceil(length / scattered.scatter.square_side()));
    const double share = (end - begin) / piece_count;
    std::set<ScatterSquare> seen;
    for (std::size_t i = 0; i < static_cast<std::size_t>(piece_count); ++i) {
        const double piece_begin = begin + share * static_cast<double>(i);
        if (piece_begin > search.limit()) break;
        const std::optional<ScatterRange> range = scattered.scatter.squares_within(
            search.at(piece_begin + 0.5 * share), 0.5 * length / piece_count + margin);
        if (!range) continue;
        for (std::int32_t y = range->low.y; y <= range->high.y; ++y) {
            for (std::int32_t x = range->low.x; x <= range->high.x; ++x) {
                const ScatterSquare square = {x, y};
                if (!seen.insert(square).second) continue;
                TERRANE_TRY(const auto points, points_of(scattered, square));
                for (std::size_t index = 0; index < points->size(); ++index) {
                    const ScatterPoint& point = (*points)[index];
                    PickedObject object;
                    object.entry = scattered.entry;
                    object.mesh = scattered.mesh;
                    object.square = square;
                    object.index = index;
                    object.scale = point.scale;
                    search.visit(meshes_[scattered.mesh], pose_of(point), object);
                }
            }
        }
    }
    return {};
}

Result<const std::vector<ScatterPoint>*> ObjectPicker::points_of(Scattered& scattered,
                                                                 const ScatterSquare& square) {
    const auto known = scattered.squares.find(square);
    if (known != scattered.squares.end()) return &known->second;
    TERRANE_TRY(std::vector<ScatterPoint> points, scattered.scatter.objects_in(square));
    if (kept_points_ > kMostKeptPoints) {
        for (Scattered& each : scattered_) each.squares.clear();
        kept_points_ = 0;
    }
    // plus one for the square itself
    kept_points_ += points.size() + 1;
    return &scattered.squares.emplace(square, std::move(points)).first->second;
}

}  // namespace terrane::tools
