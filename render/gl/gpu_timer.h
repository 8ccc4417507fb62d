// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <array>
#include <optional>

namespace terrane::internal {

struct QueryKind {
    static void destroy(GLuint name) { glDeleteQueries(1, &name); }
};
using GlQuery = GlObject<QueryKind>;

/// Time that the device takes for the commands of a frame, read without waiting for it.
///
/// Three queries in turn: a frame that is not finished when its query's turn comes again is not measured.
class GpuTimer {
public:
    /// Call around the commands of a frame; no other time query may be active.
    void begin();
    void end();
    /// Milliseconds of the last frame whose time the device has reported; none before the first one.
    std::optional<double> last_ms() const { return last_ms_; }

private:
    struct Turn {
        GlQuery query;
        bool is_pending = false;
    };
    void collect();

    std::array<Turn, 3> turns_;
    std::size_t turn_ = 0;
    bool is_active_ = false;
    std::optional<double> last_ms_;
};

}  // namespace terrane::internal
