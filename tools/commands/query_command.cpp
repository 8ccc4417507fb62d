// SPDX-License-Identifier: MIT
#include "program/command.h"
#include "program/options.h"
#include "program/summary.h"
#include "query/answers.h"
#include "query/questions.h"
#include "scene/terrain_options.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace terrane::tools {
namespace {

struct QueryOptions {
    TerrainOptions terrain;
    double contact_spacing_m = 0.0;
    double memory_mb = 1024.0;
};

/// Whether the answer to a question leaves out the bodies and objects of a scene.
bool is_of_ground_alone(const Parsed<Question>& question) {
    if (!question) return false;
    const auto meets_ground = [](const auto* asked) { return asked != nullptr && !asked->other; };
    return meets_ground(std::get_if<ShapeQuestion>(&*question)) ||
           meets_ground(std::get_if<CastQuestion>(&*question));
}

CommandResult<void> run_query(const QueryOptions& options) {
    TerrainOptions whole = options.terrain;
    whole.world = WorldKind::whole;
    TERRANE_TRY(const Terrain terrain, open_terrain(whole));
    TERRANE_TRY(check_memory(terrain, options.memory_mb));
    TERRANE_TRY(
        QueryGround ground,
        QueryGround::create(terrain.source,
                            {.contact_spacing = options.contact_spacing_m,
                             .memory_bytes = static_cast<std::size_t>(options.memory_mb * 0x1p20),
                             .surface = terrain.surface}));
    PickScene scene = {
        .bodies = terrain.bodies, .objects = terrain.objects, .source = terrain.source};

    bool has_more = !scene.is_empty();  // than ground
    LonlatKeys lonlat(terrain);
    const auto answer_line = [&](std::string_view line) {
        const QueryLine asked = parse_query(line, &lonlat);
        nlohmann::ordered_json answer = answer_query(asked, ground, scene);
        if (asked.wants_lonlat && asked.question) lonlat.add_to(answer, *asked.question);
        if (has_more && is_of_ground_alone(asked.question)) {
            print_note(fmt::format(
                "test, find, distance, pseudodistance and cast meet the ground of the scene '{}'; "
                "its bodies and objects are met by ray and pick alone",
                options.terrain.scene));
            has_more = false;  // said once
        }
        return answer;
    };

    LineReader lines(STDIN_FILENO, [] { std::fflush(stdout); });
    for (;;) {
        std::string_view line;
        const LineReader::Status status = lines.next(line);
        if (status == LineReader::Status::end) return {};
        if (status == LineReader::Status::failed) {
            return failure(fmt::format("cannot read standard input: {}", std::strerror(errno)));
        }
        const std::string answer =
            status == LineReader::Status::too_long
                ? to_line(invalid_answer(
                      fmt::format("the line is longer than {} bytes", LineReader::kMaxLine_bytes)))
                : to_line(answer_line(line));
        std::fwrite(answer.data(), 1, answer.size(), stdout);
        std::fputc('\n', stdout);
        // a full disk: main() reports it
        if (std::ferror(stdout) != 0) return {};
    }
}

}  // namespace

void add_query_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<QueryOptions>();
    CLI::App* query = app.add_subcommand(
        "query",
        "Answers questions about the ground, and about shapes: one JSON object a line on standard "
        "input, one a line "
        "out, in order.\n"
        "  {\"op\":\"height\",\"x\":..,\"y\":..}\n"
        "  {\"op\":\"height_below\",\"x\":..,\"y\":..,\"z\":..}: the highest surface at or below "
        "z, where "
        "volumes fold the ground\n"
        "  {\"op\":\"ray\",\"from\":[x,y,z],\"to\":[x,y,z]}\n"
        "  "
        "{\"op\":\"test\"|\"find\"|\"distance\"|\"pseudodistance\",\"shape\":S,\"position\":[x,y,z]"
        ","
        "\"rotation\":[w,x,y,z]}\n"
        "  "
        "{\"op\":\"cast\",\"shape\":S,\"position\":..,\"rotation\":..,\"to\":..,\"to_rotation\":..,"
        "\"skip_separating\":true}\n"
        "  "
        "{\"op\":\"pick\",\"eye\":[x,y,z],\"look\":[x,y,z],\"fov_deg\":60,\"size\":[w,h],\"pixel\":"
        "[x,y]"
        ",\"far_m\":..}: the ground, body or object at a point of a camera's picture; pixel i "
        "spans "
        "i to i + 1, from the top left corner. \"forward\" may stand for look, and \"up\" is up\n"
        "S is {\"sphere\":{\"radius\":r}}, {\"capsule\":{\"radius\":r,\"half_height\":h}} (axis "
        "z), "
        "{\"box\":{\"half_extents\":[x,y,z]}}, {\"hull\":{\"points\":[[x,y,z],..]}} or\n"
        "  {\"compound\":[{\"shape\":S,\"position\":..,\"rotation\":..},..]}.\n"
        "With \"other\":{\"shape\":S,\"position\":..,\"rotation\":..,\"to\":..,\"to_rotation\":..} "
        "a "
        "shape or a ray meets that shape instead of the ground.\n"
        "Bodies and objects of a scene are met by ray and pick alone, as a note says.\n"
        "Over a raster with a CRS \"lonlat\":[longitude,latitude], degrees in WGS 84, stands for x "
        "and y, \"lonlat\":[longitude,latitude,z] for position, and from_lonlat, to_lonlat, "
        "eye_lonlat and look_lonlat for from, to, eye and look; the answer then gives \"lonlat\", "
        "as it does with \"lonlat\":true.\n"
        "An \"id\" is echoed. A bad line gets status invalid and a message.");
    add_terrain_options(*query, options->terrain, {"bodies", "surface", "volumes", "objects"});
    add_in_range(*query, "--contact-spacing-m", options->contact_spacing_m, 0.0, 1e9,
                 "Answers come from the coarsest level of at most this spacing, metres; 0: the "
                 "finest");
    add_in_range(*query, "--memory-mb", options->memory_mb, 0.001, 0x1p32,
                 "Most memory that chunks take, MB of 2^20 bytes");
    query->add_flag("--json")->description("Changes nothing: answers are JSON anyway");
    add_preset_option(*query);
    query->footer(
        "Example: echo '{\"op\":\"height\",\"x\":0,\"y\":0}' | terrane query --dem "
        "tools/data/jacksboro.tif");
    query->callback(
        [&context, options] { context.run = [options] { return run_query(*options); }; });
}

}  // namespace terrane::tools
