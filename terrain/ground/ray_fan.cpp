// SPDX-License-Identifier: MIT
#include <terrane/terrain/ground.h>
#include <terrane/terrain/ground_batch.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace terrane::internal {

/// Upper bounds of the slopes from a point to the surrounding ground, by azimuth and distance. They tell up to where a
/// ray from this point certainly lies above the ground.
class HorizonProfile {
public:
    HorizonProfile() : bin_slopes_(kEntries), most_slopes_(kEntries) {}

    /// Bounds the ground around a point.
    ///
    /// @param reach horizontal distance to cover, metres, >= 0; limited to kMostCells cells
    ///
    /// Allocates: nothing
    /// Cost:      O(log reach) rings of several thousand squares: `batch_benchmark`
    void build(const Ground& ground, const WorldPos& origin_world, double reach);

    /// Horizontal distance from the origin, metres, up to which every point in a direction is above the ground by more
    /// than rounding, and all ground is resident; 0 if nothing is known.
    ///
    /// @param direction not necessarily unit
    ///
    /// Cost: O(1)
    double clear_distance(const Eigen::Vector3d& direction) const;

private:
    static constexpr std::int64_t kSectors = 512;
    static constexpr int kOctaves = 11;  // of distances
    static constexpr std::int64_t kBins = 1 + 8 * kOctaves;
    static constexpr std::size_t kEntries = static_cast<std::size_t>(kBins * kSectors);
    static constexpr double kFirstCells = 1.0;  // start of the first octave
    static constexpr double kMostCells = kFirstCells * (1 << kOctaves);

    struct Square;
    static std::int64_t bin_of(double cells);
    static double bin_begin(std::int64_t bin);
    void add(const Square& square);
    void accumulate();

    WorldPos origin_ = WorldPos::Zero();
    double spacing_ = 1.0;
    double rounding_ = 0.0;           // of the coordinates, metres
    double reach_cells_ = 0.0;        // distance covered by the bounds
    std::vector<float> bin_slopes_;   // [kBins][kSectors]
    std::vector<float> most_slopes_;  // [kSectors][kBins] running maximum over bins
};

// Sources:
//   N. Max. Horizon mapping: shadows for bump-mapped surfaces. The Visual Computer 4, 1988. (horizon by azimuth)
//   D. Cohen-Or, A. Shaked. Visibility and Dead-Zones in Digital Terrain Maps. Eurographics 1995. (running maximum of
//   the slope along a ray from the viewpoint)
// Deviations: sectors instead of single azimuths, distance intervals instead of single distances, and squares of the
// pyramid instead of samples, so that the bound holds for every point of the surface. Azimuths are diamond angles, and
// distance intervals are eighths of an octave, taken from the bits of a double: no libm.

namespace {

constexpr float kInfiniteSlope = std::numeric_limits<float>::infinity();
/// Squares of 1 << n cells are used at distances from kRing << n cells to twice that.
constexpr int kRing = 8;
/// Enlargement of squares against rounding of a ray's coordinates, cells.
constexpr double kSlackCells = 0.125;
/// Increases with the angle from x towards y: 0 at x, 1 at y, up to 4.
double diamond_angle(double x, double y) {
    const double share = y / (std::abs(x) + std::abs(y));
    if (x < 0.0) return 2.0 - share;
    return share < 0.0 ? 4.0 + share : share;
}

/// Rounds up by more than the rounding error of any computation here.
float rounded_up(double slope) {
    return static_cast<float>(slope + 1e-6 * (1.0 + std::abs(slope)));
}

}  // namespace

// A square of cells as seen from the origin.
struct HorizonProfile::Square {
    std::int64_t first_sector, last_sector;  // last >= first, modulo kSectors
    double near, far;                        // cells
    double rise;                             // of its highest sample over the origin, cells
};

std::int64_t HorizonProfile::bin_of(double cells) {
    const double ratio = cells / kFirstCells;
    if (!(ratio >= 1.0)) return 0;
    // eighths of an octave: the exponent and three bits
    const auto step = static_cast<std::int64_t>(std::bit_cast<std::uint64_t>(ratio) >> 49);
    return std::min(step - (std::int64_t{1023} << 3) + 1, kBins - 1);
}

double HorizonProfile::bin_begin(std::int64_t bin) {
    if (bin == 0) return 0.0;
    const std::int64_t step = bin - 1;
    return kFirstCells * static_cast<double>(std::int64_t{1} << (step >> 3)) *
           (1.0 + 0.125 * static_cast<double>(step & 7));
}

void HorizonProfile::add(const Square& square) {
    const std::int64_t last = bin_of(square.far);
    for (std::int64_t bin = bin_of(square.near); bin <= last; ++bin) {
        const double from = std::max(square.near, bin_begin(bin));
        const double to = bin + 1 < kBins ? std::min(square.far, bin_begin(bin + 1)) : square.far;
        // at the origin a rise blocks every direction
        const float slope = square.rise < 0.0 ? rounded_up(square.rise / to)
                            : from > 0.0      ? rounded_up(square.rise / from)
                                              : kInfiniteSlope;
        float* const slopes = &bin_slopes_[static_cast<std::size_t>(bin * kSectors)];
        const auto raise = [&](std::int64_t begin, std::int64_t end) {
            for (std::int64_t i = begin; i < end; ++i) slopes[i] = std::max(slopes[i], slope);
        };
        raise(square.first_sector, std::min(square.last_sector + 1, kSectors));
        raise(0, square.last_sector + 1 - kSectors);
    }
}

void HorizonProfile::build(const Ground& ground, const WorldPos& origin_world, double reach) {
    std::fill(bin_slopes_.begin(), bin_slopes_.end(), -kInfiniteSlope);
    origin_ = origin_world;
    spacing_ = ground.spacing();
    reach_cells_ = 0.0;
    rounding_ =
        8.0 * std::numeric_limits<double>::epsilon() * (origin_world.cwiseAbs().maxCoeff() + reach);
    // nothing is known if rounding exceeds the slack, or if the origin is far from the extent
    const WorldRect& extent = ground.extent();
    const double most = kMostCells * spacing_;
    if (!origin_world.allFinite() || !(rounding_ < 0.5 * kSlackCells * spacing_) ||
        !(origin_world.x() > extent.west - most && origin_world.x() < extent.east + most &&
          origin_world.y() > extent.south - most && origin_world.y() < extent.north + most)) {
        return;
    }
    reach_cells_ = std::min(reach / spacing_, kMostCells);

    GroundReader reader(ground);
    const double quantum = ground.lattice().quantum;
    const std::int64_t column = ground.column_at(origin_world.x());
    const std::int64_t row = ground.row_at(origin_world.y());
    // position of the origin in its cell, in cells from the south-western corner
    const double x = (origin_world.x() - ground.cell_x(column)) / spacing_;
    const double y = (origin_world.y() - ground.cell_y(row)) / spacing_;
    for (int level = 0; level <= SamplePyramid::kCoarsest; ++level) {
        const double inner = level == 0 ? 0.0 : static_cast<double>(kRing << level);
        const double outer = std::min(reach_cells_, level < SamplePyramid::kCoarsest
                                                        ? static_cast<double>(kRing << (level + 1))
                                                        : kMostCells);
        if (inner > reach_cells_) break;
        const std::int64_t side = std::int64_t{1} << level;
        const auto span = static_cast<std::int64_t>(outer) + 2 + side;
        for (std::int64_t j = (row - span) & -side; j <= row + span; j += side) {
            for (std::int64_t i = (column - span) & -side; i <= column + span; i += side) {
                // the square relative to the origin, in cells, enlarged
                const double west = static_cast<double>(i - column) - x - kSlackCells;
                const double south = static_cast<double>(j - row) - y - kSlackCells;
                const double east = west + static_cast<double>(side) + 2.0 * kSlackCells;
                const double north = south + static_cast<double>(side) + 2.0 * kSlackCells;
                const double near_x = std::max({0.0, west, -east});
                const double near_y = std::max({0.0, south, -north});
                const double far_x = std::max(-west, east), far_y = std::max(-south, north);
                const double far_squared = far_x * far_x + far_y * far_y;
                const double near_squared = near_x * near_x + near_y * near_y;
                if (far_squared < inner * inner || near_squared > outer * outer) continue;
                const RangeAnswer range = reader.square(i, j, level);
                if (range.status == QueryStatus::outside) continue;
                Square square{.first_sector = 0,
                              .last_sector = kSectors - 1,
                              .near = std::sqrt(near_squared),
                              .far = std::sqrt(far_squared),
                              .rise = std::numeric_limits<double>::infinity()};
                if (range.status == QueryStatus::ok && ground.solid(i, j) == nullptr) {
                    const double high = quantum * static_cast<double>(range.high);
                    square.rise = (high - origin_world.z() + rounding_) / spacing_;
                }
                if (near_squared > 0.0) {
                    // the square spans less than half a turn, so diamond angles of its corners differ by less than 2
                    const double middle = diamond_angle(west + east, south + north);
                    double least = 0.0, greatest = 0.0;
                    for (const double to_x : {west, east}) {
                        for (const double to_y : {south, north}) {
                            double turn = diamond_angle(to_x, to_y) - middle;
                            turn += turn > 2.0 ? -4.0 : turn < -2.0 ? 4.0 : 0.0;
                            least = std::min(least, turn);
                            greatest = std::max(greatest, turn);
                        }
                    }
                    constexpr double kPerAngle = kSectors / 4.0;
                    const double first = std::floor((middle + least) * kPerAngle - 1e-6);
                    const double last = std::floor((middle + greatest) * kPerAngle + 1e-6);
                    const auto begin = static_cast<std::int64_t>(first) & (kSectors - 1);
                    square.first_sector = begin;
                    square.last_sector = begin + static_cast<std::int64_t>(last - first);
                }
                add(square);
            }
        }
    }
    accumulate();
}

void HorizonProfile::accumulate() {
    for (std::int64_t sector = 0; sector < kSectors; ++sector) {
        float most = -kInfiniteSlope;
        for (std::int64_t bin = 0; bin < kBins; ++bin) {
            most = std::max(most, bin_slopes_[static_cast<std::size_t>(bin * kSectors + sector)]);
            most_slopes_[static_cast<std::size_t>(sector * kBins + bin)] = most;
        }
    }
}

double HorizonProfile::clear_distance(const Eigen::Vector3d& direction) const {
    const double length = std::sqrt(direction.x() * direction.x() + direction.y() * direction.y());
    if (!(reach_cells_ > 0.0) || !(length > 0.0)) return 0.0;
    const double slope = direction.z() / length;
    if (!(std::abs(slope) < 1e6)) return 0.0;
    constexpr double kPerAngle = kSectors / 4.0;
    const auto sector =
        static_cast<std::int64_t>(diamond_angle(direction.x(), direction.y()) * kPerAngle) &
        (kSectors - 1);
    const float* const first = &most_slopes_[static_cast<std::size_t>(sector * kBins)];
    const auto below = -rounded_up(-slope);
    const std::int64_t bin = std::lower_bound(first, first + kBins, below) - first;
    const double cells = bin == kBins ? kMostCells : bin_begin(bin);
    return spacing_ * std::min(cells, reach_cells_);
}

}  // namespace terrane::internal

namespace terrane {

struct RayFan::State {
    const Ground* ground = nullptr;
    WorldPos origin_world = WorldPos::Zero();
    internal::HorizonProfile horizon;
};

RayFan::RayFan() : state_(std::make_unique<State>()) {}
RayFan::RayFan(RayFan&&) noexcept = default;
RayFan& RayFan::operator=(RayFan&&) noexcept = default;
RayFan::~RayFan() = default;

void RayFan::reset(const Ground& ground, const WorldPos& origin_world, double reach) {
    state_->ground = &ground;
    state_->origin_world = origin_world;
    state_->horizon.build(ground, origin_world, std::max(0.0, reach));
}

const Ground* RayFan::ground() const { return state_->ground; }

RayAnswer RayFan::ray(const WorldPos& from_world, const WorldPos& to_world) const {
    if (state_->ground == nullptr) return {};
    const Ground& ground = *state_->ground;
    const Eigen::Vector3d displacement = to_world - from_world;
    // A hit is bit-identical if the walk starts in a cell before the cell that is hit, so it starts a cell's diagonal
    // earlier. The walk of a ray nearly parallel to the lines starts at the ray's start, because rounding at a later
    // start might select the neighbouring column.
    constexpr double kSlowest = 1e-6, kEarlierCells = 1.5;
    const double spacing = ground.spacing();
    const auto is_slow = [&](double d) { return d != 0.0 && std::abs(d) < kSlowest * spacing; };
    const double length =
        std::sqrt(displacement.x() * displacement.x() + displacement.y() * displacement.y());
    if (!(length > 0.0) || is_slow(displacement.x()) || is_slow(displacement.y()))
        return ground.ray(from_world, to_world);
    const Eigen::Vector3d to_from = from_world - state_->origin_world;
    const double passed = std::sqrt(to_from.x() * to_from.x() + to_from.y() * to_from.y());
    const double clear =
        state_->horizon.clear_distance(to_world - state_->origin_world) - kEarlierCells * spacing;
    return ground.ray_after((clear - passed) / length, from_world, to_world);
}

}  // namespace terrane
