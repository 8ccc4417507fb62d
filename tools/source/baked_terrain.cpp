// SPDX-License-Identifier: MIT
#include "source/baked_terrain.h"

#include <nlohmann/json.hpp>

#include <cstdlib>

namespace terrane::tools {
namespace {

std::string user_cache_folder() {
    // relative paths must be ignored: XDG Base Directory Specification 0.8
    const char* const xdg = std::getenv("XDG_CACHE_HOME");
    if (xdg != nullptr && xdg[0] == '/') return std::string(xdg) + "/terrane";
    const char* const home = std::getenv("HOME");
    if (home != nullptr && home[0] == '/') return std::string(home) + "/.cache/terrane";
    return {};
}

}  // namespace

std::string note_of(const Terrain& terrain) {
    if (!terrain.dem) return {};
    const DemInfo& dem = *terrain.dem;
    nlohmann::ordered_json note;
    note["samples"] = {dem.columns, dem.rows};
    note["cell_m"] = {dem.cell_x, dem.cell_y};
    note["range_m"] = {dem.min_m, dem.max_m};
    note["nodata_share"] = dem.nodata_share;
    note["filled_share"] = dem.filled_share;
    note["crs"] = dem.crs;
    note["geographic"] = dem.geographic;
    note["centre"] = {dem.centre_x, dem.centre_y};
    note["metres_per_unit"] = {dem.metres_per_unit_x, dem.metres_per_unit_y};
    note["scale_error"] = dem.scale_error;
    return note.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
}

CommandResult<Terrain> open_baked(const std::string& path) {
    StoreInfo info;
    Result<std::shared_ptr<const HeightSource>> source = ChunkStore::open(path, &info);
    if (!source) return pass_on(source.error());
    Terrain terrain{.source = *source, .dem = std::nullopt, .name = path, .store = info};
    if (info.note.empty()) return terrain;
    try {
        const nlohmann::json note = nlohmann::json::parse(info.note);
        DemInfo dem;
        dem.columns = note.at("samples").at(0).get<int>();
        dem.rows = note.at("samples").at(1).get<int>();
        dem.cell_x = note.at("cell_m").at(0).get<double>();
        dem.cell_y = note.at("cell_m").at(1).get<double>();
        dem.min_m = note.at("range_m").at(0).get<double>();
        dem.max_m = note.at("range_m").at(1).get<double>();
        dem.nodata_share = note.at("nodata_share").get<double>();
        dem.filled_share = note.at("filled_share").get<double>();
        dem.crs = note.at("crs").get<std::string>();
        dem.geographic = note.at("geographic").get<bool>();
        dem.centre_x = note.at("centre").at(0).get<double>();
        dem.centre_y = note.at("centre").at(1).get<double>();
        dem.metres_per_unit_x = note.at("metres_per_unit").at(0).get<double>();
        dem.metres_per_unit_y = note.at("metres_per_unit").at(1).get<double>();
        dem.scale_error = note.at("scale_error").get<double>();
        terrain.dem = dem;
    } catch (const nlohmann::json::exception&) {
        // note of another program: the terrain is complete without it
    }
    return terrain;
}

DemCache choose_cache(const std::string& option) {
    if (option == "off") return {};
    if (option == "beside") return {DemCache::Place::beside, user_cache_folder()};
    return {DemCache::Place::folder, option.empty() ? user_cache_folder() : option};
}

}  // namespace terrane::tools
