// SPDX-License-Identifier: MIT
#include <terrane/terrain/check_source.h>

#include <algorithm>
#include <cstdio>

namespace terrane {
namespace {

constexpr std::array<std::string_view, kSourceLawCount> kNames{
    "valid_lattice", "answers",     "finite",     "fits_quanta", "height",     "vertex_bound",
    "cell_bound",    "nesting",     "no_vertex",  "interval",    "rise_bound", "window",
    "levels",        "mesh_bounds", "repeatable", "threads"};
static_assert(static_cast<std::size_t>(SourceLaw::threads) + 1 == kSourceLawCount);

}  // namespace

std::string_view name_of(SourceLaw law) { return kNames[static_cast<std::size_t>(law)]; }

bool SourceReport::is_clean() const { return violations() == 0; }

std::uint64_t SourceReport::checks() const {
    std::uint64_t sum = 0;
    for (const SourceLawReport& law : laws) sum += law.checks;
    return sum;
}

std::uint64_t SourceReport::violations() const {
    std::uint64_t sum = 0;
    for (const SourceLawReport& law : laws) sum += law.broken;
    return sum;
}

std::string to_text(const SourceReport& report) {
    char line[192];
    std::snprintf(line, sizeof line, "%llu checks with seed %llu, %llu violations; ",
                  static_cast<unsigned long long>(report.checks()),
                  static_cast<unsigned long long>(report.seed),
                  static_cast<unsigned long long>(report.violations()));
    std::string text = line;
    std::snprintf(line, sizeof line, "deviations reach %.3g of their bounds\n", report.tightest);
    text += line;
    for (std::size_t i = 0; i < kSourceLawCount; ++i) {
        const SourceLawReport& law = report.laws[i];
        if (law.broken == 0) continue;
        std::snprintf(line, sizeof line, "%s: broken in %llu of %llu checks\n",
                      std::string(kNames[i]).c_str(), static_cast<unsigned long long>(law.broken),
                      static_cast<unsigned long long>(law.checks));
        text += line;
        for (const SourceViolation& v : law.worst) {
            std::snprintf(line, sizeof line,
                          "  at (%.6g, %.6g) m, level %d: claimed %.6g, measured %.6g: ", v.x, v.y,
                          v.level, v.claimed, v.measured);
            text += line + v.what + "\n";
        }
    }
    return text;
}

}  // namespace terrane
