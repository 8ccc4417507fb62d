// SPDX-License-Identifier: MIT
#include <terrane/playback/track.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace terrane {
namespace track_test {

class TrackTest : public testing::Test {
protected:
    std::string write(const std::string& name, const std::string& text) {
        const std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();
        const std::string path = testing::TempDir() + "track_" + test + "_" + name;
        std::ofstream(path, std::ios::binary) << text;
        return path;
    }

    // The error message for a file; "" where it is read.
    std::string refusal(const std::string& name, const std::string& text,
                        const GeoReference& reference = {}) {
        const Result<Track> track = read_track(write(name, text), reference);
        return track ? "" : track.error().message;
    }

    static GeoReference degrees() {
        GeoReference reference;
        reference.is_geographic = true;
        reference.longitude = 12.5;
        reference.latitude = 41.5;
        reference.metres_per_degree_x = 80'000.0;
        reference.metres_per_degree_y = 111'000.0;
        return reference;
    }
};

std::string gpx(const std::string& points) {
    return "<?xml version=\"1.0\"?>\n<gpx xmlns=\"urn:gpx\"><trk><trkseg>\n" + points +
           "</trkseg></trk></gpx>\n";
}

TEST_F(TrackTest, ReadsColumnsByName) {
    const Result<Track> track =
        read_track(write("a.csv", "note,y_m,time_s,x_m,z_m\nhello,2,10,1,3\nthere,5,12.5,4,6\n"));
    ASSERT_TRUE(track) << track.error().message;
    ASSERT_EQ(track->points.size(), 2u);
    EXPECT_TRUE(track->has_times);
    EXPECT_TRUE(track->has_heights);
    EXPECT_FALSE(track->is_recorded);
    EXPECT_EQ(track->points[0].time, 0.0);
    EXPECT_EQ(track->points[1].time, 2.5);
    EXPECT_EQ(track->points[1].position_world, WorldPos(4, 5, 6));
}

TEST_F(TrackTest, ReadsAFlightsOwnFrames) {
    const Result<Track> track = read_track(write(
        "frames.csv", "time_s,eye_x_m,eye_y_m,eye_z_m,triangles\r\n0,1,2,3,9\r\n1,4,5,6,9\r\n"));
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_EQ(track->points[0].position_world, WorldPos(1, 2, 3));
}

TEST_F(TrackTest, TimesAndHeightsMayBeAbsent) {
    const Result<Track> track = read_track(write("a.csv", "x_m,y_m\n0,0\n\n# half way\n3,4\n"));
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_FALSE(track->has_times);
    EXPECT_FALSE(track->has_heights);
    EXPECT_EQ(track->points.size(), 2u);
}

TEST_F(TrackTest, PointsOfOneTimeBecomeTheirMean) {
    const Result<Track> track = read_track(write("a.csv", "0,0,0,0\n1,2,2,2\n1,4,6,8\n2,9,9,9\n"));
    ASSERT_TRUE(track) << track.error().message;
    ASSERT_EQ(track->points.size(), 3u);
    EXPECT_EQ(track->points[1].position_world, WorldPos(3, 4, 5));
}

TEST_F(TrackTest, FaultsAreNamedByTheirLine) {
    struct Fault {
        std::string name, text, line;
    };
    const std::string head = "time_s,x_m,y_m\n0,1,2\n",
                      fix = "B1123184135458N01257432EA0033200445\n";
    for (const auto& [name, text, line] : {
             Fault{"a.csv", head + "1,abc,3\n", "line 3"},
             Fault{"a.csv", head + "1,nan,3\n", "line 3"},
             Fault{"a.csv", head + "1,1e999,3\n", "line 3"},
             Fault{"a.csv", head + "1,3\n", "line 3"},
             Fault{"a.csv", "time_s,x_m,y_m\n5,1,2\n4,3,3\n", "line 3"},  // back in time
             Fault{"a.csv", "time_s,x_m\n0,1\n1,2\n", "line "},           // no y_m
             Fault{"a.csv", "1,2\n3,4\n", "line "},                       // no header
             Fault{"a.gpx", gpx("<trkpt lat=\"north\" lon=\"12\"></trkpt>"), "line 3"},
             Fault{"a.gpx", gpx("<trkpt lat=\"41\"></trkpt>"), "line 3"},
             Fault{"a.gpx", gpx("<trkpt lat=\"91\" lon=\"12\"/><trkpt lat=\"41\" lon=\"12\"/>"),
                   "line 3"},
             Fault{"a.gpx", gpx("<trkpt lat=\"41\" lon=\"12\"><ele>high</ele></trkpt>"), "line 3"},
             Fault{"a.gpx", gpx("<trkpt lat=\"41\" lon=\"12\"><time>noon</time></trkpt>"),
                   "line 3"},
             Fault{"a.gpx", gpx("<trkpt lat=\"41\" lon=\"12\">"), "line 3"},
             Fault{"a.igc", fix + "B11231\n", "line 2"},
             Fault{"a.igc", fix + "B9923184135458N01257432EA0033200445\n", "line 2"},
             Fault{"a.igc", fix + "B1123184135458X01257432EA0033200445\n", "line 2"},
             Fault{"a.igc", fix + "B11231841354?8N01257432EA0033200445\n", "line 2"},
             Fault{"a.igc", fix + "B1123184135457N01257432EA00x3200445\n", "line 2"},
             Fault{"a.tum", "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 2\n", "line 2"},
             Fault{"a.tum", "0 0 0 0 0 0 1\n", "line 1"},
         }) {
        const std::string message = refusal(name, text, degrees());
        EXPECT_NE(message.find(name + ": " + line), std::string::npos) << text << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << text;
    }
    EXPECT_NE(refusal("a.csv", head + "1,abc,3\n").find("'abc'"), std::string::npos);
}

TEST_F(TrackTest, EmptyTracksAreRefused) {
    for (const char* text : {"", "\n\n", "x_m,y_m\n", "x_m,y_m\n1,2\n"}) {
        EXPECT_NE(refusal("a.csv", text), "") << text;
    }
    const GeoReference reference = degrees();
    EXPECT_NE(refusal("a.gpx", gpx(""), reference), "");
    EXPECT_NE(refusal("a.gpx", "", reference), "");
    EXPECT_NE(refusal("a.igc", "AXYZ\n", reference), "");
    EXPECT_NE(refusal("a.tum", "# nothing\n"), "");
}

TEST_F(TrackTest, MissingFilesFoldersAndOtherFormatsAreErrors) {
    const Result<Track> missing = read_track("/no/such/track.csv");
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::io);
    EXPECT_NE(missing.error().message.find("/no/such/track.csv"), std::string::npos);
    const std::string folder = testing::TempDir() + "track_folder.csv";
    std::filesystem::create_directory(folder);
    EXPECT_FALSE(read_track(folder));
    EXPECT_FALSE(read_track(write("a.kml", "<kml/>")));
}

TEST_F(TrackTest, NumbersTooLargeToSubtractOrToAddAreRefused) {
    EXPECT_NE(refusal("far.csv", "-1e308,0,0,0\n1e308,1,1,1\n").find("point 1"), std::string::npos);
    EXPECT_NE(refusal("near.csv", "-1e20,0,0,0\n0,1,1,1\n1,2,2,2\n").find("must be later"),
              std::string::npos);
    EXPECT_NE(refusal("mean.csv", "0,0,0,0\n1,1e308,0,0\n1,1e308,0,0\n").find("finite position"),
              std::string::npos);
}

TEST_F(TrackTest, GpxPointsAreProjectedByTheRaster) {
    const GeoReference reference = degrees();
    const std::string text =
        gpx("<trkpt lat=\"41.5\" lon=\"12.5\"><ele> 100.5 </ele><time>2008-02-29T23:59:59Z</time>"
            "<extensions><time>no</time></extensions></trkpt>\n"
            "<trkpt lat=\"41.6\" lon=\"12.4\"><ele>200</ele>"
            "<time>2008-03-01T01:00:01.5+01:00</time></trkpt>\n");
    const Result<Track> track = read_track(write("a.gpx", text), reference);
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_TRUE(track->is_recorded);
    ASSERT_TRUE(track->has_times);
    ASSERT_TRUE(track->has_heights);
    EXPECT_EQ(track->points[0].position_world, WorldPos(0.0, 0.0, 100.5));
    EXPECT_NEAR(track->points[1].position_world.x(), -8'000.0, 1e-6);
    EXPECT_NEAR(track->points[1].position_world.y(), 11'100.0, 1e-6);
    EXPECT_NEAR(track->points[1].time, 2.5, 1e-6);
}

TEST_F(TrackTest, PlacesOnTheEarthNeedARasterInDegrees) {
    const std::string text = gpx("<trkpt lat=\"1\" lon=\"2\"/><trkpt lat=\"1\" lon=\"3\"/>");
    EXPECT_NE(refusal("a.gpx", text).find("no raster"), std::string::npos);
    GeoReference projected;
    projected.why_not = "this raster's CRS is WGS 84 / UTM zone 11N";
    EXPECT_NE(refusal("a.gpx", text, projected).find("UTM zone 11N"), std::string::npos);
}

TEST_F(TrackTest, IgcFixesCrossMidnight) {
    const GeoReference reference = degrees();
    const Result<Track> track = read_track(write("a.igc",
                                                 "AXXX\r\nHFDTE090319\r\n"
                                                 "B2359584130000N01230000EA0033200445\r\n"
                                                 "B0000014136000S01224000WA-033200447extra\r\n"),
                                           reference);
    ASSERT_TRUE(track) << track.error().message;
    ASSERT_EQ(track->points.size(), 2u);
    EXPECT_NEAR(track->points[0].position_world.x(), 0.0, 1e-6);
    EXPECT_NEAR(track->points[0].position_world.y(), 0.0, 1e-6);
    EXPECT_EQ(track->points[0].position_world.z(), 445.0);
    EXPECT_NEAR(track->points[1].position_world.x(), (-12.4 - 12.5) * 80'000.0, 1e-6);
    EXPECT_NEAR(track->points[1].position_world.y(), (-41.6 - 41.5) * 111'000.0, 1e-6);
    EXPECT_EQ(track->points[1].time, 3.0);
}

TEST_F(TrackTest, IgcWithoutGnssAltitudesUsesPressure) {
    const GeoReference reference = degrees();
    const Result<Track> track = read_track(write("a.igc",
                                                 "B1000004130000N01230000EV0033200000\n"
                                                 "B1000014130000N01230000EV-001000000\n"),
                                           reference);
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_EQ(track->points[0].position_world.z(), 332.0);
    EXPECT_EQ(track->points[1].position_world.z(), -10.0);
}

TEST_F(TrackTest, TumRotationsTurnTheCamerasAxes) {
    // camera x right, y down, z forward: half a turn about x + ... looks north with up upward
    const double h = std::sqrt(0.5);
    const std::string quarter = std::to_string(-h) + " 0 0 " + std::to_string(h);
    const Result<Track> track = read_track(write(
        "a.tum", "# time x y z qx qy qz qw\n5 1 2 3 " + quarter + "\n6 1 3 3 " + quarter + "\n"));
    ASSERT_TRUE(track) << track.error().message;
    ASSERT_TRUE(track->has_orientations);
    EXPECT_LT((track->points[0].forward - Eigen::Vector3d(0, 1, 0)).norm(), 1e-5);
    EXPECT_LT((track->points[0].up - Eigen::Vector3d(0, 0, 1)).norm(), 1e-5);
}

std::string data_folder() {
    const char* set = std::getenv("TERRANE_DATA");
    return set != nullptr ? set : TERRANE_SOURCE_DIR "/../shared/data";
}

TEST_F(TrackTest, RealRecordingsAreReadWhole) {
    const std::string folder = data_folder() + "/tracks/";
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no tracks in " << folder;
    const GeoReference reference = degrees();
    const Result<Track> flight = read_track(folder + "norma_paraglider.igc", reference);
    ASSERT_TRUE(flight) << flight.error().message;
    EXPECT_GT(flight->points.size(), 14'000u);
    const Result<Track> drive = read_track(folder + "rome_mtk_logger_m241.gpx", reference);
    ASSERT_TRUE(drive) << drive.error().message;
    EXPECT_GT(drive->points.size(), 1'100u);
    EXPECT_TRUE(drive->has_times);
    EXPECT_TRUE(drive->has_heights);
}

}  // namespace track_test
}  // namespace terrane
