// SPDX-License-Identifier: MIT
#include "support/random.h"

#include <terrane/render/offscreen.h>

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace terrane {
namespace image_test {

namespace fs = std::filesystem;

fs::path scratch(const std::string& name) {
    const fs::path folder = fs::path(TERRANE_BUILD_DIR) / "test_images";
    fs::create_directories(folder);
    return folder / name;
}

Image make_noise(int width, int height) {
    test::Random random(5);
    Image image;
    image.width = width;
    image.height = height;
    for (int i = 0; i < width * height * 3; ++i) {
        image.rgb.push_back(static_cast<std::uint8_t>(random.below(256)));
    }
    return image;
}

TEST(Png, ReadsBackEveryByteThatItWrote) {
    for (const auto& [width, height] : {std::pair{1, 1}, std::pair{7, 3}, std::pair{640, 361}}) {
        const Image image = make_noise(width, height);
        const std::string path = scratch("round_trip.png").string();
        const Result<void> written = write_png(image, path);
        ASSERT_TRUE(written) << written.error().message;
        const Result<Image> read = read_png(path);
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_EQ(read->width, width);
        EXPECT_EQ(read->height, height);
        EXPECT_EQ(read->rgb, image.rgb);
    }
}

TEST(Png, ReplacesAFileAndLeavesNothingBesideIt) {
    const fs::path path = scratch("replaced.png");
    ASSERT_TRUE(write_png(make_noise(9, 9), path.string()));
    ASSERT_TRUE(write_png(make_noise(4, 5), path.string()));
    EXPECT_EQ(read_png(path.string())->width, 4);
    EXPECT_FALSE(fs::exists(path.string() + ".part"));
}

TEST(Png, AnUnwritablePathIsAnErrorThatNamesIt) {
    const std::string path = scratch("no_such_folder/picture.png").string();
    const Result<void> written = write_png(make_noise(2, 2), path);
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().code, ErrorCode::io);
    EXPECT_NE(written.error().message.find(path), std::string::npos) << written.error().message;
}

TEST(Png, AFolderOfThatNameIsAnErrorAndLeavesNothingBesideIt) {
    const fs::path path = scratch("folder.png");
    fs::create_directories(path / "inside");
    const Result<void> written = write_png(make_noise(2, 2), path.string());
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().code, ErrorCode::io);
    EXPECT_FALSE(fs::exists(path.string() + ".part"));
}

TEST(Png, APictureWithoutPixelsOrWithTooFewBytesIsRefused) {
    const std::string path = scratch("none.png").string();
    Image torn = make_noise(4, 4);
    torn.rgb.pop_back();
    for (const Image& image : {Image{}, torn}) {
        const Result<void> written = write_png(image, path);
        ASSERT_FALSE(written);
        EXPECT_EQ(written.error().code, ErrorCode::invalid_argument);
    }
    EXPECT_FALSE(fs::exists(path));
}

TEST(Png, AMissingATextAndATornFileAreErrorsThatNameThem) {
    const std::string text = scratch("text.png").string();
    std::ofstream(text) << "not a picture at all\n";
    const std::string torn = scratch("torn.png").string();
    ASSERT_TRUE(write_png(make_noise(64, 64), torn));
    fs::resize_file(torn, fs::file_size(torn) / 2);
    for (const std::string& path : {scratch("missing.png").string(), text, torn}) {
        const Result<Image> read = read_png(path);
        ASSERT_FALSE(read) << path;
        EXPECT_EQ(read.error().code, ErrorCode::io);
        EXPECT_NE(read.error().message.find(path), std::string::npos) << read.error().message;
    }
}

}  // namespace image_test
}  // namespace terrane
