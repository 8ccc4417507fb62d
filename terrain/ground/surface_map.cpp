// SPDX-License-Identifier: MIT
#include "base/settings_check.h"

#include <terrane/terrain/assert.h>
#include <terrane/terrain/surface.h>

#include <cmath>
#include <utility>

namespace terrane {
namespace {

constexpr double kMostFriction = 1e6;

// False for NaN.
bool is_in_range(const SurfaceProperties& properties) {
    return properties.friction >= 0.0 && properties.friction <= kMostFriction &&
           properties.restitution >= 0.0 && properties.restitution <= 1.0;
}

class FunctionMap final : public SurfaceMap {
public:
    FunctionMap(std::function<SurfaceProperties(double, double)> function,
                const SurfaceProperties& defaults)
        : SurfaceMap(defaults), function_(std::move(function)) {}

private:
    SurfaceProperties properties(double x, double y) const override { return function_(x, y); }

    std::function<SurfaceProperties(double, double)> function_;
};

}  // namespace

Result<void> check(const SurfaceProperties& properties) {
    if (auto ok = check_range("friction", properties.friction, 0.0, kMostFriction); !ok) return ok;
    return check_range("restitution", properties.restitution, 0.0, 1.0);
}

SurfaceMap::SurfaceMap(const SurfaceProperties& defaults) : defaults_(defaults) {
    TERRANE_ASSERT(is_in_range(defaults_), "the defaults of a surface map must be in range");
}

SurfaceProperties SurfaceMap::at(double x, double y) const noexcept {
    if (!std::isfinite(x) || !std::isfinite(y)) return defaults_;
    try {
        const SurfaceProperties found = properties(x, y);
        if (is_in_range(found)) return found;
    } catch (...) {
        // counted below
    }
    fault_count_.fetch_add(1, std::memory_order_relaxed);
    return defaults_;
}

Result<std::shared_ptr<const SurfaceMap>> SurfaceMap::from_function(
    std::function<SurfaceProperties(double x, double y)> function,
    const SurfaceProperties& defaults) {
    if (!function) {
        return fail(ErrorCode::invalid_argument,
                    "function must be one that can be called, got an empty one");
    }
    if (auto ok = check(defaults); !ok) {
        return fail(ok.error().code, "defaults." + ok.error().message);
    }
    return std::make_shared<const FunctionMap>(std::move(function), defaults);
}

}  // namespace terrane
