// SPDX-License-Identifier: MIT
#include "query/parsing/line_reader.h"

#include <unistd.h>

#include <cerrno>
#include <utility>

namespace terrane::tools {
namespace {

constexpr std::size_t kRead_bytes = std::size_t{1} << 16;

}  // namespace

LineReader::LineReader(int file_descriptor, std::function<void()> before_wait)
    : file_descriptor_(file_descriptor), before_wait_(std::move(before_wait)) {}

LineReader::Status LineReader::next(std::string_view& line_out) {
    bool is_too_long = false;
    std::size_t searched = begin_;
    for (;;) {
        const std::size_t line_end = buffer_.find('\n', searched);
        if (line_end != std::string::npos || (at_end_ && begin_ < buffer_.size())) {
            const std::size_t end = line_end == std::string::npos ? buffer_.size() : line_end;
            line_out = std::string_view(buffer_).substr(begin_, end - begin_);
            begin_ = line_end == std::string::npos ? end : end + 1;
            if (is_too_long || line_out.size() > kMaxLine_bytes) return Status::too_long;
            if (line_out.ends_with('\r')) line_out.remove_suffix(1);
            return Status::line;
        }
        if (at_end_) return is_too_long ? Status::too_long : Status::end;
        buffer_.erase(0, begin_);
        begin_ = 0;
        if (buffer_.size() > kMaxLine_bytes) {
            is_too_long = true;
            buffer_.clear();
        }
        searched = buffer_.size();
        before_wait_();
        buffer_.resize(searched + kRead_bytes);
        const ssize_t count = read(file_descriptor_, buffer_.data() + searched, kRead_bytes);
        buffer_.resize(searched + static_cast<std::size_t>(count > 0 ? count : 0));
        if (count == 0) at_end_ = true;
        if (count < 0 && errno != EINTR) return Status::failed;
    }
}

}  // namespace terrane::tools
