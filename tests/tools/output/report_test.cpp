// SPDX-License-Identifier: MIT
#include "flight/report.h"

#include "lab/paging_table.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace terrane::tools {
namespace report_test {

std::string read(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::string fresh_folder() {
    const std::string path = testing::TempDir() + "report_" +
                             testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(path);
    return path;
}

FrameRecord make_frame(int i) {
    FrameRecord frame;
    frame.time = i / 30.0;
    frame.eye_world = WorldPos(1.5 * i, -2.0, 300.25);
    frame.triangles = static_cast<std::size_t>(1000 + i);
    frame.budget = 1500;
    frame.error_px = 0.7 + 0.01 * i;
    frame.update_ms = 2.0 + i % 3;
    frame.status = MeshStatus::budget_reached;
    frame.paging.resident_chunks = 12;
    frame.paging.resident_bytes = 5'000'000;
    frame.paging.peak_bytes = 6'000'000;
    frame.paging.late_chunks = i == 7 ? 3 : 0;
    frame.max_error_px = 0.75;
    return frame;
}

TEST(Report, HoldsTheDataAndNothingFromANetwork) {
    const std::string folder = fresh_folder();
    std::filesystem::create_directories(folder);
    Result<FlightLog> log = FlightLog::create(folder + "/frames.csv", {"speed_m_s"});
    ASSERT_TRUE(log);
    for (int i = 0; i < 10; ++i) {
        FrameRecord frame = make_frame(i);
        if (i == 7) frame.status = MeshStatus::not_resident;
        frame.extra = {123.0 + i};
        ASSERT_TRUE(log->add(frame));
    }
    ReportHeader header{.title = "Flight over <b>\"A & B\"</b>",
                        .command_line = "terrane fly --dem 'a b.tif'",
                        .film = "",
                        .summary = summarize(log->frames(), std::size_t{1} << 27, 30.0)};
    header.summary["terrain"] = "</script><script>alert(1)</script>";
    const std::string path = folder + "/report.html";
    ASSERT_TRUE(write_flight_report(path, header, *log, std::size_t{1} << 27));
    const std::string page = read(path);

    EXPECT_NE(page.find("[1000.0,1001.0,1002.0"), std::string::npos) << "triangles";
    EXPECT_NE(page.find("[123.0,124.0"), std::string::npos) << "the extra column";
    EXPECT_NE(page.find("\"title\":\"Speed, m/s\""), std::string::npos);
    EXPECT_NE(page.find("[\"Certified screen error (most), px\",\"0.79\",\"\",\"error_px_max\"]"),
              std::string::npos)
        << "words, and four digits";
    EXPECT_NE(page.find("\"budget\":1500"), std::string::npos);
    EXPECT_NE(page.find("\"ceiling\":128.0"), std::string::npos);
    EXPECT_NE(page.find("\"late_frames\":1"), std::string::npos);
    EXPECT_NE(page.find("terrane fly --dem 'a b.tif'"), std::string::npos);
    EXPECT_NE(page.find("Chart.js v3"), std::string::npos);
    EXPECT_EQ(page.find("http:"), std::string::npos);
    EXPECT_EQ(page.find("https:"), std::string::npos);
    EXPECT_EQ(page.find("src=\"//"), std::string::npos);
    EXPECT_EQ(page.find("{{"), std::string::npos) << "an unfilled place";
    EXPECT_EQ(page.find("<b>\"A"), std::string::npos) << "an unescaped title";
    EXPECT_EQ(page.find("alert(1)</script>"), std::string::npos) << "an unescaped value";
}

TEST(Report, ShowsAFilmWhereThereIsOne) {
    const std::string folder = fresh_folder();
    std::filesystem::create_directories(folder);
    Result<FlightLog> log = FlightLog::create(std::nullopt);
    ASSERT_TRUE(log);
    ASSERT_TRUE(log->add(make_frame(0)));
    const ReportHeader header{"t", "c", "flight.mp4", summarize(log->frames(), 1, 30.0)};
    ASSERT_TRUE(write_flight_report(folder + "/report.html", header, *log, 1));
    EXPECT_NE(read(folder + "/report.html").find("src=\"flight.mp4\""), std::string::npos);
}

TEST(Report, IsAnErrorWhereItCannotBeWritten) {
    Result<FlightLog> log = FlightLog::create(std::nullopt);
    ASSERT_TRUE(log);
    EXPECT_FALSE(write_flight_report("/no/such/folder/report.html", {}, *log, 1));
}

PagingRow make_row(PagingChoice policy, std::size_t late_frames) {
    PagingRow row;
    row.cell.path = "turns";
    row.cell.speed = 100.0;
    row.cell.memory_mb = 64.0;
    row.policy = policy;
    row.run.totals.frames = 10;
    row.run.totals.late_frames = late_frames;
    for (int i = 0; i < 10; ++i) row.run.frames.push_back(make_frame(i));
    return row;
}

TEST(PagingReport, HoldsEveryRunAndMarksMissedTargets) {
    const std::string folder = fresh_folder();
    std::filesystem::create_directories(folder);
    std::vector<PagingRow> rows{make_row(PagingChoice::deadline, 3),
                                make_row(PagingChoice::distance, 0),
                                make_row(PagingChoice::oracle, 0)};
    rows[1].radius = 2.0;
    const ReportHeader header{.title = "Paging over <seed>",
                              .command_line = "terrane page",
                              .film = "",
                              .summary = {{"flights", 3}}};
    const std::string path = folder + "/report.html";
    ASSERT_TRUE(write_paging_report(path, header, rows));
    const std::string page = read(path);
    EXPECT_NE(page.find("\"late_frames\":3"), std::string::npos);
    EXPECT_NE(page.find("\"radius\":2.0"), std::string::npos);
    EXPECT_NE(page.find("\"late_ratio\":\"inf\""), std::string::npos);
    EXPECT_NE(page.find("\"excess_ratio\":null"), std::string::npos);
    EXPECT_NE(page.find("\"missed\":[\"late_frames\"]"), std::string::npos);
    EXPECT_NE(page.find("\"errors\":{\"deadline\":[0.7,0.71,"), std::string::npos);
    EXPECT_NE(page.find("Paging over &lt;seed&gt;"), std::string::npos);
    EXPECT_NE(page.find("Chart.js v3"), std::string::npos);
    EXPECT_EQ(page.find("http:"), std::string::npos);
    EXPECT_EQ(page.find("https:"), std::string::npos);
    EXPECT_EQ(page.find("{{"), std::string::npos) << "an unfilled place";
    EXPECT_FALSE(write_paging_report("/no/such/folder/report.html", header, rows));
}

TEST(PagingReport, DrawsErrorsOfAFewCellsOnly) {
    const std::string folder = fresh_folder();
    std::filesystem::create_directories(folder);
    std::vector<PagingRow> rows;
    for (std::size_t i = 0; i <= kMostPlottedCells; ++i) {
        rows.push_back(make_row(PagingChoice::deadline, 0));
        rows.back().cell.memory_mb = 64.0 + static_cast<double>(i);
    }
    const std::string path = folder + "/report.html";
    ASSERT_TRUE(write_paging_report(path, {}, rows));
    EXPECT_EQ(read(path).find("\"time\":["), std::string::npos);
    rows.pop_back();
    ASSERT_TRUE(write_paging_report(path, {}, rows));
    EXPECT_NE(read(path).find("\"time\":["), std::string::npos);
}

TEST(FlightLog, WritesTheColumnsThatScriptsReadAndOnlyWhenWhole) {
    const std::string folder = fresh_folder();
    std::filesystem::create_directories(folder);
    Result<FlightLog> log = FlightLog::create(folder + "/frames.csv");
    ASSERT_TRUE(log);
    ASSERT_TRUE(log->add(make_frame(0)));
    EXPECT_FALSE(std::filesystem::exists(folder + "/frames.csv"));
    FrameRecord verified = make_frame(1);
    verified.measured_error_px = 0.25;
    verified.max_pop_px = 0.125;
    verified.holes = 0;
    ASSERT_TRUE(log->add(verified));
    ASSERT_TRUE(log->commit());
    std::istringstream csv(read(folder + "/frames.csv"));
    std::string header, first, second;
    std::getline(csv, header);
    std::getline(csv, first);
    std::getline(csv, second);
    EXPECT_TRUE(header.starts_with(
        "time_s,eye_x_m,eye_y_m,eye_z_m,triangles,budget,error_px,measured_error_px,update_ms,"
        "chunks_resident,resident_bytes,late_chunks,max_pop_px,"))
        << header;
    EXPECT_TRUE(
        first.starts_with("0,0,-2,300.25,1000,1500,0.7,,2.0000,12,5000000,0,,budget_reached,"))
        << first;
    EXPECT_NE(second.find(",0.71,0.25,3.0000,12,5000000,0,0.125,"), std::string::npos) << second;
}

TEST(FlightLog, SummaryCountsWhatBrokeAPromise) {
    std::vector<FrameRecord> frames;
    for (int i = 0; i < 100; ++i) {
        frames.push_back(make_frame(i));
        frames.back().measured_error_px = i == 3 ? 9.0 : 0.0;
        frames.back().max_pop_px = 0.0;
        frames.back().holes = 0;
        frames.back().update_ms = i;
    }
    frames[50].triangles = 1501;
    frames[60].status = MeshStatus::not_resident;
    const nlohmann::ordered_json summary = summarize(frames, 1 << 20, 50.0);
    EXPECT_EQ(summary["frames"], 100);
    EXPECT_EQ(summary["over_budget_frames"], 1);
    EXPECT_EQ(summary["uncertified_frames"], 1);
    EXPECT_EQ(summary["late_frames"], 1);
    EXPECT_EQ(summary["triangles_max"], 1501);
    EXPECT_EQ(summary["update_ms_median"], 49.0);
    EXPECT_EQ(summary["update_ms_p99"], 98.0);
    EXPECT_EQ(summary["peak_bytes"], 6'000'000);
    EXPECT_EQ(summary["memory_bytes"], 1 << 20);
}

TEST(FlightLog, AFrameIsLateWhereItIsWorseThanItsTargetForWantOfAChunk) {
    FrameRecord frame = make_frame(0);
    frame.max_error_px = 1.0;
    frame.error_px = 1.5;
    frame.paging.late_chunks = 3;
    EXPECT_FALSE(frame.is_late()) << "the budget stopped it";
    EXPECT_EQ(frame.excess_error_px(), 0.5);
    frame.status = MeshStatus::not_resident;
    EXPECT_TRUE(frame.is_late());
    frame.error_px = 1.0;
    EXPECT_FALSE(frame.is_late()) << "nobody sees what is absent";
    EXPECT_EQ(frame.excess_error_px(), 0.0);
    frame.triangles = 0;
    EXPECT_TRUE(frame.is_late()) << "nobody sees anything";
}

TEST(FlightLog, ExcessErrorIsCountedInPixelSeconds) {
    std::vector<FrameRecord> frames(3);
    frames[0].error_px = 1.5;
    frames[1].error_px = 0.5;
    frames[2].error_px = 3.0;
    EXPECT_DOUBLE_EQ(excess_error_px_s(frames, 50.0), 0.05);
    EXPECT_DOUBLE_EQ(summarize(frames, 1, 50.0)["excess_error_px_s"].get<double>(), 0.05);
    EXPECT_EQ(excess_error_px_s({}, 50.0), 0.0);
}

}  // namespace report_test
}  // namespace terrane::tools
