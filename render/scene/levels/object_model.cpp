// SPDX-License-Identifier: MIT
#include <terrane/scene/object_model.h>
#include <terrane/terrain/number_text.h>

#include <cmath>
#include <string>

namespace terrane {
namespace {

Result<void> check_level(const ObjectModel& model, std::size_t i) {
    const ObjectLevel& level = model.levels[i];
    const auto refuse = [&](const std::string& message) {
        return fail(ErrorCode::invalid_argument, message + " in level " + number_text(i));
    };
    if (!(level.error_m >= 0.0) || !std::isfinite(level.error_m)) {
        return refuse("error_m must be at least 0 and finite, got " + number_text(level.error_m));
    }
    if (level.triangles == 0) return refuse("triangles must be at least 1, got 0");
    if (level.is_impostor && !model.impostor) return refuse("there is no impostor for it");
    const bool has_next = i + 1 < model.levels.size();
    if (level.morphs && (level.is_impostor || !has_next || model.levels[i + 1].is_impostor))
        return refuse("morphs needs a mesh and another mesh as the next level");
    if (i == 0) return {};
    const ObjectLevel& finer = model.levels[i - 1];
    if (!(level.error_m > 0.0 && level.error_m >= kLeastLevelRatio * finer.error_m)) {
        return refuse("error_m must be above 0 and at least twice the one before, got " +
                      number_text(level.error_m) + " after " + number_text(finer.error_m));
    }
    if (level.triangles >= finer.triangles) {
        return refuse("triangles must decrease, got " + number_text(level.triangles) + " after " +
                      number_text(finer.triangles));
    }
    return {};
}

Result<void> check_continuous(const ObjectModel& model) {
    const std::size_t triangles = model.continuous->step_triangle_counts().front();
    if (model.levels[0].is_impostor || model.levels[0].triangles != triangles) {
        return fail(ErrorCode::invalid_argument,
                    "continuous must have the triangles of the finest level, a mesh, got " +
                        number_text(triangles));
    }
    for (std::size_t i = 1; i < model.levels.size(); ++i) {
        if (model.levels[i].is_impostor || !model.levels[i - 1].is_impostor) continue;
        return fail(ErrorCode::invalid_argument,
                    "with continuous no mesh may come after an impostor, got one in level " +
                        number_text(i));
    }
    return {};
}

}  // namespace

Result<void> check(const ObjectModel& model) {
    const Aabb& box = model.bounds;
    if (!box.low.allFinite() || !box.high.allFinite() ||
        !(box.low.array() <= box.high.array()).all()) {
        return fail(ErrorCode::invalid_argument, "bounds must be finite, low at most high");
    }
    if (model.levels.empty()) {
        return fail(ErrorCode::invalid_argument, "a model must have at least one level, got 0");
    }
    for (std::size_t i = 0; i < model.levels.size(); ++i) {
        if (auto ok = check_level(model, i); !ok) return ok;
    }
    if (model.continuous != nullptr) {
        if (auto ok = check_continuous(model); !ok) return ok;
    }
    const double last = model.levels.back().error_m;
    if (!(model.absence_error_m > 0.0 && model.absence_error_m >= kLeastLevelRatio * last)) {
        return fail(
            ErrorCode::invalid_argument,
            "absence_error_m must be above 0 and at least twice the last level's error, got " +
                number_text(model.absence_error_m));
    }
    return {};
}

}  // namespace terrane
