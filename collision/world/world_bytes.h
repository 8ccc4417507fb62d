// SPDX-License-Identifier: MIT
#pragma once

#include "base/vector_math.h"

#include <terrane/base/math.h>
#include <terrane/base/text.h>
#include <terrane/collision/body.h>
#include <terrane/collision/query.h>
#include <terrane/collision/shapes.h>
#include <terrane/collision/vehicle.h>

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

// Serialisation of worlds: little-endian fields of fixed width without padding. Writer and reader have the same
// interface, so that one list of fields serves both directions; names and ranges are for the reader.
namespace terrane::internal {

/// Valid ranges of values computed by steps. Steps enforce no such limits: these are far above values that occur and
/// far below overflow.
inline constexpr double kMostStoredLength = 1e15;   // metres
inline constexpr double kMostStoredSpeed = 1e12;    // m/s, m/s^2
inline constexpr double kMostStoredSpin = 1e15;     // rad/s
inline constexpr double kMostStoredImpulse = 1e24;  // N s
inline constexpr double kStoredUnitSlack = 1e-6;    // deviation of unit vectors and rotations

/// Appends fields to bytes.
class FieldWriter {
public:
    static constexpr bool kReads = false;

    void word(const char*, std::uint32_t value) { put(value, 4); }
    void integer(const char*, std::uint32_t value, std::uint32_t /*most*/) { put(value, 4); }
    void flag(const char*, bool value) { put(value ? 1 : 0, 1); }
    template <class Enum>
    void choice(const char*, Enum value, Enum /*last*/) {
        put(static_cast<std::uint64_t>(value), 1);
    }
    void number(const char*, double value, double /*low*/, double /*high*/) {
        put(std::bit_cast<std::uint64_t>(value), 8);
    }
    void vector(const char*, const Eigen::Vector3d& value, double /*limit*/) {
        for (int axis = 0; axis < 3; ++axis) put(std::bit_cast<std::uint64_t>(value[axis]), 8);
    }
    void length(const char*, double value) { number("", value, 0.0, 0.0); }
    void place(const char*, const Eigen::Vector3d& value) { vector("", value, 0.0); }
    void impulse(const char*, const Eigen::Vector3d& value) { vector("", value, 0.0); }
    void unit(const char*, const Eigen::Vector3d& value) { vector("", value, 0.0); }
    void feature(const ShapeFeature& value) {
        put(value.first, 4);
        put(value.second, 4);
    }
    void pose(const char*, const Pose& value) {
        for (int column = 0; column < 3; ++column) vector("", value.rotation.col(column), 0.0);
        vector("", value.translation, 0.0);
    }
    /// Writes the number of elements, then calls write_each(element).
    void list(const char*, const auto& values, std::size_t /*least_bytes*/, auto write_each) {
        put(values.size(), 4);
        for (const auto& value : values) write_each(value);
    }

    std::vector<std::byte>& bytes() { return bytes_; }
    void put(std::uint64_t value, int width) {
        for (int i = 0; i < width; ++i) bytes_.push_back(std::byte(value >> (8 * i) & 0xff));
    }

private:
    std::vector<std::byte> bytes_;
};

/// Reads fields from bytes. A field out of range or beyond the end is an error. After the first error, numbers read as
/// 0 and lists as empty.
class FieldReader {
public:
    static constexpr bool kReads = true;

    explicit FieldReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

    /// Sets the owner of the next fields, which error messages name; null for the world.
    void begin(const char* thing, std::size_t index) {
        thing_ = thing;
        index_ = index;
    }

    void word(const char* name, std::uint32_t& value) {
        value = static_cast<std::uint32_t>(get(name, 4));
    }
    /// @param most largest valid value
    void integer(const char* name, std::uint32_t& value, std::uint32_t most) {
        word(name, value);
        if (value <= most) return;
        fail(name, "must be 0 to " + std::to_string(most) + ", got " + std::to_string(value));
        value = 0;
    }
    void flag(const char* name, bool& value) {
        const std::uint64_t read = get(name, 1);
        if (read > 1) fail(name, "must be 0 or 1, got " + std::to_string(read));
        value = read == 1;
    }
    /// @param last the largest enumerator
    template <class Enum>
    void choice(const char* name, Enum& value, Enum last) {
        const std::uint64_t read = get(name, 1);
        if (read > static_cast<std::uint64_t>(last)) {
            fail(name, "must be 0 to " + std::to_string(static_cast<int>(last)) + ", got " +
                           std::to_string(read));
            return;
        }
        value = static_cast<Enum>(read);
    }
    void number(const char* name, double& value, double low, double high) {
        value = std::bit_cast<double>(get(name, 8));
        if (value >= low && value <= high) return;  // false for NaN
        fail(name, "must be " + number_text(low) + " to " + number_text(high) + ", got " +
                       number_text(value));
        value = low;
    }
    /// @param limit of the absolute value of each component
    void vector(const char* name, Eigen::Vector3d& value, double limit) {
        for (int axis = 0; axis < 3; ++axis) number(name, value[axis], -limit, limit);
    }
    void length(const char* name, double& value) {
        number(name, value, -kMostStoredLength, kMostStoredLength);
    }
    void place(const char* name, Eigen::Vector3d& value) { vector(name, value, kMostStoredLength); }
    void impulse(const char* name, Eigen::Vector3d& value) {
        vector(name, value, kMostStoredImpulse);
    }
    void unit(const char* name, Eigen::Vector3d& value) {
        vector(name, value, 1.0 + kStoredUnitSlack);
        if (std::abs(dot(value, value) - 1.0) <= kStoredUnitSlack) return;
        fail(name, "must have length 1, got " + number_text(internal::length(value)));
    }
    void feature(ShapeFeature& value) {
        word("feature", value.first);
        word("feature", value.second);
    }
    void pose(const char* name, Pose& value) {
        for (int column = 0; column < 3; ++column) {
            Eigen::Vector3d axis;
            vector(name, axis, 1.0 + kStoredUnitSlack);
            value.rotation.col(column) = axis;
        }
        if (!(column_error(value.rotation) <= kStoredUnitSlack &&
              determinant(value.rotation) > 0.0)) {
            fail(name, "must have an orthonormal rotation of determinant 1");
        }
        place(name, value.translation);
    }
    /// @param least_bytes smallest size of an element, to check the count against the remaining bytes
    void list(const char* name, auto& values, std::size_t least_bytes, auto read_each) {
        const std::uint64_t count = get(name, 4);
        if (count > bytes_.size() / least_bytes) {
            fail(name, "are " + std::to_string(count) + ", more than the bytes that are left");
            return;
        }
        values.resize(static_cast<std::size_t>(count));
        for (auto& value : values) {
            if (has_failed()) return;
            read_each(value);
        }
    }

    bool has_failed() const { return !error_.empty(); }
    /// Message of the first error; empty if there is none.
    const std::string& error() const { return error_; }
    std::size_t bytes_left() const { return bytes_.size(); }
    /// Records an error, unless there was an earlier one.
    void fail(const char* name, const std::string& what) {
        if (has_failed()) return;
        error_ = std::string("saved world: ") + name;
        if (thing_ != nullptr)
            error_ += std::string(" of ") + thing_ + ' ' + std::to_string(index_);
        error_ += ' ' + what;
    }
    std::uint64_t get(const char* name, std::size_t width) {
        if (has_failed()) return 0;
        if (bytes_.size() < width) {
            fail(name, "is beyond the end");
            return 0;
        }
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < width; ++i) {
            value |= std::to_integer<std::uint64_t>(bytes_[i]) << (8 * i);
        }
        bytes_ = bytes_.subspan(width);
        return value;
    }

private:
    std::span<const std::byte> bytes_;
    const char* thing_ = nullptr;
    std::size_t index_ = 0;
    std::string error_;
};

/// Hash of bytes: FNV-1a (G. Fowler, L. C. Noll, K.-P. Vo).
inline std::uint64_t checksum_of(std::span<const std::byte> bytes) {
    std::uint64_t hash = 0xcbf29ce484222325u;
    for (const std::byte byte : bytes) {
        hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001b3u;
    }
    return hash;
}

// Settings of vehicles and characters. Fields that BodySettings also has are stored only there. check_vehicle() and
// check_character() check the ranges.

/// Additional role of a body.
enum class BodyRole : std::uint8_t { plain, vehicle, character };

template <class Stream>
void list_axle(Stream& stream, auto& axle) {
    stream.length("axle position", axle.position);
    stream.length("track", axle.track);
    stream.length("max_steer", axle.max_steer);
    stream.flag("is_driven", axle.is_driven);
    stream.length("anti_roll", axle.anti_roll);
}

/// Serialises all settings except the shapes, which are the first parts of the compound of the chassis.
template <class Stream>
void list_vehicle_settings(Stream& stream, auto& settings) {
    constexpr std::size_t kAxleBytes = 33;
    stream.list("axles", settings.axles, kAxleBytes,
                [&stream](auto& axle) { list_axle(stream, axle); });
    for (auto* value :
         {&settings.centre_of_mass_height, &settings.wheel_radius, &settings.suspension_travel,
          &settings.suspension_hertz, &settings.damping_ratio, &settings.tyre_friction,
          &settings.side_grip, &settings.max_drive_force, &settings.max_drive_power,
          &settings.max_brake_force, &settings.rolling_resistance, &settings.drag_area}) {
        stream.length("vehicle setting", *value);
    }
    stream.flag("is_tracked", settings.is_tracked);
}

template <class Stream>
void list_character_settings(Stream& stream, auto& settings) {
    for (auto* value : {&settings.max_slope, &settings.max_step, &settings.strength,
                        &settings.air_acceleration}) {
        stream.length("character setting", *value);
    }
}

// Shapes. Hulls are stored as vertices and compounds as parts, from which create() recreates identical bits. Data that
// several shapes share is written once.

/// Writes shapes, and tracks the hulls and compounds already written.
class ShapeWriter {
public:
    explicit ShapeWriter(FieldWriter& out) : out_(out) {}

    void write(const Shape& shape);

private:
    void write_shape(const Sphere& sphere);
    void write_shape(const Capsule& capsule);
    void write_shape(const Box& box);
    void write_shape(const ConvexHull& hull);
    void write_shape(const Compound& compound);
    using Indices = std::unordered_map<const void*, std::uint32_t>;
    bool write_index(Indices& known, const void* data);

    FieldWriter& out_;
    Indices hulls_, compounds_;  // of shared data, in writing order
};

/// Reads the output of a ShapeWriter.
class ShapeReader {
public:
    explicit ShapeReader(FieldReader& in) : in_(in) {}

    /// Reads a shape; a sphere on failure.
    Shape read();

private:
    template <class AnyShape>
    AnyShape read_kind(std::uint32_t last_kind);
    ConvexHull read_hull();
    Compound read_compound();

    FieldReader& in_;
    std::vector<ConvexHull> hulls_;
    std::vector<Compound> compounds_;
};

}  // namespace terrane::internal
