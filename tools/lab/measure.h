// SPDX-License-Identifier: MIT
//
// Clocks, repetitions and medians, for the experiments of the program and for the programs of tests/benchmark.
#pragma once

#include <algorithm>
#include <cstddef>
#include <ctime>
#include <fstream>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace terrane::tools {

/// What a Stopwatch reads: wall-clock time, or the processor time of the calling thread. The latter does not grow with
/// other load on the machine, but excludes worker threads.
enum class Clock { wall, thread };

/// Measures the time since its construction.
class Stopwatch {
public:
    explicit Stopwatch(Clock clock) : clock_(clock), from_(now()) {}
    /// Milliseconds.
    double ms() const { return now() - from_; }

private:
    double now() const {
        timespec time{};
        clock_gettime(clock_ == Clock::wall ? CLOCK_MONOTONIC : CLOCK_THREAD_CPUTIME_ID, &time);
        return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
    }

    Clock clock_;
    double from_;
};

/// The middle value, or the larger of the two middle values of an even count; 0 without values.
inline double median(std::vector<double> values) {
    if (values.empty()) return 0.0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// a / b if b is above 0, else 0.
inline double ratio_or_zero(auto a, auto b) {
    return b > 0 ? static_cast<double>(a) / static_cast<double>(b) : 0.0;
}

/// Where measured values change from below to above 0: those at x below `from` are negative, those at x above `to`
/// positive. Between them, noise decides.
struct SignChange {
    double from = 0.0, to = 0.0;
};

/// Absent if no value is negative or none is positive.
inline std::optional<SignChange> find_sign_change(std::span<const double> x,
                                                  std::span<const double> values) {
    std::optional<double> last_negative, first_positive;
    for (std::size_t i = 0; i < x.size(); ++i) {
        if (values[i] < 0.0) last_negative = std::max(last_negative.value_or(x[i]), x[i]);
        if (values[i] > 0.0) first_positive = std::min(first_positive.value_or(x[i]), x[i]);
    }
    if (!last_negative || !first_positive) return std::nullopt;
    const auto [from, to] = std::minmax(*last_negative, *first_positive);
    return SignChange{from, to};
}

/// Median time of some runs of a function, milliseconds.
template <class Function>
double median_ms(int runs, Clock clock, const Function& function) {
    std::vector<double> times;
    for (int i = 0; i < runs; ++i) {
        const Stopwatch watch(clock);
        function();
        times.push_back(watch.ms());
    }
    return median(std::move(times));
}

/// Limits of repetitions.
struct Patience {
    /// Time after the first turn during which further turns start, seconds; if <= 0, there is only the first turn.
    double seconds = std::numeric_limits<double>::infinity();
    std::size_t most_turns = 9;  ///< including the first one
};

/// Measures cases in turns, each case once a turn, so that a temporary slowdown of the machine affects all alike.
///
/// @param measure called with the indices of a case and of a turn; returns false to end the turns
template <class Measure>
void take_turns(std::size_t case_count, const Patience& patience, const Measure& measure) {
    const auto run_turn = [&](std::size_t turn) {
        for (std::size_t i = 0; i < case_count; ++i) {
            if (!measure(i, turn)) return false;
        }
        return true;
    };
    if (!run_turn(0)) return;
    const Stopwatch since_first(Clock::wall);
    for (std::size_t turn = 1;
         turn < patience.most_turns && since_first.ms() < 1e3 * patience.seconds; ++turn) {
        if (!run_turn(turn)) return;
    }
}

/// Mean processor time of a call, nanoseconds. Calls with all indices below `count` are repeated for two milliseconds.
///
/// @param call takes an index and returns a number that depends on its work, so that the compiler does not remove it
template <class Call>
double time_call_ns(std::size_t count, const Call& call) {
    constexpr double kLeast_ms = 2.0;
    if (count == 0) return 0.0;
    double sum = 0.0, taken_ms = 0.0;
    std::size_t calls = 0;
    const Stopwatch watch(Clock::thread);
    while (taken_ms < kLeast_ms) {
        for (std::size_t i = 0; i < count; ++i) sum += static_cast<double>(call(i));
        calls += count;
        taken_ms = watch.ms();
    }
    [[maybe_unused]] static volatile double sink;
    sink = sum;
    return 1e6 * taken_ms / static_cast<double>(calls);
}

/// Machine and build: measured times depend on them.
struct Machine {
    std::string processor = "unknown processor";
    unsigned threads = std::thread::hardware_concurrency();
#ifdef __clang__
    std::string compiler = "clang " __clang_version__;
#else
    std::string compiler = "g++ " __VERSION__;
#endif
#ifdef NDEBUG
    std::string build = "release";
#else
    std::string build = "with asserts";
#endif
};

/// The machine and the build of this program.
inline Machine this_machine() {
    Machine machine;
    std::ifstream processors("/proc/cpuinfo");
    for (std::string line; std::getline(processors, line);) {
        if (!line.starts_with("model name") || line.find(": ") == std::string::npos) continue;
        machine.processor = line.substr(line.find(": ") + 2);
        break;
    }
    return machine;
}

}  // namespace terrane::tools
