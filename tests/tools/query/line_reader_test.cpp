// SPDX-License-Identifier: MIT
#include "query/questions.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <string>
#include <thread>
#include <vector>

namespace terrane::tools {
namespace line_reader_test {

using Status = LineReader::Status;

/// All results of a reader for bytes from a pipe.
std::vector<std::pair<Status, std::string>> read_all(const std::string& bytes) {
    int ends[2] = {};
    EXPECT_EQ(pipe(ends), 0);
    std::thread writer([&] {
        for (std::size_t at = 0; at < bytes.size();) {
            const ssize_t count = write(ends[1], bytes.data() + at, bytes.size() - at);
            if (count <= 0) break;
            at += static_cast<std::size_t>(count);
        }
        close(ends[1]);
    });
    std::vector<std::pair<Status, std::string>> lines;
    LineReader reader(ends[0], [] {});
    std::string_view line;
    for (Status status = reader.next(line); status != Status::end; status = reader.next(line)) {
        EXPECT_NE(status, Status::failed);
        lines.emplace_back(status, status == Status::line ? std::string(line) : std::string());
    }
    writer.join();
    close(ends[0]);
    return lines;
}

TEST(LineReader, GivesEveryLineOnceInOrder) {
    const std::vector<std::pair<Status, std::string>> lines = read_all("a\n\nbc\r\nlast");
    ASSERT_EQ(lines.size(), 4u);
    EXPECT_EQ(lines[0].second, "a");
    EXPECT_EQ(lines[1].second, "");
    EXPECT_EQ(lines[2].second, "bc");
    EXPECT_EQ(lines[3].second, "last");
    EXPECT_TRUE(read_all("").empty());
}

TEST(LineReader, JoinsLinesThatSpanManyReads) {
    std::string bytes;
    for (int i = 0; i < 40'000; ++i) bytes += "line " + std::to_string(i) + "\n";
    const std::vector<std::pair<Status, std::string>> lines = read_all(bytes);
    ASSERT_EQ(lines.size(), 40'000u);
    EXPECT_EQ(lines[39'999].second, "line 39999");
}

TEST(LineReader, PassesOverALineThatIsTooLongAndGoesOn) {
    const std::string longest(LineReader::kMaxLine_bytes, 'x');
    const std::vector<std::pair<Status, std::string>> lines =
        read_all(longest + "\n" + longest + "y\n" + longest + longest + longest + "\nnext\n" +
                 longest + "y");
    ASSERT_EQ(lines.size(), 5u);
    EXPECT_EQ(lines[0].first, Status::line);
    EXPECT_EQ(lines[1].first, Status::too_long);
    EXPECT_EQ(lines[2].first, Status::too_long);
    EXPECT_EQ(lines[3].second, "next");
    EXPECT_EQ(lines[4].first, Status::too_long);
}

TEST(LineReader, LetsTheCallerFlushBeforeItWaits) {
    int ends[2] = {};
    ASSERT_EQ(pipe(ends), 0);
    int flushes = 0;
    LineReader reader(ends[0], [&] { ++flushes; });
    ASSERT_EQ(write(ends[1], "a\nb\npart", 8), 8);
    std::string_view line;
    EXPECT_EQ(reader.next(line), Status::line);
    EXPECT_EQ(reader.next(line), Status::line);
    EXPECT_EQ(flushes, 1);
    close(ends[1]);
    EXPECT_EQ(reader.next(line), Status::line);
    EXPECT_EQ(line, "part");
    EXPECT_EQ(flushes, 2);
    close(ends[0]);
}

TEST(LineReader, SaysThatAnInputCannotBeRead) {
    LineReader reader(-1, [] {});
    std::string_view line;
    EXPECT_EQ(reader.next(line), Status::failed);
}

}  // namespace line_reader_test
}  // namespace terrane::tools
