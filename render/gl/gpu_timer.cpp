// SPDX-License-Identifier: MIT
#include "gl/gpu_timer.h"

namespace terrane::internal {

// Reads the finished queries, oldest first.
void GpuTimer::collect() {
    for (std::size_t i = 1; i <= turns_.size(); ++i) {
        Turn& turn = turns_[(turn_ + i) % turns_.size()];
        if (!turn.is_pending) continue;
        GLint is_available = 0;
        glGetQueryObjectiv(turn.query.name(), GL_QUERY_RESULT_AVAILABLE, &is_available);
        if (is_available == GL_FALSE) return;
        GLuint64 nanoseconds = 0;
        glGetQueryObjectui64v(turn.query.name(), GL_QUERY_RESULT, &nanoseconds);
        last_ms_ = 1e-6 * static_cast<double>(nanoseconds);
        turn.is_pending = false;
    }
}

void GpuTimer::begin() {
    collect();
    Turn& next = turns_[(turn_ + 1) % turns_.size()];
    is_active_ = !next.is_pending;
    if (!is_active_) return;
    turn_ = (turn_ + 1) % turns_.size();
    if (next.query.name() == 0) {
        GLuint name = 0;
        glCreateQueries(GL_TIME_ELAPSED, 1, &name);
        next.query = GlQuery(name);
    }
    glBeginQuery(GL_TIME_ELAPSED, next.query.name());
}

void GpuTimer::end() {
    if (!is_active_) return;
    glEndQuery(GL_TIME_ELAPSED);
    turns_[turn_].is_pending = true;
    is_active_ = false;
}

}  // namespace terrane::internal
