// SPDX-License-Identifier: MIT
#include <terrane/playback/track.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

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
                        const TrackReference& reference = {}) {
        const Result<Track> track = read_track(write(name, text), reference);
        return track ? "" : track.error().message;
    }

    static TrackReference degrees() {
        TrackReference reference;
        reference.world_from_lonlat = [](const Eigen::Vector3d& lonlat) {
            return WorldPos((lonlat.x() - 12.5) * 80'000.0, (lonlat.y() - 41.5) * 111'000.0,
                            lonlat.z());
        };
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
        std::string place = name;
        place.append(": ").append(line);
        EXPECT_NE(message.find(place), std::string::npos) << text << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << text;
    }
    EXPECT_NE(refusal("a.csv", head + "1,abc,3\n").find("'abc'"), std::string::npos);
}

TEST_F(TrackTest, EmptyTracksAreRefused) {
    for (const char* text : {"", "\n\n", "x_m,y_m\n", "x_m,y_m\n1,2\n"}) {
        EXPECT_NE(refusal("a.csv", text), "") << text;
    }
    const TrackReference reference = degrees();
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
    const TrackReference reference = degrees();
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

TEST_F(TrackTest, TimesThatGoBackAreTellableApart) {
    const std::string gpx_times =
        gpx("<trkpt lat=\"41.5\" lon=\"12.5\"><time>2020-05-04T12:01:00Z</time></trkpt>\n"
            "<trkpt lat=\"41.5\" lon=\"12.6\"><time>2020-05-04T12:00:00Z</time></trkpt>\n");
    EXPECT_NE(refusal("a.gpx", gpx_times, degrees())
                  .find("line 4: time goes back by 60 s, from 1588593660 to 1588593600 s"),
              std::string::npos);
    EXPECT_NE(refusal("a.csv", "1588593660.25,0,0,0\n1588593660,1,1,1\n")
                  .find("by 0.25 s, from 1588593660.25 to 1588593660 s"),
              std::string::npos);
    const Track late{.points = {{.time = 0.0}, {.time = 12345678.5}, {.time = 12345678.25}},
                     .has_times = true,
                     .note = ""};
    EXPECT_NE(late.validate().error().message.find("at 12345678.5 s, got 12345678.25 s"),
              std::string::npos);
}

TEST_F(TrackTest, GpxIsReadInEveryEncodingOfOneByteAndInUtf16) {
    const std::string points =
        "<trkpt lat=\"41.5\" lon=\"12.5\"><ele>7</ele></trkpt><trkpt lat=\"41.6\" lon=\"12.5\"/>";
    const auto text = [&](const std::string& encoding, const std::string& name) {
        return "<?xml version=\"1.0\" encoding=\"" + encoding + "\"?>\n<gpx><trk><name>" + name +
               "</name><trkseg>" + points + "</trkseg></trk></gpx>";
    };
    const std::string cafe = "Caf\xe9 \x80\xff";
    std::vector<std::string> texts{"\xef\xbb\xbf" + text("UTF-8", "Caf\xc3\xa9")};
    for (const char* encoding : {"windows-1252", "Windows-1251", "CP1250", "ISO-8859-1",
                                 "iso-8859-15", "KOI8-R", "IBM850", "macintosh"}) {
        texts.push_back(text(encoding, cafe));
    }
    std::string wide = "\xff\xfe";
    for (const char c : text("UTF-16", "Cafe")) wide.append(1, c).append(1, '\0');
    texts.push_back(wide);
    for (const std::string& each : texts) {
        const Result<Track> track = read_track(write("a.gpx", each), degrees());
        ASSERT_TRUE(track) << track.error().message;
        EXPECT_EQ(track->points.size(), 2u);
        EXPECT_EQ(track->points[0].position_world.z(), 7.0);
    }
    EXPECT_NE(refusal("a.gpx", text("Shift_JIS", "a"), degrees())
                  .find("line 1: the encoding 'Shift_JIS' is not known; known are UTF-8, UTF-16"),
              std::string::npos);
    EXPECT_NE(refusal("a.gpx", text("UTF-16", "a"), degrees())
                  .find("line 1: the file is not in the encoding 'UTF-16' that it declares"),
              std::string::npos);
    for (const char* name : {"a.csv", "a.igc", "a.tum"})
        EXPECT_NE(refusal(name, wide, degrees()).find("is UTF-16 text"), std::string::npos);
}

TEST_F(TrackTest, AFileWithoutATrackSaysWhatItHasInstead) {
    const auto refused = [&](const std::string& name, const std::string& text,
                             const std::string& said) {
        const std::string message = refusal(name, text, degrees());
        EXPECT_NE(message.find("a track needs two points or more, got 0: " + said),
                  std::string::npos)
            << message;
    };
    refused("a.gpx",
            "<gpx><rte><rtept lat=\"41.5\" lon=\"12.5\"/><rtept lat=\"41.6\" "
            "lon=\"12.5\"/></rte></gpx>",
            "it has a route of 2 points (rtept), and no track (trkpt)");
    refused("a.gpx", "<gpx><wpt lat=\"41.5\" lon=\"12.5\"/></gpx>",
            "it has 1 waypoints (wpt), and no track (trkpt)");
    refused("a.gpx", gpx(""), "it has no track (trkpt)");
    refused("a.gpx", "<kml><Document/></kml>", "its root element is 'kml' and not 'gpx'");
    refused("a.igc", "AXYZ\nHFDTE010120\n", "it has no fixes (B records)");
    EXPECT_NE(refusal("a.csv", "time_s;x_m;y_m\n0;1;2\n").find("separated by commas"),
              std::string::npos);
}

TEST_F(TrackTest, ColumnsThatAreNotReadAreNamedWhereTimesOrHeightsAreMissing) {
    const auto note = [&](const std::string& header) {
        return read_track(write("a.csv", header + "\n0,1,2,3\n1,2,3,4\n")).value().note;
    };
    const auto ends_with = [&](const std::string& header, const std::string& end) {
        EXPECT_TRUE(note(header).ends_with(end)) << note(header);
    };
    ends_with("timestamp,x_m,y_m,alt",
              "a.csv: no column is named time_s or z_m; not read: 'timestamp', 'alt'");
    ends_with("time_ms,x_m,y_m,z_m", "a.csv: no column is named time_s; not read: 'time_ms'");
    ends_with("time_s,x_m,y_m,altitude", "a.csv: no column is named z_m; not read: 'altitude'");
    EXPECT_EQ(note("TIME_S,X_M,Y_M,Z_M"), "");
}

// Files that other programs write, under their own extension and under each that is read.
TEST_F(TrackTest, ForeignFilesAreRefusedInOneLine) {
    const std::string fix = "$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n";
    const std::string fit("\x0e\x10\x43\x08\x78\x06\0\0.FIT\x40\0\0\0\0\x01\xff\xfe", 20);
    const std::vector<std::pair<std::string, std::string>> files{
        {"tcx",
         "<?xml version=\"1.0\"?>\n<TrainingCenterDatabase><Activities><Activity Sport=\"Biking\">"
         "<Lap><Track><Trackpoint><Time>2024-05-01T10:00:00Z</Time><Position><LatitudeDegrees>41.5"
         "</LatitudeDegrees><LongitudeDegrees>12.5</LongitudeDegrees></Position></Trackpoint>"
         "</Track></Lap></Activity></Activities></TrainingCenterDatabase>\n"},
        {"kml",
         "<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Placemark><LineString><coordinates>"
         "12.5,41.5,100 12.6,41.5,100</coordinates></LineString></Placemark></kml>\n"},
        {"kmz", std::string("PK\x03\x04\x14\0\0\0\x08\0doc.kml", 17)},
        {"fit", fit},
        {"nmea", fix + fix},
        {"geojson",
         "{\"type\": \"LineString\",\n \"coordinates\": [[12.5, 41.5], [12.6, 41.5]]}\n"},
        {"json", "[{\"lat\": 41.5, \"lon\": 12.5}, {\"lat\": 41.6, \"lon\": 12.5}]"},
        {"txt",  // Litchi
         "latitude,longitude,altitude(feet),datetime(utc)\n41.5,12.5,10,2024-05-01 10:00:00\n"
         "41.6,12.5,20,2024-05-01 10:00:01\n"},
        {"log",  // DJI
         "sep=,\r\nCUSTOM.date [local],OSD.latitude,OSD.longitude,OSD.height [ft]\r\n"
         "5/1/2024,41.5,12.5,10\r\n5/1/2024,41.6,12.5,10\r\n"},
        {"plt", "OziExplorer Track Point File Version 2.1\r\nWGS 84\r\n41.5,12.5,0,330\r\n"},
        {"html", "<!DOCTYPE html><html><body><p>Sign in<br></body></html>"},
    };
    int refused = 0;
    for (const auto& [extension, text] : files) {
        SCOPED_TRACE(extension);
        EXPECT_NE(
            refusal("a." + extension, text, degrees()).find("is a .csv, .gpx, .igc or .tum file"),
            std::string::npos);
        for (const std::string name : {"a.csv", "a.gpx", "a.igc", "a.tum"}) {
            const std::string message = refusal(name, text, degrees());
            EXPECT_NE(message.find(name + ":"), std::string::npos) << message;
            EXPECT_TRUE(std::ranges::none_of(message, [](unsigned char c) { return c < 0x20; }))
                << message;
            ++refused;
        }
    }
    EXPECT_EQ(refused, 44);
    EXPECT_NE(refusal("a.gpx", files[0].second)
                  .find("its root element is 'TrainingCenterDatabase' and not 'gpx'"),
              std::string::npos);
    EXPECT_NE(
        refusal("a.csv", files[7].second).find("; latitudes are read from .gpx and .igc files"),
        std::string::npos);
}

TEST_F(TrackTest, PlacesOnTheEarthNeedARasterWithACrs) {
    const std::string text = gpx("<trkpt lat=\"1\" lon=\"2\"/><trkpt lat=\"1\" lon=\"3\"/>");
    EXPECT_NE(refusal("a.gpx", text).find("no raster"), std::string::npos);
    TrackReference nowhere;
    nowhere.why_not = "this raster is a drawing";
    EXPECT_NE(refusal("a.gpx", text, nowhere).find("is a drawing"), std::string::npos);
    nowhere.world_from_lonlat = [](const Eigen::Vector3d&) {
        return WorldPos::Constant(std::numeric_limits<double>::quiet_NaN()).eval();
    };
    EXPECT_NE(refusal("a.gpx", text, nowhere).find("longitude 2, latitude 1 is outside"),
              std::string::npos);
}

TEST_F(TrackTest, IgcFixesCrossMidnight) {
    const TrackReference reference = degrees();
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
    const TrackReference reference = degrees();
    const Result<Track> track = read_track(write("a.igc",
                                                 "B1000004130000N01230000EV0033200000\n"
                                                 "B1000014130000N01230000EV-001000000\n"),
                                           reference);
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_EQ(track->points[0].position_world.z(), 332.0);
    EXPECT_EQ(track->points[1].position_world.z(), -10.0);
}

// One fix each second to the east; `fix(i)` is the validity and both altitudes.
std::string igc_of(int count, const std::function<std::string(int)>& fix) {
    std::string text;
    for (int i = 0; i < count; ++i) {
        const std::string second = std::to_string(100 + i).substr(1);
        text.append("B1200").append(second).append("4130000N012300").append(second);
        text.append("E").append(fix(i)).append("\n");
    }
    return text;
}

TEST_F(TrackTest, IgcFixesWithoutAGnssAltitudeAreFilledOneByOne) {
    struct Case {
        std::string odd;  // of the fixes 20 to 24 of 60
        double height;    // that they get
        std::string note;
        std::string others = "A0100001050";
    };
    for (const auto& [odd, height, note, others] : {
             Case{"V0100000000", 1050.0,
                  "5 of 60 fixes have no GNSS altitude: 5 are filled from the pressure"},
             Case{"V0110000000", 1150.0, "5 of 60"},  // 100 m above the others
             Case{"V0110009999", 1150.0, "5 of 60"},  // 2D whatever the field says
             Case{"A0100000000", 1050.0, "5 of 60"},  // no flight is at 0 m and 1000 m
             Case{"V0000000000", 1050.0,
                  "0 are filled from the pressure altitude, 5 from the fixes around"},
             Case{"V0000000000", 1050.0, "5 from the fixes around", "A0000001050"},  // no barometer
             Case{"A0020000000", 0.0, "", "A0020000010"},                            // over the sea
             Case{"A-010000000", 0.0, "", "A0020000010"},
         }) {
        const std::string text = igc_of(
            60, [&odd = odd, &others = others](int i) { return i >= 20 && i < 25 ? odd : others; });
        const Result<Track> track = read_track(write("a.igc", text), degrees());
        ASSERT_TRUE(track) << track.error().message;
        ASSERT_EQ(track->points.size(), 60u);
        const double usual = others == "A0020000010" ? 10.0 : 1050.0;
        for (std::size_t i = 0; i < 60; ++i) {
            EXPECT_NEAR(track->points[i].position_world.z(), i >= 20 && i < 25 ? height : usual,
                        1e-9)
                << odd << " " << i;
        }
        EXPECT_NE(track->note.find(note), std::string::npos) << track->note;
        EXPECT_EQ(track->note.empty(), note.empty()) << track->note;
    }
}

TEST_F(TrackTest, IgcFixesWithoutAPositionAreLeftOut) {
    const std::string fix = "4130000N01230000EA0100001050\n";
    const std::string text = "B1200000000000N00000000EV0100000000\nB120001" + fix + "B120002" + fix;
    const Result<Track> track = read_track(write("a.igc", text), degrees());
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_EQ(track->points.size(), 2u);
    EXPECT_NE(track->note.find("a.igc: 1 of 3 fixes are left out, because they have no position"),
              std::string::npos)
        << track->note;
    EXPECT_NE(refusal("a.igc", "B1200004130000N01230000EX0100001050\n", degrees())
                  .find("no validity A or V"),
              std::string::npos);
}

TEST_F(TrackTest, IgcFilesOf2DFixesOnlyUseWhatTheyHave) {
    const auto read = [&](const std::string& fix) {
        return read_track(write("a.igc", igc_of(3, [&](int) { return fix; })), degrees()).value();
    };
    EXPECT_EQ(read("V0100001050").points[1].position_world.z(), 1000.0);
    EXPECT_EQ(read("V0000001050").points[1].position_world.z(), 1050.0);
    const Track nothing = read("V0000000000");
    EXPECT_FALSE(nothing.has_heights);
    EXPECT_NE(nothing.note.find("no fix has an altitude"), std::string::npos);
}

TEST_F(TrackTest, GpxPointsWithoutAHeightOrTimeAreFilledOneByOne) {
    const auto point = [](int i, const std::string& content) {
        return "<trkpt lat=\"41.5\" lon=\"12.50" + std::to_string(10 + i) + "\">" + content +
               "</trkpt>\n";
    };
    const auto time = [](int i) {
        return "<time>2020-05-04T12:0" + std::to_string(i) + ":00Z</time>";
    };
    const auto height = [](int i) { return "<ele>" + std::to_string(1500 + 10 * i) + "</ele>"; };
    // Ten points one minute and 10 m of height apart; `odd` is the content of the fifth.
    const auto read = [&](const std::string& odd, int odd_index = 4) {
        std::string text;
        for (int i = 0; i < 10; ++i) text += point(i, i == odd_index ? odd : height(i) + time(i));
        return read_track(write("a.gpx", gpx(text)), degrees()).value();
    };
    for (const std::string none :
         {"", "<ele/>", "<ele> </ele>", "<ele>NaN</ele>", "<ele>-9999</ele>", "<ele>-32768</ele>",
          "<ele>0</ele><fix>2d</fix>"}) {
        const Track track = read(none + time(4));
        ASSERT_TRUE(track.has_heights) << none;
        for (std::size_t i = 0; i < 10; ++i) {
            EXPECT_NEAR(track.points[i].position_world.z(), 1500.0 + 10.0 * static_cast<double>(i),
                        1e-9);
        }
        EXPECT_NE(track.note.find("1 of 10 points have no height"), std::string::npos)
            << track.note;
    }
    for (const int odd : {0, 4, 9}) {
        for (const std::string none : {"", "<time/>"}) {
            const Track track = read(height(odd) + none, odd);
            ASSERT_TRUE(track.has_times);
            ASSERT_EQ(track.points.size(), 10u);
            for (std::size_t i = 0; i < 10; ++i) {
                EXPECT_NEAR(track.points[i].time, 60.0 * static_cast<double>(i), 1e-5) << odd;
            }
            EXPECT_NE(track.note.find("1 of 10 points have no time"), std::string::npos);
        }
    }
    EXPECT_EQ(read(height(4) + time(4) + "<fix>3d</fix>").note, "");
    const Track without_fix = read(height(4) + time(4) + "<fix>none</fix>");
    EXPECT_EQ(without_fix.points.size(), 9u);
    EXPECT_NE(without_fix.note.find("1 of 10 points are left out"), std::string::npos);
}

TEST_F(TrackTest, TracksWithTooFewValuesHaveNone) {
    const std::string bare = "<trkpt lat=\"41.5\" lon=\"12.5\"/><trkpt lat=\"41.5\" lon=\"12.6\"/>";
    const Track none = read_track(write("a.gpx", gpx(bare)), degrees()).value();
    EXPECT_FALSE(none.has_times);
    EXPECT_FALSE(none.has_heights);
    EXPECT_EQ(none.note, "");
    const std::string timed =
        "<trkpt lat=\"41.5\" lon=\"12.4\"><time>2020-05-04T12:00:00Z</time></trkpt>";
    const Track one = read_track(write("a.gpx", gpx(timed + bare)), degrees()).value();
    EXPECT_FALSE(one.has_times);
    EXPECT_EQ(one.points.size(), 3u);
    EXPECT_NE(one.note.find("only 1 of 3 points has a time"), std::string::npos);
    // known times that decrease are refused at the point that has them, whatever is filled between
    const std::string early =
        "\n<trkpt lat=\"41.5\" lon=\"12.7\"><time>2020-05-04T11:00:00Z</time></trkpt>";
    const std::string message = refusal("a.gpx", gpx(timed + bare + early), degrees());
    EXPECT_NE(message.find("line 4: time goes back"), std::string::npos) << message;
}

TEST_F(TrackTest, CsvHeightsMayBeMissing) {
    const Track track =
        read_track(write("a.csv", "time_s,x_m,y_m,z_m\n0,0,0,10\n1,1,0,\n3,2,0,nan\n4,3,0,50\n"))
            .value();
    EXPECT_EQ(track.points[1].position_world.z(), 20.0);
    EXPECT_EQ(track.points[2].position_world.z(), 40.0);
    EXPECT_NE(track.note.find("2 of 4 points have no height"), std::string::npos);
    EXPECT_FALSE(read_track(write("b.csv", "time_s,x_m,y_m,z_m\n0,0,0,\n1,1,0,\n"))->has_heights);
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
    const TrackReference reference = degrees();
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
