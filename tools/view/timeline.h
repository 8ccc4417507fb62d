// SPDX-License-Identifier: MIT
#pragma once

namespace terrane::tools {

/// The clock of a playback, from 0 to a duration.
class Timeline {
public:
    /// @param duration seconds, >= 0; infinite for a simulation without end
    explicit Timeline(double duration) : duration_(duration), last_(duration) {}

    static constexpr double kLeastRate = 0.1, kMostRate = 100.0;

    /// Seconds; infinite for a simulation.
    double duration() const { return duration_; }
    /// Earliest and latest time that seek() reaches, seconds: of a simulation, its past.
    double first() const { return first_; }
    double last() const { return last_; }
    void set_past(double first, double last);
    double time() const { return time_; }  ///< seconds, 0 to the duration
    double rate() const { return rate_; }  ///< seconds of playback per second
    bool is_playing() const { return is_playing_; }
    bool loops() const { return loops_; }

    /// Plays from the start if the end has been reached.
    void play();
    void pause() { is_playing_ = false; }
    void toggle() { is_playing_ ? pause() : play(); }
    void set_loops(bool is_on) { loops_ = is_on; }
    /// Limited to kLeastRate to kMostRate; NaN has no effect.
    void set_rate(double rate);
    /// Limited to first() to last(); NaN has no effect.
    void seek(double time);
    /// Pauses, and moves by a duration.
    void step(double seconds);

    /// Lets `seconds` of real time pass. Returns by how much the playback advanced, 0 or more: without the jump of a
    /// loop.
    double advance(double seconds);

private:
    double duration_;
    double first_ = 0.0, last_;
    double time_ = 0.0;
    double rate_ = 1.0;
    bool is_playing_ = false;
    bool loops_ = false;
};

}  // namespace terrane::tools
