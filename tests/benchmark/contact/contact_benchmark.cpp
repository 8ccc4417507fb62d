// SPDX-License-Identifier: MIT
// Time of contact queries, beside Bullet and ODE where they are found: one thread, the same heights, the same poses in
// the same order. Every engine runs each query once before it is timed.
//
//   contact_benchmark [--quick] [--alone] [--only TEXT]
//
// --quick: one short round over small maps, as ctest runs it. --alone: without the peers. --only: the
// queries whose name contains this text.
//
// Exits with 1 if an engine's surface differs from the oracle's, or if Terrane misses a contact.
#include "benchmark/machine.h"
#include "contact_comparison.h"
#include "contact_oracle.h"

#include <cstdio>

namespace terrane::bench {
namespace {

// Time of a height read from an array: the machine's share.
double time_plain_lookup_ns(const ContactMap& map, const std::vector<Ray>& places) {
    const ContactOracle oracle(map.table, cut_as_terrane);
    std::vector<double> heights(places.size());
    const auto round = [&] {
        for (std::size_t i = 0; i < places.size(); ++i) {
            heights[i] = oracle.height(places[i].from.x(), places[i].from.y());
        }
        return true;
    };
    return measure_ns(places.size(), false, round).value();
}

int run(const ComparisonSettings& settings) {
    const bool is_quick = settings.is_quick;
    const std::size_t many = is_quick ? 200 : 10000;
    const std::size_t some = is_quick ? 20 : 1000;
    const std::size_t few = is_quick ? 2 : 40;
    const Sphere sphere{0.5};
    const Capsule capsule{0.4, 0.8};
    const Box box{{1.0, 2.0, 0.5}};
    // speed relative to Bullet, to ODE
    const std::vector<double> any{0.0, 0.0}, of_ray{10.0, 0.0}, of_contact{5.0, 1.0};
    const std::vector<double> of_step{0.0, 1.0};
    const std::vector<double> of_cast{20.0, 0.0};

    std::printf("%s\n", describe_machine().c_str());
#ifndef TERRANE_BENCH_BULLET
    std::printf("Bullet was not found when this was built: its column is left out\n");
#endif
#ifndef TERRANE_BENCH_ODE
    std::printf("ODE was not found when this was built: its column is left out\n");
#endif

    const ContactMap map = make_contact_map(is_quick ? 513 : 1025, 1.0);
    std::printf("contact map, %d x %d samples at 1 m\n", map.table.columns, map.table.rows);
    ContactComparison at_1m(map, settings);
    bool is_sound = at_1m.check_surfaces();
    const std::vector<Ray> vertical = make_vertical_rays(map, many, 1);
    std::printf("  a plain lookup in an array: %.1f ns\n", time_plain_lookup_ns(map, vertical));

    at_1m.heights({"height", 15.0, any}, vertical);
    at_1m.rays({"ray, vertical", 0.0, any}, vertical);
    at_1m.rays({"ray, 500 m, grazing", 280.0, of_ray}, make_grazing_rays(map, many, 500.0, 2));
    // heights above ground at which half of them touch
    at_1m.contacts({"contacts of the sphere", 100.0, of_contact}, sphere,
                   make_poses(map, many, 1.09, 5.0, 3));
    at_1m.contacts({"contacts of the capsule", 300.0, of_contact}, capsule,
                   make_poses(map, many, 1.71, 5.0, 4));
    at_1m.contacts({"contacts of the box", 900.0, of_contact}, box,
                   make_poses(map, many, 3.74, 5.0, 5));
    at_1m.shallow_contacts({"shallow contacts of the sphere", 0.0, of_step}, sphere, many, 12);
    at_1m.shallow_contacts({"shallow contacts of the capsule", 0.0, of_step}, capsule, many, 14);
    at_1m.shallow_contacts({"shallow contacts of the box", 0.0, of_step}, box, many, 16);
    at_1m.casts({"cast of the capsule, 5 m", 800.0, of_cast}, capsule,
                make_sweeps(map, many, capsule, 5.0, 3.0, false, 6));
    at_1m.casts({"cast of the box, 5 m", 1500.0, of_cast}, box,
                make_sweeps(map, many, box, 5.0, 3.0, false, 7));
    at_1m.casts({"cast of the box, 200 m", 4000.0, of_cast}, box,
                make_sweeps(map, some, box, 200.0, 60.0, true, 8));
    std::vector<Row> rows = at_1m.rows();

    // the same box, 2 x 4 x 1 m, over 10^5 cells
    constexpr const char* kTurned = "contacts of a car on 1 cm ground, turned";
    constexpr const char* kStanding = "contacts of a car on 1 cm ground, standing";
    if (settings.wants(kTurned) || settings.wants(kStanding)) {
        const ContactMap fine_map = make_contact_map(is_quick ? 1025 : 2049, 0.01);
        std::printf("contact map, %d x %d samples at 1 cm\n", fine_map.table.columns,
                    fine_map.table.rows);
        ContactComparison at_1cm(fine_map, settings);
        is_sound = at_1cm.check_surfaces() && is_sound;
        at_1cm.contacts({kTurned, 50e3, any}, box, make_poses(fine_map, few, 3.5, 2.5, 9));
        at_1cm.contacts({kStanding, 50e3, any}, box, make_standing_poses(fine_map, few, box, 10));
        rows.insert(rows.end(), at_1cm.rows().begin(), at_1cm.rows().end());
    }

    if (!rows.empty()) print_table(at_1m.names(), rows);
    for (const Row& row : rows) is_sound = is_sound && row.scores.front().missed == 0;
    return is_sound ? 0 : 1;
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    terrane::bench::ComparisonSettings settings;
    for (int i = 1; i < argc; ++i) {
        const std::string_view flag = argv[i];
        if (flag == "--quick") {
            settings.is_quick = true;
        } else if (flag == "--alone") {
            settings.is_alone = true;
        } else if (flag == "--only" && i + 1 < argc) {
            settings.only = argv[++i];
        } else {
            std::fprintf(stderr, "contact_benchmark: %s is not understood\n", argv[i]);
            return 2;
        }
    }
    return terrane::bench::run(settings);
}
