// SPDX-License-Identifier: MIT
//
// Digging at run time: from a dig to its chunk in the resident set, and what a frame notices of it. Prints one line a
// figure; --quick repeats less often.
#include "benchmark/bench.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>
#include <terrane/volume/volume_editor.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>
#include <vector>

namespace terrane::bench {
namespace {

void print(const char* what, const std::vector<double>& ms) {
    std::printf("%s: median %.3f ms, p90 %.3f, p99 %.3f, most %.3f\n", what, quantile(ms, 0.5),
                quantile(ms, 0.9), quantile(ms, 0.99), quantile(ms, 1.0));
}

/// Hills at 0.25 m, a root of 1024 m.
std::shared_ptr<VolumeHeights> ground() {
    FractalSettings settings;
    settings.seed = 3;
    settings.octave_count = 10;
    settings.amplitude = 40.0;
    settings.wavelength_log2 = 9;
    settings.finest_spacing_log2 = -2;
    settings.root_size_log2 = 10;
    settings.first_root_x = settings.first_root_y = 0;
    settings.root_count_x = settings.root_count_y = 1;
    std::shared_ptr<const HeightSource> hills = FractalHeights::create(settings).value();
    const auto none =
        Volumes::create(hills->lattice(), {}, {.level = hills->lattice().finest_level}).value();
    return VolumeHeights::create(std::move(hills), none).value();
}

Pose place(const HeightSource& source, double x, double y, double below) {
    Pose pose;
    pose.translation = {x, y, source.height(x, y) - below};
    return pose;
}

// A number in [0, 1) for a step: the fractions of multiples of the golden ratio.
double fraction(int i, double factor) { return std::fmod(factor * i, 1.0); }

void measure_one_dig(int repetitions) {
    const auto source = ground();
    Pager pager =
        Pager::create(source, {.memory_bytes = std::size_t{1} << 30, .worker_count = 0}).value();
    const RequiredRegion region = pager.require({400.0, 400.0, 600.0, 600.0}, 0.0);
    pager.update({}, {}, 0.0);
    VolumeEditor editor = VolumeEditor::create(source, {.worker_count = 0}).value();
    std::vector<double> dig, publish;
    double time_s = 1.0;
    for (int i = 0; i < repetitions; ++i) {
        const Pose pose = place(*source, 420.0 + 160.0 * fraction(i, 0.6180339887),
                                420.0 + 160.0 * fraction(i, 0.7548776662), 1.0);
        const Stopwatch digging(Clock::thread);
        const auto number = editor.dig(VolumeSphere{5.0}, pose);
        if (!number || editor.update(pager) != *number) std::printf("a dig is not in force\n");
        dig.push_back(digging.ms());
        const Stopwatch publishing(Clock::thread);
        pager.update({}, {}, time_s += 1.0);
        publish.push_back(publishing.ms());
    }
    std::printf("dig of a 5 m sphere at 0.25 m, %zu chunks swapped in %zu digs\n",
                static_cast<std::size_t>(pager.stats().replaced), dig.size());
    print("  level sets, contours, chunks, swap", dig);
    print("  Pager::update", publish);
    // Undone from what was held.
    std::vector<double> undo;
    for (int i = 0; i < 8 && i < repetitions; ++i) {
        const Stopwatch undoing(Clock::thread);
        if (!editor.undo()) break;
        editor.update(pager);
        undo.push_back(undoing.ms());
        pager.update({}, {}, time_s += 1.0);
    }
    print("  undo", undo);
}

// Flies over the ground at 20 m/s, with a dig of 5 m in every `every`th frame of 1/60 s; 0: none.
void measure_frames(int frames, int every) {
    const auto source = ground();
    Pager pager =
        Pager::create(source, {.memory_bytes = std::size_t{1} << 30, .worker_count = 1}).value();
    VolumeEditor editor = VolumeEditor::create(source, {.worker_count = 1}).value();
    std::vector<double> update, edit, latency;
    std::vector<double> dug_at;
    int digs = 0;
    std::uint32_t in_force = 0;
    const auto begin = std::chrono::steady_clock::now();
    const auto now_s = [&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };
    for (int i = 0; i < frames; ++i) {
        const double time_s = i / 60.0, x = 300.0 + 20.0 * time_s, y = 500.0;
        CameraNeed camera;
        camera.view.eye_world = {x, y, source->height(x, y) + 5.0};
        camera.view.forward = Eigen::Vector3d(1.0, 0.0, -0.2).normalized();
        camera.view.up = Eigen::Vector3d(0.2, 0.0, 1.0).normalized();
        camera.velocity = {20.0, 0.0, 0.0};
        BodyNeed body;
        body.centre_world = camera.view.eye_world;
        body.radius = 10.0;
        body.velocity = camera.velocity;
        if (every > 0 && i % every == 0 && i > 60) {
            const Pose pose = place(*source, x + 5.0 + 20.0 * fraction(i, 0.6180339887),
                                    y + 20.0 * (fraction(i, 0.7548776662) - 0.5), 1.0);
            if (editor.dig(VolumeSphere{5.0}, pose)) {
                ++digs;
                dug_at.push_back(now_s());
            }
        }
        const Stopwatch editing(Clock::thread);
        const std::uint32_t number = editor.update(pager);
        const double edit_ms = editing.ms();
        const Stopwatch updating(Clock::thread);
        pager.update({&camera, 1}, {&body, 1}, time_s);
        const double update_ms = updating.ms();
        for (; in_force < number; ++in_force) latency.push_back(1e3 * (now_s() - dug_at[in_force]));
        if (i > 60) {
            edit.push_back(edit_ms);
            update.push_back(update_ms);
        }
        std::this_thread::sleep_until(begin + std::chrono::duration<double>((i + 1) / 60.0));
    }
    const PagerStats stats = pager.stats();
    std::printf(
        "%d frames, %d digs of 5 m, %zu in force, %llu chunks swapped, %llu loads outdated, "
        "%llu chunks completed, %llu loaded\n",
        frames, digs, static_cast<std::size_t>(in_force),
        static_cast<unsigned long long>(stats.replaced),
        static_cast<unsigned long long>(stats.outdated),
        static_cast<unsigned long long>(editor.stats().completed),
        static_cast<unsigned long long>(stats.loaded));
    print("  Pager::update", update);
    if (digs > 0) {
        print("  VolumeEditor::update", edit);
        print("  from dig to the resident set, of all clocks", latency);
    }
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    using namespace terrane::bench;
    Arguments arguments(argc, argv, "dig_benchmark [--quick]");
    const bool quick = arguments.has("--quick");
    arguments.finish();
    measure_one_dig(quick ? 3 : 60);
    measure_frames(quick ? 90 : 1560, 0);
    measure_frames(quick ? 90 : 1560, quick ? 5 : 3);
    if (!quick) measure_frames(1060, 1);
}
