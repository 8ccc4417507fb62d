// SPDX-License-Identifier: MIT
//
// A pager over failing storage: resident chunks stay, absent ones are retried.
#include "pager_scene.h"
#include "support/faulty_heights.h"
#include "support/random.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>

namespace terrane::pager_faults_test {

using namespace test;

// One update and all loads that it causes.
void play(Pager& pager, double time_s) {
    pager.update({steep_camera()}, {}, time_s);
    pager.finish();
}

void expect_all_there(const Pager& pager, const HeightSource& ground) {
    EXPECT_EQ(pager.stats().late_chunks, 0u);
    EXPECT_EQ(pager.stats().in_flight_bytes, 0u);
    const Frame frame = draw_steep(pager, ground);
    EXPECT_EQ(frame.status, MeshStatus::error_met);
    EXPECT_LE(frame.error_px, kSteepTarget_px);
}

void expect_coarser(const Pager& pager, const HeightSource& ground) {
    const Frame frame = draw_steep(pager, ground);
    EXPECT_EQ(frame.status, MeshStatus::not_resident);
    EXPECT_GT(frame.error_px, kSteepTarget_px);
}

std::ptrdiff_t tries_of(const FaultyHeights& source, const ChunkKey& key) {
    const std::vector<ChunkKey> sampled = source.sampled();
    return std::count(sampled.begin(), sampled.end(), key);
}

struct Trouble {
    const char* name;
    Fault fault;
    Question question = Question::any;
};
constexpr Trouble kTroubles[] = {
    {"read error", Fault::read_error},
    {"permission denied", Fault::permission_denied},
    {"truncated", Fault::truncated},
    {"NaN height", Fault::nan},
    {"NaN bound", Fault::nan, Question::bounds},
    {"too high", Fault::too_high, Question::sample},
    {"no memory", Fault::no_memory},
    {"no memory for bounds", Fault::no_memory, Question::bounds},
    {"exception", Fault::exception},
    {"odd exception", Fault::odd_exception, Question::flags},
};

// With and without workers by turns; ThreadLoader.ReportsEachFaultAndReleasesItsBytes meets each fault on threads.
TEST(PagerFaults, AreCountedDrawnCoarserAndRetried) {
    int workers = 0;
    for (const Trouble& trouble : kTroubles) {
        workers = 2 - workers;
        SCOPED_TRACE(testing::Message() << trouble.name << ", " << workers << " workers");
        const auto ground = steep_hills();
        const auto source = std::make_shared<FaultyHeights>(
            ground, std::vector<FaultRule>{
                        {.fault = trouble.fault, .question = trouble.question, .chunk = kBelow}});
        Pager pager = Pager::create(source, {.worker_count = workers}).value();
        play(pager, 0.0);
        EXPECT_EQ(pager.stats().failed, 1u);
        EXPECT_EQ(pager.stats().timed_out, 0u);
        EXPECT_GE(pager.stats().late_chunks, 1u);
        EXPECT_TRUE(holds(*pager.resident(), kBelow.parent()));
        EXPECT_TRUE(holds(*pager.resident(), kBelow.parent().parent()));
        EXPECT_TRUE(holds(*pager.resident(), kBeside));
        EXPECT_FALSE(holds(*pager.resident(), kBelow));
        expect_coarser(pager, *ground);
        play(pager, 0.05);  // too early
        EXPECT_EQ(pager.stats().failed, 1u);
        source->set_plan({});
        play(pager, 0.15);
        EXPECT_EQ(pager.stats().failed, 1u);
        EXPECT_TRUE(holds(*pager.resident(), kBelow));
        expect_all_there(pager, *ground);
    }
}

// First retry after 0.1 s, then after twice the previous delay, at most 10 s; by the pager's clock.
TEST(PagerFaults, AreRetriedWithBackOff) {
    for (const int workers : {0, 2}) {
        SCOPED_TRACE(testing::Message() << workers << " workers");
        const auto source = std::make_shared<FaultyHeights>(
            steep_hills(), std::vector<FaultRule>{{.fault = Fault::read_error, .chunk = kBelow}});
        Pager pager = Pager::create(source, {.worker_count = workers}).value();
        constexpr int kTicks_a_s = 20;
        std::vector<int> tried_at;
        for (int tick = 0; tick < 45 * kTicks_a_s; ++tick) {
            const std::ptrdiff_t before = tries_of(*source, kBelow);
            play(pager, static_cast<double>(tick) / kTicks_a_s);
            const std::ptrdiff_t more = tries_of(*source, kBelow) - before;
            ASSERT_LE(more, 1) << "tick " << tick;
            if (more == 1) tried_at.push_back(tick);
        }
        ASSERT_EQ(tried_at.size(), 11u);
        double wait_s = 0.1;
        for (std::size_t i = 1; i < tried_at.size(); ++i) {
            const double waited_s = static_cast<double>(tried_at[i] - tried_at[i - 1]) / kTicks_a_s;
            EXPECT_GE(waited_s, wait_s - 1e-9) << i;
            EXPECT_LE(waited_s, wait_s + 1.0 / kTicks_a_s + 1e-9) << i;
            wait_s = std::min(2.0 * wait_s, 10.0);
        }
        EXPECT_EQ(pager.stats().failed, tried_at.size());
        source->set_plan({});
        play(pager, 60.0);
        EXPECT_EQ(pager.stats().late_chunks, 0u);
        EXPECT_EQ(pager.stats().failed, tried_at.size());
    }
}

TEST(PagerFaults, OfTheRootsLeaveAnEmptyPictureUntilTheyArrive) {
    for (const int workers : {0, 2}) {
        SCOPED_TRACE(testing::Message() << workers << " workers");
        const auto ground = steep_hills(2);
        const auto source = std::make_shared<FaultyHeights>(
            ground, std::vector<FaultRule>{{.fault = Fault::exception}});
        Pager pager = Pager::create(source, {.worker_count = workers}).value();
        RequiredRegion required = pager.require({10, 10, 20, 20}, 1.0);
        play(pager, 0.0);
        EXPECT_EQ(pager.stats().resident_chunks, 0u);
        EXPECT_GE(pager.stats().failed, 4u);
        EXPECT_EQ(pager.stats().resident_bytes, 0u);
        EXPECT_EQ(required.state(), RegionState::failing);
        EXPECT_EQ(draw_steep(pager, *ground).status, MeshStatus::not_resident);
        source->set_plan({});
        play(pager, 0.2);
        play(pager, 20.0);
        EXPECT_TRUE(required.is_ready());
        expect_all_there(pager, *ground);
    }
}

// A third of all calls fails repeatedly in different ways; in the end everything is resident.
TEST(PagerFaults, OfManyKindsAtOnceEndWithEverythingResident) {
    for (const int workers : {0, 2}) {
        SCOPED_TRACE(testing::Message() << workers << " workers, seeds 1 to 3");
        const auto ground = steep_hills(2);
        const auto source = std::make_shared<FaultyHeights>(
            ground, std::vector<FaultRule>{{.fault = Fault::nan, .share = 0.1, .seed = 1},
                                           {.fault = Fault::no_memory, .share = 0.1, .seed = 2},
                                           {.fault = Fault::read_error, .share = 0.1, .seed = 3}});
        Pager pager = Pager::create(source, {.worker_count = workers}).value();
        double time_s = 0.0;
        do {
            play(pager, time_s);
            if (pager.stats().resident_chunks % 4 == 1) draw_steep(pager, *ground);
            time_s += 1.0;
            ASSERT_LT(time_s, 1000.0);
        } while (pager.stats().late_chunks > 0);
        EXPECT_GT(pager.stats().failed, 10u);
        expect_all_there(pager, *ground);
    }
}

// After any damage to the file the roots stay and other loads fail until the file is restored.
class PagerOverAFile : public testing::TestWithParam<int> {
protected:
    void SetUp() override { ASSERT_TRUE(FileHeights::write(path_, *ground_)); }
    void TearDown() override { std::filesystem::remove(path_); }

    void expect_mended(const std::function<void()>& harm, const std::function<void()>& mend) {
        Pager pager = Pager::create(source_, {.worker_count = GetParam()}).value();
        pager.update({}, {}, 0.0);
        pager.finish();
        EXPECT_EQ(pager.stats().resident_chunks, 4u);
        harm();
        play(pager, 1.0);
        const std::uint64_t failed = pager.stats().failed;
        EXPECT_GE(failed, 1u);
        play(pager, 1.05);
        EXPECT_EQ(pager.stats().failed, failed);
        play(pager, 1.2);
        EXPECT_GT(pager.stats().failed, failed);
        EXPECT_GT(pager.stats().late_chunks, 0u);
        expect_coarser(pager, *ground_);
        mend();
        const std::uint64_t failed_in_all = pager.stats().failed;
        play(pager, 20.0);
        EXPECT_EQ(pager.stats().failed, failed_in_all);
        expect_all_there(pager, *ground_);
    }
    void write() { ASSERT_TRUE(FileHeights::write(path_, *ground_)); }

    const std::string path_ = testing::TempDir() + "terrane_pager_" + std::to_string(getpid());
    const std::shared_ptr<const HeightSource> ground_ = steep_hills(2);
    const std::shared_ptr<FileHeights> source_ = std::make_shared<FileHeights>(path_, ground_);
};

TEST_P(PagerOverAFile, RecoversFromTruncation) {
    expect_mended(
        [&] {
            std::filesystem::resize_file(path_, FileHeights::row_offset(ground_->lattice(), 100));
        },
        [&] { write(); });
}

TEST_P(PagerOverAFile, RecoversFromACorruptByte) {
    expect_mended(
        [&] {
            std::fstream file(path_, std::ios::binary | std::ios::in | std::ios::out);
            const auto place = static_cast<std::streamoff>(
                FileHeights::row_offset(ground_->lattice(), 200) + 4096);
            file.seekg(place);
            const int before = file.get();
            file.seekp(place);
            file.put(static_cast<char>(before ^ 64));
        },
        [&] { write(); });
}

TEST_P(PagerOverAFile, RecoversFromDeniedPermission) {
    using std::filesystem::perms;
    expect_mended(
        [&] {
            std::filesystem::permissions(path_, perms::none);
            source_->opens_as_nobody = geteuid() == 0;
        },
        [&] {
            std::filesystem::permissions(path_, perms::owner_read | perms::owner_write |
                                                    perms::group_read | perms::others_read);
        });
}

TEST_P(PagerOverAFile, RecoversFromDeletion) {
    const std::string away = path_ + "_away";
    expect_mended([&] { std::filesystem::rename(path_, away); },
                  [&] { std::filesystem::rename(away, path_); });
}

TEST_P(PagerOverAFile, RecoversFromALackOfFileHandles) {
    std::unique_ptr<NoFileHandles> none;
    expect_mended([&] { none = std::make_unique<NoFileHandles>(); }, [&] { none.reset(); });
}

INSTANTIATE_TEST_SUITE_P(Workers, PagerOverAFile, testing::Values(0, 2));

// A share of all loads fails or hangs; once the camera has been at rest for a while all needs are resident.
TEST(PagerFaults, OfVirtualStorageDelayAFlightAndEndWithEverythingResident) {
    for (int seed = 1; seed <= few_or_many(1, 3); ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        const auto ground = steep_hills();
        auto loader =
            VirtualLoader::create({.failure_share = 0.3,
                                   .hang_share = 0.05,
                                   .timeout = 0.5,
                                   .seed = static_cast<std::uint64_t>(seed)},
                                  [&](const ChunkKey& key) { return make_chunk(*ground, key); })
                .value();
        Pager pager = Pager::create(ground, {}, std::move(loader)).value();
        double time_s = 0.0;
        CameraNeed camera;
        for (int frame = 0; frame < 400; ++frame, time_s += 0.02) {
            const WorldPos eye(-600.0 + 2.0 * frame, 100.0 + frame, 150.0);
            camera = camera_at(eye, eye + WorldPos(100, 50, -40), kSteepTarget_px);
            camera.velocity = {100, 50, 0};
            pager.update({camera}, {}, time_s);
            if (frame % 100 == 50) draw(pager.resident(), *ground, camera.view, kSteepTarget_px);
        }
        camera.velocity.setZero();
        for (int frame = 0; frame < 1000; ++frame, time_s += 0.02) {
            pager.update({camera}, {}, time_s);
        }
        EXPECT_EQ(pager.stats().late_chunks, 0u);
        EXPECT_GT(pager.stats().failed, pager.stats().timed_out);
        EXPECT_GT(pager.stats().timed_out, 0u);
        const Frame frame = draw(pager.resident(), *ground, camera.view, kSteepTarget_px);
        EXPECT_EQ(frame.status, MeshStatus::error_met);
    }
}

}  // namespace terrane::pager_faults_test
