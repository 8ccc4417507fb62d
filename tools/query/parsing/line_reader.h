// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace terrane::tools {

/// Reads lines from a file descriptor for interactive use: calls back before each blocking read, so that the caller can
/// flush its answers.
class LineReader {
public:
    /// Fits the largest hull or compound with all digits.
    static constexpr std::size_t kMaxLine_bytes = std::size_t{1} << 24;

    enum class Status {
        line,      ///< a line; the last one may lack a line end
        too_long,  ///< skipped a line above kMaxLine_bytes
        end,       ///< end of input
        failed,    ///< read error: see errno
    };

    /// @param before_wait called before each read that may block
    LineReader(int file_descriptor, std::function<void()> before_wait);

    /// The next line without its line end (LF or CR LF); valid until the next call.
    Status next(std::string_view& line_out);

private:
    int file_descriptor_;
    std::function<void()> before_wait_;
    std::string buffer_;
    std::size_t begin_ = 0;  ///< start of the unread part
    bool at_end_ = false;
};

}  // namespace terrane::tools
