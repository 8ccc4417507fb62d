// SPDX-License-Identifier: MIT
#include <terrane/terrain/terrain.h>

#include <cstddef>
#include <utility>

namespace terrane {

struct Terrain::State {
    // One camera's triangulator, and the threshold of its last mesh.
    struct Eye {
        Triangulator triangulator;
        double threshold_px = 1.0;
    };

    State(std::shared_ptr<const HeightSource> heights, const TerrainSettings& chosen, Pager&& made,
          Triangulator&& first)
        : source(std::move(heights)),
          settings(chosen),
          pager(std::move(made)),
          frame{.ground = pager.ground(chosen.surface), .meshes = {}} {
        add_eye(std::move(first));
    }

    std::shared_ptr<const HeightSource> source;
    TerrainSettings settings;
    Pager pager;
    std::vector<Eye> eyes;          // by camera, at least one; kept when cameras leave
    std::vector<CameraNeed> needs;  // of the update
    std::vector<TerrainMesh> meshes;
    Frame frame;

    void add_eye(Triangulator&& triangulator) {
        eyes.push_back({.triangulator = std::move(triangulator),
                        .threshold_px = settings.meshes.max_error_px});
    }

    void page(std::span<const Camera> cameras, std::span<const BodyNeed> bodies, double time_s) {
        while (eyes.size() < cameras.size()) {
            // cannot fail: the first triangulator was made with the same settings
            add_eye(std::move(*Triangulator::create(*source, settings.meshes)));
        }
        needs.clear();
        for (std::size_t i = 0; i < cameras.size(); ++i) {
            needs.push_back({.view = cameras[i].view,
                             .velocity = cameras[i].velocity,
                             .threshold_px = eyes[i].threshold_px,
                             .trajectory = cameras[i].trajectory});
        }
        pager.update(needs, bodies, time_s);
    }

    const Frame& triangulate(std::span<const Camera> cameras) {
        const std::shared_ptr<const ResidentSet> resident = pager.resident();
        meshes.clear();
        for (std::size_t i = 0; i < cameras.size(); ++i) {
            meshes.push_back(
                eyes[i].triangulator.update(resident, cameras[i].view, cameras[i].demands));
            if (meshes.back().threshold_px > 0.0) eyes[i].threshold_px = meshes.back().threshold_px;
        }
        const PagerStats stats = pager.stats();
        frame = {.ground = pager.ground(settings.surface),
                 .meshes = meshes,
                 .late_chunks = stats.late_chunks,
                 .groundless_bodies = stats.groundless_bodies};
        return frame;
    }
};

Result<Terrain> Terrain::create(std::shared_ptr<const HeightSource> source,
                                const TerrainSettings& settings) {
    TERRANE_TRY(Pager pager, Pager::create(source, settings.paging));
    TERRANE_TRY(Triangulator first, Triangulator::create(*source, settings.meshes));
    return Terrain(
        std::make_unique<State>(std::move(source), settings, std::move(pager), std::move(first)));
}

Terrain::Terrain(std::unique_ptr<State> state) : state_(std::move(state)) {}
Terrain::Terrain(Terrain&&) noexcept = default;
Terrain& Terrain::operator=(Terrain&&) noexcept = default;
Terrain::~Terrain() = default;

const Frame& Terrain::update(std::span<const Camera> cameras, std::span<const BodyNeed> bodies,
                             double time_s) {
    state_->page(cameras, bodies, time_s);
    return state_->triangulate(cameras);
}

const Frame& Terrain::load(std::span<const Camera> cameras, std::span<const BodyNeed> bodies,
                           double time_s) {
    state_->page(cameras, bodies, time_s);
    state_->pager.finish();
    return state_->triangulate(cameras);
}

RequiredRegion Terrain::require(const WorldRect& region, double deadline_s) {
    return state_->pager.require(region, deadline_s);
}

const Frame& Terrain::frame() const { return state_->frame; }

const HeightSource& Terrain::source() const { return *state_->source; }

Pager& Terrain::pager() { return state_->pager; }

}  // namespace terrane
