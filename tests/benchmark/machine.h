// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace terrane::bench {

/// Processor, threads it has, load at the moment, compiler: for the head of a table.
std::string describe_machine();

/// What a Stopwatch reads: the world's clock, or the processor time of the calling thread, which a
/// busy machine does not stretch but which does not see workers.
enum class Clock { wall, thread };

class Stopwatch {
public:
    explicit Stopwatch(Clock clock) : clock_(clock), from_(now()) {}
    /// Since it was made, milliseconds.
    double ms() const { return now() - from_; }

private:
    double now() const;

    Clock clock_;
    double from_;
};

/// The middle one; of an even count the upper of both. Requires at least one.
double median(std::vector<double> values);

}  // namespace terrane::bench
