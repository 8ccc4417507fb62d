// SPDX-License-Identifier: MIT
#include "view/map_panel.h"

#include "view/overlay.h"
#include "view/widgets.h"

#include <imgui.h>
#include <imgui_impl_opengl3.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <utility>

namespace terrane::tools {
namespace {

constexpr std::chrono::milliseconds kPictureInterval{1000};
constexpr double kPictureShare =
    1.25;  // side of a picture, of the map's: the eye moves on meanwhile
constexpr double kMostExaggeration = 20.0;
constexpr double kUsualSlope = 0.35;  // root mean square to which relief is exaggerated
constexpr double kAmbient = 0.35;     // share of light that has no direction
const Eigen::Vector3d kToLight(-0.5, 0.5,
                               std::numbers::sqrt2 / 2.0);  // north-west, 45 degrees high
constexpr float kLeastSquare = 3.0f;  // ImGui's units; smaller chunks are not drawn

// Height of a chunk at a place on it, bilinear.
double height_on(const Chunk& chunk, const Lattice& lattice, const WorldVec2& place_world) {
    const double cell = lattice.spacing * static_cast<double>(chunk.step);
    const auto along = [cell](double distance) {
        return std::clamp(distance / cell, 0.0, kChunkCells - 1e-9);
    };
    const double x = along(place_world.x() - lattice.x(chunk.corner.x));
    const double y = along(place_world.y() - lattice.y(chunk.corner.y));
    const auto column = static_cast<std::size_t>(x), row = static_cast<std::size_t>(y);
    const auto at = [&](std::size_t east, std::size_t north) {
        return lattice.quantum *
               static_cast<double>(chunk.heights[(row + north) * kChunkSamples + column + east]);
    };
    const double u = x - static_cast<double>(column), v = y - static_cast<double>(row);
    return (1.0 - v) * ((1.0 - u) * at(0, 0) + u * at(1, 0)) +
           v * ((1.0 - u) * at(0, 1) + u * at(1, 1));
}

// Hypsometric tint, from lowland to summits.
std::array<float, 3> tint(double share) {
    constexpr std::array<std::array<float, 3>, 5> kTints{{{0.33f, 0.55f, 0.35f},
                                                          {0.62f, 0.70f, 0.42f},
                                                          {0.80f, 0.72f, 0.48f},
                                                          {0.66f, 0.53f, 0.42f},
                                                          {0.93f, 0.92f, 0.91f}}};
    const double at = std::clamp(share, 0.0, 1.0) * (kTints.size() - 1);
    const std::size_t below = std::min(static_cast<std::size_t>(at), kTints.size() - 2);
    const auto part = static_cast<float>(at - static_cast<double>(below));
    std::array<float, 3> mixed{};
    for (std::size_t i = 0; i < 3; ++i)
        mixed[i] = (1.0f - part) * kTints[below][i] + part * kTints[below + 1][i];
    return mixed;
}

}  // namespace

namespace {

constexpr int kTexels = MapPicture::kTexels;

std::size_t index_of(int column, int row) {
    return static_cast<std::size_t>(row * kTexels + column);
}

// Heights at the centres of the texels, row by row from the south; NaN where nothing is resident.
std::vector<double> heights_of(const ResidentSet& resident, const WorldVec2& south_west,
                               double texel) {
    std::vector<double> heights(index_of(0, kTexels), std::numeric_limits<double>::quiet_NaN());
    const Lattice& lattice = resident.lattice();
    // texels whose centres are in an interval
    const auto range = [texel](double from, double to) {
        const auto at = [texel](double distance) {
            return static_cast<int>(
                std::ceil(std::clamp(distance / texel - 0.5, 0.0, 1.0 * kTexels)));
        };
        return std::pair(at(from), at(to));
    };
    const WorldRect& extent = resident.extent();
    // coarse to fine
    for (const std::shared_ptr<const Chunk>& chunk : resident.chunks()) {
        const std::int64_t side = kChunkCells * chunk->step;
        const auto [west, east] =
            range(std::max(extent.west, lattice.x(chunk->corner.x)) - south_west.x(),
                  std::min(extent.east, lattice.x(chunk->corner.x + side)) - south_west.x());
        const auto [south, north] =
            range(std::max(extent.south, lattice.y(chunk->corner.y)) - south_west.y(),
                  std::min(extent.north, lattice.y(chunk->corner.y + side)) - south_west.y());
        for (int row = south; row < north; ++row) {
            for (int column = west; column < east; ++column) {
                const WorldVec2 place(south_west.x() + texel * (column + 0.5),
                                      south_west.y() + texel * (row + 0.5));
                heights[index_of(column, row)] = height_on(*chunk, lattice, place);
            }
        }
    }
    return heights;
}

}  // namespace

MapPicture make_map_picture(const ResidentSet& resident, const WorldVec2& centre_world,
                            double side) {
    MapPicture made{.centre_world = centre_world, .side = side};
    const double texel = side / kTexels;
    const std::vector<double> heights =
        heights_of(resident, centre_world - WorldVec2::Constant(0.5 * side), texel);
    made.low = std::numeric_limits<double>::infinity();
    made.high = -made.low;
    for (const double height : heights) {
        if (!std::isfinite(height)) continue;
        made.low = std::min(made.low, height);
        made.high = std::max(made.high, height);
    }
    // slopes to the east and north, 0 where they are unknown
    const auto slope = [&](int column, int row, int east, int north) {
        const auto inside = [](int i) { return std::clamp(i, 0, kTexels - 1); };
        const double rise = heights[index_of(inside(column + east), inside(row + north))] -
                            heights[index_of(inside(column - east), inside(row - north))];
        return std::isfinite(rise) ? rise / (2.0 * texel) : 0.0;
    };
    std::vector<Eigen::Vector2d> slopes(heights.size());
    double squares = 0.0;
    for (int row = 0; row < kTexels; ++row) {
        for (int column = 0; column < kTexels; ++column) {
            Eigen::Vector2d& here = slopes[index_of(column, row)];
            here = {slope(column, row, 1, 0), slope(column, row, 0, 1)};
            squares += here.squaredNorm();
        }
    }
    const double usual = std::sqrt(squares / static_cast<double>(slopes.size()));
    const double exaggeration =
        std::clamp(kUsualSlope / std::max(usual, 1e-9), 1.0, kMostExaggeration);
    const double range = std::max(made.high - made.low, 1e-9);
    made.texels.resize(heights.size());
    for (int row = 0; row < kTexels; ++row) {
        for (int column = 0; column < kTexels; ++column) {
            const double height = heights[index_of(column, row)];
            if (!std::isfinite(height)) continue;
            const Eigen::Vector2d& slopes_here = slopes[index_of(column, row)];
            const Eigen::Vector3d normal(-exaggeration * slopes_here.x(),
                                         -exaggeration * slopes_here.y(), 1.0);
            // level ground has a light of 1
            const double light = normal.dot(kToLight) / (normal.norm() * kToLight.z());
            const auto factor =
                static_cast<float>(kAmbient + (1.0 - kAmbient) * std::max(light, 0.0));
            const std::array<float, 3> colour = tint((height - made.low) / range);
            std::array<std::uint8_t, 4>& texel_out =
                made.texels[index_of(column, kTexels - 1 - row)];
            for (std::size_t i = 0; i < 3; ++i) {
                texel_out[i] = static_cast<std::uint8_t>(
                    std::clamp(255.0f * factor * colour[i], 0.0f, 255.0f));
            }
            texel_out[3] = 255;
        }
    }
    return made;
}

// Where places of the world are on the map.
class MapPanel::Frame {
public:
    Frame(const ImVec2& corner, float side_units, const WorldPos& eye_world, double side)
        : middle_(corner.x + 0.5f * side_units, corner.y + 0.5f * side_units),
          eye_world_(eye_world),
          scale_(static_cast<double>(side_units) / side) {}

    ImVec2 at(double x, double y) const {
        return {middle_.x + static_cast<float>((x - eye_world_.x()) * scale_),
                middle_.y - static_cast<float>((y - eye_world_.y()) * scale_)};
    }

private:
    ImVec2 middle_;
    WorldPos eye_world_;
    double scale_;  // ImGui's units for a metre
};

void MapPanel::reserve_texture() {
    texture_ = ImGui::GetIO().Fonts->AddCustomRectRegular(kTexels, kTexels);
}

void MapPanel::refresh(const ViewFacts& facts) {
    const WorldVec2 eye = facts.view.eye_world.head<2>();
    const double side = kPictureShare * side_;
    const auto now = std::chrono::steady_clock::now();
    const bool is_old = !picture_ || picture_->side != side || picture_->centre_world != eye ||
                        epoch_ != facts.resident->epoch();
    if (!is_old || now - made_ < kPictureInterval) return;
    picture_ = make_map_picture(*facts.resident, eye, side);
    epoch_ = facts.resident->epoch();
    made_ = now;
    ImFontAtlas& atlas = *ImGui::GetIO().Fonts;
    unsigned char* texels = nullptr;
    int wide = 0;
    atlas.GetTexDataAsRGBA32(&texels, &wide, nullptr);
    const ImFontAtlasCustomRect& place = *atlas.GetCustomRectByIndex(texture_);
    for (int row = 0; row < kTexels; ++row) {
        std::memcpy(texels + 4 * ((place.Y + row) * wide + place.X),
                    &picture_->texels[index_of(0, row)], std::size_t{4} * kTexels);
    }
    ImGui_ImplOpenGL3_DestroyFontsTexture();
    ImGui_ImplOpenGL3_CreateFontsTexture();
}

// The picture of the ground, at its place.
void MapPanel::draw_ground(const Frame& frame) const {
    if (!picture_) return;
    ImFontAtlas& atlas = *ImGui::GetIO().Fonts;
    ImVec2 first, last;
    atlas.CalcCustomRectUV(atlas.GetCustomRectByIndex(texture_), &first, &last);
    const double half = 0.5 * picture_->side;
    const WorldVec2& centre = picture_->centre_world;
    ImGui::GetWindowDrawList()->AddImage(
        atlas.TexID, frame.at(centre.x() - half, centre.y() + half),
        frame.at(centre.x() + half, centre.y() - half), first, last);
}

void MapPanel::draw(const ViewFacts& facts, float side_units) {
    ImGui::SetNextItemWidth(0.75f * side_units);
    log_slider("side, m", side_, 100.0, 1e6, "%.0f");
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    ImGui::InvisibleButton("map", ImVec2(side_units, side_units));
    ImDrawList* const list = ImGui::GetWindowDrawList();
    const ImVec2 end(corner.x + side_units, corner.y + side_units);
    list->PushClipRect(corner, end, true);
    list->AddRectFilled(corner, end, IM_COL32(20, 24, 28, 255));
    const WorldPos& eye = facts.view.eye_world;
    const Frame frame(corner, side_units, eye, side_);
    draw_ground(frame);
    const Lattice& lattice = facts.resident->lattice();
    const float finest = static_cast<float>(std::max(1, lattice.finest_level));
    for (const std::shared_ptr<const Chunk>& chunk : facts.resident->chunks()) {
        const std::int64_t side = kChunkCells * chunk->step;
        const ImVec2 low = frame.at(lattice.x(chunk->corner.x), lattice.y(chunk->corner.y));
        const ImVec2 high =
            frame.at(lattice.x(chunk->corner.x + side), lattice.y(chunk->corner.y + side));
        const bool is_apart =
            high.x < corner.x || low.x > end.x || low.y < corner.y || high.y > end.y;
        if (is_apart || high.x - low.x < kLeastSquare) continue;
        const float share = static_cast<float>(chunk->key.level) / finest;
        list->AddRect(ImVec2(low.x, high.y), ImVec2(high.x, low.y),
                      colour_of({0.2f + 0.8f * share, 0.45f, 1.0f - 0.8f * share}, 0.8f));
    }
    for (std::size_t i = 1; i < facts.path.size(); ++i) {
        const WorldPos &from = facts.path[i - 1], &to = facts.path[i];
        list->AddLine(frame.at(from.x(), from.y()), frame.at(to.x(), to.y()),
                      IM_COL32(255, 220, 80, 255));
    }
    for (const BodyState& state : facts.world->states()) {
        if (state.condition == BodyCondition::removed) continue;
        const WorldPos& p = state.pose.translation;
        list->AddCircleFilled(frame.at(p.x(), p.y()), 2.0f, IM_COL32(120, 255, 120, 255), 6);
    }
    const Eigen::Vector3d& forward = facts.view.forward;
    const double reach = 0.12 * side_;
    const Eigen::Vector2d ahead = reach * forward.head<2>();
    const Eigen::Vector2d side(0.4 * ahead.y(), -0.4 * ahead.x());
    list->AddTriangle(frame.at(eye.x(), eye.y()),
                      frame.at(eye.x() + ahead.x() + side.x(), eye.y() + ahead.y() + side.y()),
                      frame.at(eye.x() + ahead.x() - side.x(), eye.y() + ahead.y() - side.y()),
                      IM_COL32(255, 255, 255, 255));
    list->PopClipRect();
    if (picture_ && picture_->high >= picture_->low)
        ImGui::Text("heights %.0f to %.0f m", picture_->low, picture_->high);
}

}  // namespace terrane::tools
