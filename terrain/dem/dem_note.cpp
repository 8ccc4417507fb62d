// SPDX-License-Identifier: MIT
#include <terrane/dem/dem_note.h>

#include <nlohmann/json.hpp>

namespace terrane {

std::string note_of(const DemInfo& dem) {
    nlohmann::ordered_json note;
    note["samples"] = {dem.columns, dem.rows};
    note["cell_m"] = {dem.cell_x, dem.cell_y};
    note["range_m"] = {dem.min_m, dem.max_m};
    note["nodata_share"] = dem.nodata_share;
    note["filled_share"] = dem.filled_share;
    note["crs"] = dem.crs;
    note["crs_wkt"] = dem.crs_wkt;
    if (dem.projection == DemProjection::local)
        note["tangent_plane_at"] = {dem.middle_longitude, dem.middle_latitude};
    note["geographic"] = dem.geographic;
    note["centre"] = {dem.centre_x, dem.centre_y};
    note["metres_per_unit"] = {dem.metres_per_unit_x, dem.metres_per_unit_y};
    note["scale_error"] = dem.scale_error;
    if (dem.resampling_error > 0.0) note["resampling_error_m"] = dem.resampling_error;
    return note.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
}

std::optional<DemInfo> dem_of_note(const std::string& note_text) {
    try {
        const nlohmann::json note = nlohmann::json::parse(note_text);
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
        dem.crs_wkt = note.value("crs_wkt", std::string());
        if (const auto place = note.find("tangent_plane_at"); place != note.end()) {
            dem.projection = DemProjection::local;
            dem.middle_longitude = place->at(0).get<double>();
            dem.middle_latitude = place->at(1).get<double>();
        }
        dem.geographic = note.at("geographic").get<bool>();
        dem.centre_x = note.at("centre").at(0).get<double>();
        dem.centre_y = note.at("centre").at(1).get<double>();
        dem.metres_per_unit_x = note.at("metres_per_unit").at(0).get<double>();
        dem.metres_per_unit_y = note.at("metres_per_unit").at(1).get<double>();
        dem.scale_error = note.at("scale_error").get<double>();
        dem.resampling_error = note.value("resampling_error_m", 0.0);
        return dem;
    } catch (const nlohmann::json::exception&) {
        return std::nullopt;
    }
}

}  // namespace terrane
