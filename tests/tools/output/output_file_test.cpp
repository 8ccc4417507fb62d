// SPDX-License-Identifier: MIT
#include "program/output_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace terrane::tools {
namespace output_file_test {

std::string temporary(const std::string& name) { return testing::TempDir() + "terrane_" + name; }

std::string content_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST(OutputFile, AppearsOnlyWhenItIsCommitted) {
    const std::string path = temporary("output_file");
    std::filesystem::remove(path);
    {
        Result<OutputFile> file = OutputFile::create(path);
        ASSERT_TRUE(file) << file.error().message;
        file->write("half");
        EXPECT_FALSE(std::filesystem::exists(path));
    }
    EXPECT_FALSE(std::filesystem::exists(path));
    EXPECT_FALSE(std::filesystem::exists(path + ".partial"));
    Result<OutputFile> file = OutputFile::create(path);
    ASSERT_TRUE(file) << file.error().message;
    file->write("wh");
    file->write("ole");
    ASSERT_TRUE(file->commit());
    EXPECT_EQ(content_of(path), "whole");
    EXPECT_FALSE(std::filesystem::exists(path + ".partial"));
}

TEST(OutputFile, KeepsWhatWasThereWhenItIsNotCommitted) {
    const std::string path = temporary("output_file_kept");
    std::ofstream(path) << "old";
    {
        Result<OutputFile> file = OutputFile::create(path);
        ASSERT_TRUE(file);
        file->write("new");
    }
    EXPECT_EQ(content_of(path), "old");
}

TEST(OutputFile, LeavesAFileWithTheNameOfAPartAlone) {
    const std::string path = temporary("output_file_part");
    std::ofstream(path + ".partial") << "mine";
    Result<OutputFile> file = OutputFile::create(path);
    ASSERT_TRUE(file);
    file->write("new");
    ASSERT_TRUE(file->commit());
    EXPECT_EQ(content_of(path), "new");
    EXPECT_EQ(content_of(path + ".partial"), "mine");
    std::filesystem::remove(path + ".partial");
}

TEST(OutputFile, InARunsFolderIsListedAndNeverTakesAFilesPlace) {
    const std::string folder = temporary("output_folder");
    std::filesystem::remove_all(folder);
    {
        Result<std::shared_ptr<OutputFolder>> run = OutputFolder::open(folder, {"a", "b"}, false);
        ASSERT_TRUE(run) << run.error().message;
        ASSERT_TRUE((*run)->clear());
        Result<OutputFile> a = OutputFile::create(OutputPlace(*run, "a"));
        Result<OutputFile> b = OutputFile::create(OutputPlace(*run, "b"));
        ASSERT_TRUE(a && b);
        a->write("run");
        b->write("run");
        ASSERT_TRUE(a->commit());
        std::ofstream(folder + "/b") << "mine";  // created during the run
        EXPECT_FALSE(b->commit());
        EXPECT_FALSE(OutputFolder::open(folder, {}, false)) << "it is in use";
    }
    EXPECT_EQ(content_of(folder + "/b"), "mine");
    EXPECT_NE(content_of(folder + "/" + kFileListName).find(" a\n"), std::string::npos);
    EXPECT_TRUE(OutputFolder::open(folder, {"a"}, false)) << "a is what the run wrote";
    EXPECT_FALSE(OutputFolder::open(folder, {"b"}, false)) << "b is not";
}

TEST(OutputFile, NamesThePathWhereItCannotBeMade) {
    for (const char* path : {"/no/such/folder/file", "/", ""}) {
        const Result<OutputFile> file = OutputFile::create(path);
        ASSERT_FALSE(file) << path;
        EXPECT_NE(file.error().message.find(path), std::string::npos);
    }
}

TEST(OutputFile, ReportsAFullDisk) {
    if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
    Result<OutputFile> file = OutputFile::create("/dev/full");
    ASSERT_TRUE(file) << file.error().message;
    file->write(std::string(1 << 20, 'x'));
    EXPECT_TRUE(file->has_failed());
    const Result<void> written = file->commit();
    ASSERT_FALSE(written);
    EXPECT_NE(written.error().message.find("/dev/full"), std::string::npos);
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

}  // namespace output_file_test
}  // namespace terrane::tools
