// SPDX-License-Identifier: MIT
#include "support/input.h"

#include "support/grounds.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <vector>

namespace terrane::fuzz {
namespace {

constexpr std::uint8_t kAnyBits = 255;  // first byte of a number that is given by its bits

}  // namespace

std::uint8_t Input::byte() {
    if (bytes_.empty()) return 0;
    const std::uint8_t first = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return first;
}

std::uint64_t Input::bits(int width) {
    std::uint64_t value = 0;
    for (int i = 0; i < width; ++i) value |= std::uint64_t{byte()} << (8 * i);
    return value;
}

double Input::between(double low, double high) {
    return low + (high - low) * (static_cast<double>(bits(2)) / 65535.0);
}

double Input::number(double low, double high) {
    if (bytes_.empty() || bytes_.front() != kAnyBits) return between(low, high);
    byte();
    return std::bit_cast<double>(bits(8));
}

Eigen::Vector3d Input::vector(double low, double high) {
    Eigen::Vector3d v;
    for (int axis = 0; axis < 3; ++axis) v[axis] = number(low, high);
    return v;
}

Eigen::Matrix3d Input::rotation() {
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
    const int kind = below(8);
    if (kind == 0) return matrix;
    if (kind == 7) {
        for (int column = 0; column < 3; ++column) matrix.col(column) = vector(-1.0, 1.0);
        return matrix;
    }
    double q[4];
    double square = 0.0;
    for (double& component : q) {
        component = static_cast<double>(static_cast<std::int8_t>(byte()));
        square += component * component;
    }
    if (square == 0.0) return matrix;
    const double s = 2.0 / square;
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    matrix << 1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),
        s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x), s * (x * z - w * y),
        s * (y * z + w * x), 1.0 - s * (x * x + y * y);
    return matrix;
}

std::span<const std::uint8_t> Input::bytes(std::size_t most) {
    const std::size_t count = std::min(most, bytes_.size());
    const std::span<const std::uint8_t> taken = bytes_.first(count);
    bytes_ = bytes_.subspan(count);
    return taken;
}

std::string_view Input::rest_as_text() {
    const std::span<const std::uint8_t> left = rest();
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes as characters
    return {reinterpret_cast<const char*>(left.data()), left.size()};
}

std::vector<std::string_view> Input::rest_as_lines(std::size_t most) {
    std::vector<std::string_view> lines;
    for (std::string_view text = rest_as_text(); !text.empty() && lines.size() < most;) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        lines.push_back(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return lines;
}

namespace {

constexpr double kMostSize = 8.0;
constexpr int kGrounds = 6;

using HeightFunction = std::function<double(double x, double y)>;

ConvexHull take_hull(Input& input) {
    std::vector<Eigen::Vector3d> points(static_cast<std::size_t>(1 + input.below(12)));
    for (Eigen::Vector3d& point : points) point = input.vector(-kMostSize, kMostSize);
    const Result<ConvexHull> hull = ConvexHull::create(points);
    if (hull) return *hull;
    return ConvexHull::create(std::vector<Eigen::Vector3d>{{0.0, 0.0, 0.0}}).value();
}

ConvexShape take_convex(Input& input, int kind) {
    switch (kind) {
        case 0:
            return Sphere{input.number(0.0, kMostSize)};
        case 1: {
            Capsule capsule;
            capsule.radius = input.number(0.0, kMostSize);
            capsule.half_height = input.number(0.0, kMostSize);
            return capsule;
        }
        case 2:
            return Box{input.vector(0.0, kMostSize)};
        default:
            return take_hull(input);
    }
}

/// A height of a lattice point from 0 to 1 that looks random.
double noise(double x, double y) {
    const double wave = 43'758.547 * (0.129898 * x + 0.78233 * y + 0.0371 * x * y);
    return wave - std::floor(wave);
}

bool every(double x, double cells) { return std::fmod(x, cells) == 0.0; }

std::vector<Ground> make_grounds() {
    const std::array<HeightFunction, kGrounds> heights{
        [](double x, double y) { return 0.25 * x - 0.5 * y; },
        [](double x, double) { return std::floor(x / 4.0) * 0.5; },
        [](double x, double y) { return every(x, 5.0) && every(y, 5.0) ? 3.0 : 0.0; },
        [](double x, double) { return every(x, 8.0) ? 5.0 : 0.0; },
        [](double x, double y) { return every(x, 6.0) && every(y, 6.0) ? -4.0 : 0.0; },
        [](double x, double y) { return noise(x, y); }};
    std::vector<Ground> grounds;
    for (const HeightFunction& height : heights) {
        grounds.push_back(test::make_test_ground(height, 1.0, 1));
    }
    return grounds;
}

}  // namespace

Shape take_shape(Input& input) {
    const int kind = input.below(5);
    if (kind < 4) {
        return std::visit([](auto&& shape) -> Shape { return shape; }, take_convex(input, kind));
    }
    std::vector<CompoundPart> parts;
    for (int count = 1 + input.below(4); count > 0; --count) {
        const ConvexShape shape = take_convex(input, input.below(4));
        parts.push_back({shape, take_pose(input, -kMostSize, kMostSize)});
    }
    const Result<Compound> compound = Compound::create(parts);
    if (compound) return *compound;
    return Sphere{};
}

Shape take_simple_shape(Input& input) {
    constexpr double kLeast = 0.05, kMost = 4.0;
    const int kind = input.below(3);
    if (kind == 0) return Sphere{input.between(kLeast, kMost)};
    const double a = input.between(kLeast, kMost), b = input.between(kLeast, kMost);
    if (kind == 1) return Capsule{a, b};
    return Box{{a, b, input.between(kLeast, kMost)}};
}

Pose take_pose(Input& input, double low, double high) {
    Pose pose;
    pose.rotation = input.rotation();
    pose.translation = input.vector(low, high);
    return pose;
}

Motion take_motion(Input& input, double low, double high, double reach) {
    constexpr double kMostTurn = 4.0;  // radians an axis
    Motion motion;
    motion.start = take_pose(input, low, high);
    motion.translation = input.vector(-reach, reach);
    motion.rotation_vector = input.vector(-kMostTurn, kMostTurn);
    return motion;
}

const Ground& take_ground(Input& input) {
    static const std::vector<Ground> grounds = make_grounds();
    return grounds[static_cast<std::size_t>(input.below(kGrounds))];
}

std::shared_ptr<const HeightSource> make_square(double amplitude, int spacing_log2) {
    return FractalHeights::create({.seed = 7,
                                   .octave_count = 4,
                                   .amplitude = amplitude,
                                   .finest_spacing_log2 = spacing_log2,
                                   .root_size_log2 = spacing_log2 + 7,
                                   .first_root_x = 0,
                                   .first_root_y = 0,
                                   .root_count_x = 1,
                                   .root_count_y = 1})
        .value();
}

bool is_unit(const Eigen::Vector3d& v) { return std::abs(v.norm() - 1.0) <= 1e-6; }

namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 20;  // repeats could double without end

using Bytes = std::vector<std::uint8_t>;
using Offset = Bytes::difference_type;

void apply(Bytes& file, Input& input) {
    const int kind = input.below(6);
    const std::size_t at = static_cast<std::size_t>(input.bits(2)) % (file.size() + 1);
    const auto place = file.begin() + static_cast<Offset>(at);
    if (kind == 5) {
        file.resize(at);
        return;
    }
    const std::size_t length = input.byte();
    const std::size_t in_file = std::min(length, file.size() - at);
    const auto end = place + static_cast<Offset>(in_file);
    if (kind == 3) {
        file.erase(place, end);
    } else if (kind == 4) {
        const Bytes range(place, end);
        file.insert(end, range.begin(), range.end());
    } else if (kind == 2) {
        const auto bytes = input.bytes(length);
        file.insert(place, bytes.begin(), bytes.end());
    } else {
        const auto bytes = input.bytes(in_file);
        std::ranges::copy(bytes, place);
    }
}

}  // namespace

std::vector<std::uint8_t> patched(std::vector<std::uint8_t> file, Input& input) {
    while (!input.is_empty() && file.size() < kMostBytes) apply(file, input);
    return file;
}

ScratchFolder::ScratchFolder()
    : path_((std::filesystem::temp_directory_path() / ("terrane_fuzz_" + std::to_string(getpid())))
                .string()) {
    std::error_code error;
    std::filesystem::create_directories(path_, error);
    require(!error, "a folder for files: " + path_);
}

ScratchFolder::~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

std::string ScratchFolder::write(const std::string& name,
                                 std::span<const std::uint8_t> bytes) const {
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes as characters
    return write(name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

std::string ScratchFolder::write(const std::string& name, std::string_view text) const {
    std::string path = path_ + "/" + name;
    std::ofstream file(path, std::ios::binary);
    file.write(text.data(), static_cast<std::streamsize>(text.size()));
    file.close();
    require(file.good(), "a file for the input: " + path);
    return path;
}

}  // namespace terrane::fuzz
