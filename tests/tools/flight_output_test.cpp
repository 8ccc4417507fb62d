// SPDX-License-Identifier: MIT
#include "flight/film.h"
#include "flight/report.h"
#include "lab/paging_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace terrane::tools {
namespace film_test {

namespace fs = std::filesystem;

class FilmTest : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::path(TERRANE_BUILD_DIR) / "test_films" /
                  testing::UnitTest::GetInstance()->current_test_info()->name();
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }

    std::string at(const std::string& name) const { return (folder_ / name).string(); }
    Film begin() const { return Film::create(at("flight.mp4"), 64, 48, 24.0).value(); }

    // Names of the files in the test's folder.
    std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const fs::directory_entry& entry : fs::directory_iterator(folder_)) {
            names.push_back(entry.path().filename().string());
        }
        return names;
    }

    fs::path folder_;
};

/// With ffmpeg.
class RealFilm : public FilmTest {
protected:
    void SetUp() override {
        FilmTest::SetUp();
        if (std::system("ffmpeg -version >/dev/null 2>&1") != 0)
            GTEST_SKIP() << "ffmpeg is not installed";
    }
};

Image make_frame(int width, int height, int index) {
    Image image;
    image.width = width;
    image.height = height;
    for (int i = 0; i < width * height; ++i) {
        for (const int value : {i % width * 3, i / width * 3, index * 20}) {
            image.rgb.push_back(static_cast<std::uint8_t>(value & 255));
        }
    }
    return image;
}

// Number of frames that ffprobe finds.
int count_frames(const std::string& path) {
    const std::string command =
        "ffprobe -v error -count_frames -select_streams v:0 -show_entries stream=nb_read_frames "
        "-of csv=p=0 \"" +
        path + "\"";
    std::FILE* pipe = popen(command.c_str(), "r");
    if (pipe == nullptr) return -1;
    int count = -1;
    if (std::fscanf(pipe, "%d", &count) != 1) count = -1;
    pclose(pipe);
    return count;
}

TEST_F(RealFilm, HoldsEveryFrameAndAppearsOnlyWhenItIsWhole) {
    Film film = begin();
    for (int i = 0; i < 12; ++i) {
        const Result<void> added = film.add(make_frame(64, 48, i));
        ASSERT_TRUE(added) << added.error().message;
        EXPECT_FALSE(fs::exists(at("flight.mp4")));
    }
    // a frame of another size is refused, and the film goes on
    const Result<void> added = film.add(make_frame(48, 64, 1));
    ASSERT_FALSE(added);
    EXPECT_EQ(added.error().code, ErrorCode::invalid_argument);
    const Result<void> finished = film.finish();
    ASSERT_TRUE(finished) << finished.error().message;
    EXPECT_EQ(film.frame_count(), 12u);
    EXPECT_EQ(count_frames(at("flight.mp4")), 12);
    EXPECT_EQ(files(), std::vector<std::string>{"flight.mp4"});
}

TEST_F(RealFilm, AFilmThatIsNotFinishedOrHasNoFrameLeavesNothing) {
    {
        Film film = begin();
        for (int i = 0; i < 60; ++i) ASSERT_TRUE(film.add(make_frame(64, 48, i)));
    }
    EXPECT_EQ(files(), std::vector<std::string>{});
    Film empty = begin();
    EXPECT_FALSE(empty.finish());
    EXPECT_FALSE(empty.finish());
    EXPECT_EQ(files(), std::vector<std::string>{});
}

TEST_F(RealFilm, FileNamesAreNeverReadAsShellTextOrOptions) {
    for (const std::string name : {"-y; touch x.mp4", "a $(touch x) 'b' %d.mp4", "c:d|e.mp4"}) {
        Result<Film> film = Film::create(at(name), 16, 16, 25.0);
        ASSERT_TRUE(film) << film.error().message;
        ASSERT_TRUE(film->add(make_frame(16, 16, 0)));
        const Result<void> finished = film->finish();
        ASSERT_TRUE(finished) << finished.error().message;
        EXPECT_TRUE(fs::exists(folder_ / name)) << name;
    }
    EXPECT_EQ(files().size(), 3u);
}

TEST_F(FilmTest, SizesAndRatesThatCannotBeAreRefusedWithTheirValue) {
    for (const auto& [width, height] :
         {std::pair{0, 10}, std::pair{-2, 10}, std::pair{63, 48}, std::pair{64, 47}}) {
        const Result<Film> film = Film::create(at("flight.mp4"), width, height, 24.0);
        ASSERT_FALSE(film);
        EXPECT_EQ(film.error().code, ErrorCode::invalid_argument);
        EXPECT_NE(film.error().message.find(std::to_string(width)), std::string::npos);
    }
    for (const double rate : {0.0, -1.0, 1001.0, std::numeric_limits<double>::quiet_NaN()}) {
        const Result<Film> film = Film::create(at("flight.mp4"), 64, 48, rate);
        ASSERT_FALSE(film);
        EXPECT_EQ(film.error().code, ErrorCode::invalid_argument);
    }
    EXPECT_EQ(files(), std::vector<std::string>{});
}

TEST_F(RealFilm, AnUnwritablePathIsAnErrorThatNamesItNotASignal) {
    const std::string path = at("no_such_folder/flight.mp4");
    Result<Film> film = Film::create(path, 640, 480, 24.0);
    std::optional<Error> error;
    if (!film) error = film.error();
    // more than the buffers between the processes hold
    for (int i = 0; i < 20 && !error; ++i) {
        if (const Result<void> added = film->add(make_frame(640, 480, i)); !added) {
            error = added.error();
        }
    }
    ASSERT_TRUE(error);
    EXPECT_EQ(error->code, ErrorCode::io);
    EXPECT_NE(error->message.find(path), std::string::npos) << error->message;
    EXPECT_EQ(error->message.find('\n'), std::string::npos);
    // the failure is permanent
    if (film) {
        EXPECT_FALSE(film->add(make_frame(640, 480, 0)));
        EXPECT_FALSE(film->finish());
    }
}

// Replaces ffmpeg by a script, for its lifetime.
class FakeFfmpeg {
public:
    FakeFfmpeg(const fs::path& folder, const std::string& script) {
        fs::create_directories(folder);
        std::ofstream(folder / "ffmpeg") << "#!/bin/sh\n" << script << "\n";
        fs::permissions(folder / "ffmpeg", fs::perms::owner_all);
        const char* path = std::getenv("PATH");
        kept_ = path == nullptr ? "" : path;
        setenv("PATH", (folder.string() + ":" + kept_).c_str(), 1);
    }
    FakeFfmpeg(const FakeFfmpeg&) = delete;
    FakeFfmpeg& operator=(const FakeFfmpeg&) = delete;
    ~FakeFfmpeg() { setenv("PATH", kept_.c_str(), 1); }

private:
    std::string kept_;
};

TEST_F(FilmTest, AnFfmpegThatReadsNothingOrNeverExitsTimesOut) {
    for (const char* script : {"exec sleep 1000", "cat >/dev/null; exec sleep 1000"}) {
        SCOPED_TRACE(script);
        const FakeFfmpeg fake(folder_ / "bin", script);
        Result<Film> film = Film::create(at("flight.mp4"), 640, 480, 24.0, 1);
        ASSERT_TRUE(film) << film.error().message;
        Result<void> done;
        for (int i = 0; i < 20 && done; ++i) done = film->add(make_frame(640, 480, i));
        if (done) done = film->finish();
        ASSERT_FALSE(done);
        EXPECT_NE(done.error().message.find("nothing for 1 s"), std::string::npos)
            << done.error().message;
        EXPECT_EQ(files(), std::vector<std::string>{"bin"});
    }
}

TEST_F(RealFilm, AFileWithTheNameOfAPartIsLeftAlone) {
    const std::array names{"flight.mp4.part.mp4", "flight.mp4.partial"};
    for (const char* name : names) std::ofstream(at(name)) << "mine";
    Film film = begin();
    ASSERT_TRUE(film.add(make_frame(64, 48, 0)));
    ASSERT_TRUE(film.finish());
    for (const char* name : names) EXPECT_EQ(fs::file_size(at(name)), 4u) << name;
    EXPECT_EQ(files().size(), 3u);
}

TEST_F(FilmTest, WithoutFfmpegTheErrorSaysSo) {
    const char* path = std::getenv("PATH");
    const std::string kept = path == nullptr ? "" : path;
    setenv("PATH", folder_.c_str(), 1);
    const Result<Film> film = Film::create(at("flight.mp4"), 64, 48, 24.0);
    setenv("PATH", kept.c_str(), 1);
    ASSERT_FALSE(film);
    EXPECT_EQ(film.error().code, ErrorCode::io);
    EXPECT_NE(film.error().message.find("ffmpeg"), std::string::npos) << film.error().message;
}

}  // namespace film_test

namespace report_test {

std::string read(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::string fresh_folder() {
    const std::string path = testing::TempDir() + "report_" +
                             testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(path);
    std::filesystem::create_directories(path);
    return path;
}

using Json = nlohmann::ordered_json;

// A report as a browser takes it: the object of its data element, which ends with the first closing tag, and the text
// of the page.
struct Page {
    explicit Page(const std::string& path) : text(read(path)) {
        const std::string open = "<script id=\"data\" type=\"application/json\">";
        const std::size_t begin = text.find(open) + open.size();
        data = Json::parse(text.substr(begin, text.find("</script", begin) - begin));
        EXPECT_TRUE(has("Chart.js v3"));
        for (const char* unwanted : {"http:", "https:", "src=\"//", "{{"})
            EXPECT_FALSE(has(unwanted)) << unwanted;
    }
    bool has(std::string_view part) const { return text.find(part) != std::string::npos; }

    std::string text;
    Json data;
};

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
                        .summary = summarize(log->frames(), std::size_t{1} << 27, 30.0)};
    header.summary["terrain"] = "</script><script>alert(1)</script>";
    const std::string path = folder + "/report.html";
    ASSERT_TRUE(write_flight_report(path, header, *log, std::size_t{1} << 27));
    const Page page(path);
    for (std::size_t i = 0; i < 10; ++i) {
        EXPECT_EQ(page.data["triangles"][i], 1000.0 + static_cast<double>(i));
        EXPECT_EQ(page.data["extra"][0]["values"][i], 123.0 + static_cast<double>(i));
    }
    EXPECT_EQ(page.data["extra"][0]["title"], "Speed, m/s");
    EXPECT_EQ(page.data["budget"], 1500);
    EXPECT_EQ(page.data["ceiling"], 128.0);
    EXPECT_EQ(page.data["summary"]["late_frames"], 1);
    EXPECT_EQ(page.data["summary"]["terrain"], header.summary["terrain"]);
    const Json error{"Certified screen error (most), px", "0.79", "", "error_px_max"};
    EXPECT_EQ(std::count(page.data["rows"].begin(), page.data["rows"].end(), error), 1)
        << "words, and four digits: " << page.data["rows"];
    EXPECT_TRUE(page.has("terrane fly --dem 'a b.tif'"));
    EXPECT_FALSE(page.has("<b>\"A")) << "an unescaped title";
    EXPECT_FALSE(page.has("alert(1)</script>")) << "an unescaped value";
}

TEST(Report, ShowsAFilmWhereThereIsOne) {
    const std::string folder = fresh_folder();
    Result<FlightLog> log = FlightLog::create(std::nullopt);
    ASSERT_TRUE(log);
    ASSERT_TRUE(log->add(make_frame(0)));
    const ReportHeader header{"t", "c", "flight.mp4", summarize(log->frames(), 1, 30.0)};
    ASSERT_TRUE(write_flight_report(folder + "/report.html", header, *log, 1));
    EXPECT_NE(read(folder + "/report.html").find("src=\"flight.mp4\""), std::string::npos);
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
    std::vector<PagingRow> rows{make_row(PagingChoice::deadline, 3),
                                make_row(PagingChoice::distance, 0),
                                make_row(PagingChoice::oracle, 0)};
    rows[1].radius = 2.0;
    const ReportHeader header{
        .title = "Paging over <seed>", .command_line = "terrane page", .summary = {{"flights", 3}}};
    const std::string path = folder + "/report.html";
    ASSERT_TRUE(write_paging_report(path, header, rows));
    const Page page(path);
    const Json& cell = page.data["cells"].at(0);
    ASSERT_EQ(page.data["cells"].size(), 1u);
    ASSERT_EQ(cell["runs"].size(), 3u);
    EXPECT_EQ(cell["runs"]["deadline"]["late_frames"], 3);
    EXPECT_EQ(cell["runs"]["distance"]["radius"], 2.0);
    EXPECT_EQ(cell["late_ratio"], "inf");
    EXPECT_TRUE(cell["excess_ratio"].is_null());
    EXPECT_EQ(cell["missed"], Json{"late_frames"});
    EXPECT_EQ(cell["errors"]["deadline"].size(), 10u);
    EXPECT_EQ(cell["errors"]["deadline"][1], 0.71);
    EXPECT_TRUE(page.has("Paging over &lt;seed&gt;"));
    EXPECT_FALSE(write_paging_report("/no/such/folder/report.html", header, rows));
}

TEST(PagingReport, DrawsErrorsOfAFewCellsOnly) {
    const std::string folder = fresh_folder();
    std::vector<PagingRow> rows;
    for (std::size_t i = 0; i <= kMostPlottedCells; ++i) {
        rows.push_back(make_row(PagingChoice::deadline, 0));
        rows.back().cell.memory_mb = 64.0 + static_cast<double>(i);
    }
    const std::string path = folder + "/report.html";
    ASSERT_TRUE(write_paging_report(path, {}, rows));
    EXPECT_FALSE(Page(path).data["cells"][0].contains("time"));
    rows.pop_back();
    ASSERT_TRUE(write_paging_report(path, {}, rows));
    EXPECT_EQ(Page(path).data["cells"][0]["time"].size(), 10u);
}

TEST(FlightLog, WritesTheColumnsThatScriptsReadAndOnlyWhenWhole) {
    const std::string folder = fresh_folder();
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
    frames[0].status = MeshStatus::budget_reached;
    frames[2].status = MeshStatus::not_resident;
    const auto summary = summarize(frames, 1, 50.0);
    EXPECT_DOUBLE_EQ(summary["excess_error_px_s"].get<double>(), 0.05);
    EXPECT_DOUBLE_EQ(summary["late_excess_error_px_s"].get<double>(), 0.04);
    EXPECT_EQ(add_up_excess_error({}, 50.0).all_px_s, 0.0);
}

}  // namespace report_test
}  // namespace terrane::tools
