// SPDX-License-Identifier: MIT
#include "flight/film.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>

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

bool has_ffmpeg() { return std::system("ffmpeg -version >/dev/null 2>&1") == 0; }

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

TEST_F(FilmTest, HoldsEveryFrameAndAppearsOnlyWhenItIsWhole) {
    if (!has_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
    const std::string path = at("flight.mp4");
    Result<Film> film = Film::create(path, 64, 48, 24.0);
    ASSERT_TRUE(film) << film.error().message;
    for (int i = 0; i < 12; ++i) {
        const Result<void> added = film->add(make_frame(64, 48, i));
        ASSERT_TRUE(added) << added.error().message;
        EXPECT_FALSE(fs::exists(path));
    }
    const Result<void> finished = film->finish();
    ASSERT_TRUE(finished) << finished.error().message;
    EXPECT_EQ(film->frame_count(), 12u);
    EXPECT_EQ(count_frames(path), 12);
    EXPECT_EQ(files(), std::vector<std::string>{"flight.mp4"});
}

TEST_F(FilmTest, AFilmThatIsNotFinishedLeavesNothing) {
    if (!has_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
    {
        Result<Film> film = Film::create(at("flight.mp4"), 64, 48, 24.0);
        ASSERT_TRUE(film) << film.error().message;
        for (int i = 0; i < 60; ++i) ASSERT_TRUE(film->add(make_frame(64, 48, i)));
    }
    EXPECT_EQ(files(), std::vector<std::string>{});
}

TEST_F(FilmTest, FileNamesAreNeverReadAsShellTextOrOptions) {
    if (!has_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
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

TEST_F(FilmTest, AFrameOfAnotherSizeIsRefusedAndTheFilmGoesOn) {
    if (!has_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
    Result<Film> film = Film::create(at("flight.mp4"), 64, 48, 24.0);
    ASSERT_TRUE(film) << film.error().message;
    ASSERT_TRUE(film->add(make_frame(64, 48, 0)));
    const Result<void> added = film->add(make_frame(48, 64, 1));
    ASSERT_FALSE(added);
    EXPECT_EQ(added.error().code, ErrorCode::invalid_argument);
    ASSERT_TRUE(film->finish());
    EXPECT_EQ(count_frames(at("flight.mp4")), 1);
}

TEST_F(FilmTest, AFilmWithoutFramesIsAnErrorAndLeavesNothing) {
    if (!has_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
    Result<Film> film = Film::create(at("flight.mp4"), 64, 48, 24.0);
    ASSERT_TRUE(film) << film.error().message;
    EXPECT_FALSE(film->finish());
    EXPECT_FALSE(film->finish());
    EXPECT_EQ(files(), std::vector<std::string>{});
}

TEST_F(FilmTest, AnUnwritablePathIsAnErrorThatNamesItNotASignal) {
    if (!has_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
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

TEST_F(FilmTest, AnFfmpegThatReadsNothingTimesOut) {
    const FakeFfmpeg fake(folder_ / "bin", "exec sleep 1000");
    Result<Film> film = Film::create(at("flight.mp4"), 640, 480, 24.0, 1);
    ASSERT_TRUE(film) << film.error().message;
    Result<void> added;
    for (int i = 0; i < 20 && added; ++i) added = film->add(make_frame(640, 480, i));
    ASSERT_FALSE(added);
    EXPECT_NE(added.error().message.find("nothing for 1 s"), std::string::npos)
        << added.error().message;
    EXPECT_EQ(files(), std::vector<std::string>{"bin"});
}

TEST_F(FilmTest, AnFfmpegThatNeverExitsTimesOut) {
    const FakeFfmpeg fake(folder_ / "bin", "cat >/dev/null; exec sleep 1000");
    Result<Film> film = Film::create(at("flight.mp4"), 64, 48, 24.0, 1);
    ASSERT_TRUE(film) << film.error().message;
    ASSERT_TRUE(film->add(make_frame(64, 48, 0)));
    const Result<void> finished = film->finish();
    ASSERT_FALSE(finished);
    EXPECT_NE(finished.error().message.find("nothing for 1 s"), std::string::npos)
        << finished.error().message;
    EXPECT_EQ(files(), std::vector<std::string>{"bin"});
}

TEST_F(FilmTest, AFileWithTheNameOfAPartIsLeftAlone) {
    if (!has_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
    for (const char* name : {"flight.mp4.part.mp4", "flight.mp4.partial"}) {
        std::ofstream(at(name)) << "mine";
    }
    Result<Film> film = Film::create(at("flight.mp4"), 64, 48, 24.0);
    ASSERT_TRUE(film) << film.error().message;
    ASSERT_TRUE(film->add(make_frame(64, 48, 0)));
    ASSERT_TRUE(film->finish());
    for (const char* name : {"flight.mp4.part.mp4", "flight.mp4.partial"}) {
        EXPECT_EQ(fs::file_size(at(name)), 4u) << name;
    }
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
}  // namespace terrane::tools
