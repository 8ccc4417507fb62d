// SPDX-License-Identifier: MIT
#include "source/compose/polygon_distance.h"

#include <terrane/terrain/number_text.h>
#include <terrane/terrain/painted_surface.h>

#include <utility>
#include <vector>

namespace terrane {
namespace {

class PaintedMap final : public SurfaceMap {
public:
    PaintedMap(std::shared_ptr<const SurfaceMap> under, std::span<const SurfaceArea> areas)
        : SurfaceMap(under != nullptr ? under->defaults() : SurfaceProperties{}),
          under_(std::move(under)) {
        for (const SurfaceArea& area : areas) {
            areas_.push_back({internal::PolygonDistance(area.polygon), area.properties, area.map});
        }
    }

private:
    struct Area {
        internal::PolygonDistance polygon;
        SurfaceProperties properties;
        std::shared_ptr<const SurfaceMap> map;
    };

    SurfaceProperties properties(double x, double y) const override {
        for (auto area = areas_.rbegin(); area != areas_.rend(); ++area) {
            if (!area->polygon.contains(x, y)) continue;
            if (area->map == nullptr) return area->properties;
            const SurfaceProperties found = area->map->at(x, y);
            if (!(found == area->map->defaults())) return found;
        }
        return under_ != nullptr ? under_->at(x, y) : defaults();
    }

    std::shared_ptr<const SurfaceMap> under_;
    std::vector<Area> areas_;
};

}  // namespace

Result<std::shared_ptr<const SurfaceMap>> paint_surface(std::shared_ptr<const SurfaceMap> under,
                                                        std::span<const SurfaceArea> areas) {
    for (std::size_t i = 0; i < areas.size(); ++i) {
        const auto refuse = [i](const Error& error) {
            return fail(error.code, "areas[" + number_text(i) + "]." + error.message);
        };
        if (auto ok = check(areas[i].polygon); !ok) return refuse(ok.error());
        if (auto ok = check(areas[i].properties); !ok) return refuse(ok.error());
    }
    return std::make_shared<const PaintedMap>(std::move(under), areas);
}

}  // namespace terrane
