// SPDX-License-Identifier: MIT
//
// Judges a trace of `terrane drop` without code of the library. Exit code 0: no pose is deeper than the tolerance; 1: a
// pose is; 2: the trace cannot be judged.
#include "judge.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string>

namespace {

constexpr const char* kUsage =
    "trace_judge --trace FILE --shape sphere|capsule|box|hull|compound|mixed --heights FILE\n"
    "            [--tolerance M]\n"
    "\n"
    "--heights: a text file; first line `spacing west south parity`, then `column row height` a "
    "line,\n"
    "           as judge_drop.py writes it.\n";

int refuse(const std::string& message) {
    std::fprintf(stderr, "trace_judge: %s\n", message.c_str());
    return 2;
}

bool read_heights(const std::string& path, judge::Surface& surface) {
    std::ifstream file(path);
    if (!(file >> surface.spacing >> surface.west >> surface.south >> surface.parity) ||
        !(surface.spacing > 0.0)) {
        return false;
    }
    std::int64_t column = 0, row = 0;
    double height = 0.0;
    while (file >> column >> row >> height) surface.set_point(column, row, height);
    return file.eof();
}

const std::map<std::string, judge::DropShape> kShapes = {
    {"sphere", judge::DropShape::sphere},     {"capsule", judge::DropShape::capsule},
    {"box", judge::DropShape::box},           {"hull", judge::DropShape::hull},
    {"compound", judge::DropShape::compound}, {"mixed", judge::DropShape::mixed}};

}  // namespace

int main(int argc, char** argv) {
    std::map<std::string, std::string> values = {
        {"--trace", ""}, {"--shape", ""}, {"--heights", ""}, {"--tolerance", "0.01"}};
    for (int i = 1; i < argc; i += 2) {
        const auto found = values.find(argv[i]);
        if (found == values.end() || i + 1 == argc) {
            std::fputs(kUsage, stderr);
            return 2;
        }
        found->second = argv[i + 1];
    }
    const auto shape = kShapes.find(values["--shape"]);
    if (shape == kShapes.end()) return refuse("--shape is unknown: " + values["--shape"]);
    judge::Surface surface;
    if (!read_heights(values["--heights"], surface)) {
        return refuse("cannot read heights from " + values["--heights"]);
    }
    std::ifstream trace(values["--trace"]);
    if (!trace) return refuse("cannot open " + values["--trace"]);
    const judge::Report report = judge::judge_trace(
        trace, surface,
        {.shape = shape->second, .tolerance = std::atof(values["--tolerance"].c_str())});
    if (!report.error.empty()) return refuse(report.error);
    std::printf(
        "{\"bodies\":%llu,\"poses\":%llu,\"touching\":%llu,\"too_deep\":%llu,\"unjudged\":%llu,"
        "\"max_lift_m\":%.9g,\"max_depth_m\":%.9g}\n",
        static_cast<unsigned long long>(report.bodies),
        static_cast<unsigned long long>(report.poses),
        static_cast<unsigned long long>(report.touching),
        static_cast<unsigned long long>(report.too_deep),
        static_cast<unsigned long long>(report.unjudged), report.max_lift, report.max_depth);
    if (report.too_deep > 0) {
        std::fprintf(stderr, "trace_judge: first too deep: %s\n", report.first_too_deep.c_str());
        return 1;
    }
    if (report.unjudged > 0) {
        return refuse(std::to_string(report.unjudged) + " poses have no known ground under them");
    }
    return 0;
}
