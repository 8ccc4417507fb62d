// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace terrane::tools {

/// Lines of a file descriptor, for a conversation: before it waits for more input it lets the caller
/// flush what was answered, so that nobody waits for an answer that sits in a buffer.
class LineReader {
public:
    /// The largest hull or compound fits, with every digit.
    static constexpr std::size_t kMaxLine_bytes = std::size_t{1} << 24;

    enum class Status {
        line,      ///< here is one; the last need not end with a line end
        too_long,  ///< a line above kMaxLine_bytes was passed over
        end,       ///< no more
        failed,    ///< the input cannot be read: see errno
    };

    /// @param before_wait called before each read that may wait
    LineReader(int file_descriptor, std::function<void()> before_wait);

    /// The next line without its line end (a carriage return before it goes too); valid until the
    /// next call.
    Status next(std::string_view& line_out);

private:
    int file_descriptor_;
    std::function<void()> before_wait_;
    std::string buffer_;
    std::size_t begin_ = 0;  ///< of what was not handed out
    bool at_end_ = false;
};

}  // namespace terrane::tools
