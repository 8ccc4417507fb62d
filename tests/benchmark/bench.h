// SPDX-License-Identifier: MIT
//
// What the benchmarks share: command lines, clocks, spreads of times, and the head of a table.
#pragma once

#include "lab/measure.h"

#include <terrane/base/result.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace terrane::bench {

using tools::Clock;
using tools::median;
using tools::Stopwatch;

/// The value of a result. Ends the program with the error's message if there is none.
template <class T>
T value_or_exit(Result<T> result) {
    if (!result) {
        std::fprintf(stderr, "%s\n", result.error().message.c_str());
        std::exit(1);
    }
    if constexpr (!std::is_void_v<T>) return std::move(*result);
}

/// The words of a command line, which a program takes one after the other.
class Arguments {
public:
    Arguments(int count, char** words, const char* usage)
        : words_(words + std::min(count, 1), words + count), usage_(usage) {}

    /// Whether the flag is there. Takes it.
    bool has(std::string_view flag) {
        const auto found = std::ranges::find(words_, flag);
        if (found == words_.end()) return false;
        words_.erase(found);
        return true;
    }
    /// The word after the option, or `otherwise` without the option. Takes both.
    std::string text(std::string_view option, std::string otherwise) {
        const auto found = std::ranges::find(words_, option);
        if (found == words_.end()) return otherwise;
        if (found + 1 == words_.end()) exit_with_usage(found[0] + " needs a value");
        std::string value = found[1];
        words_.erase(found, found + 2);
        return value;
    }
    /// The number after the option, from `least` to `most`, or `otherwise` without the option. Takes both.
    template <class Number>
    Number number(std::string_view option, double least, double most, Number otherwise) {
        const std::string word = text(option, "");
        return word.empty()
                   ? otherwise
                   : static_cast<Number>(to_number(std::string(option), word, least, most));
    }
    /// The words that are left; flags among them end the program.
    std::vector<std::string> rest() const {
        for (const std::string& word : words_) {
            if (word.starts_with("-")) exit_with_usage("no flag is called " + word);
        }
        return words_;
    }
    /// The words that are left, as numbers from `least` to `most`.
    std::vector<double> numbers(const std::string& name, double least, double most) const {
        std::vector<double> values;
        for (const std::string& word : rest()) {
            values.push_back(to_number(name, word, least, most));
        }
        return values;
    }
    /// Ends the program if words are left.
    void finish() const {
        if (!words_.empty()) exit_with_usage("'" + words_.front() + "' is not understood");
    }

    [[noreturn]] void exit_with_usage(const std::string& fault) const {
        std::fprintf(stderr, "%s\nusage: %s\n", fault.c_str(), usage_);
        std::exit(2);
    }

private:
    double to_number(const std::string& name, const std::string& word, double least,
                     double most) const {
        char* end = nullptr;
        const double value = std::strtod(word.c_str(), &end);
        if (end == word.c_str() || *end != '\0' || !(value >= least && value <= most)) {
            std::ostringstream range;
            range << least << " to " << most;
            exit_with_usage(name + " must be a number, " + range.str() + ", got '" + word + "'");
        }
        return value;
    }

    std::vector<std::string> words_;
    const char* usage_;
};

/// The choice of an option such as --only among the names that a program measures.
class Choice {
public:
    enum class Match { whole, part };  ///< of a name

    /// @param wanted the option's word; "" for all names
    Choice(std::string wanted, Match match) : wanted_(std::move(wanted)), match_(match) {}

    /// Whether a name is chosen.
    bool has(const std::string& name) {
        if (std::ranges::find(names_, name) == names_.end()) names_.push_back(name);
        const bool is_chosen =
            wanted_.empty() ||
            (match_ == Match::whole ? name == wanted_ : name.find(wanted_) != std::string::npos);
        is_met_ |= is_chosen;
        return is_chosen;
    }
    bool is_all() const { return wanted_.empty(); }
    /// Ends the program, with the names that has() was asked for, if none of them was chosen.
    void finish(const Arguments& arguments) const {
        if (is_met_ || wanted_.empty()) return;
        std::string known;
        for (const std::string& name : names_) known += (known.empty() ? "" : ", ") + name;
        arguments.exit_with_usage("'" + wanted_ + "' is none of the names; known are " + known);
    }

private:
    std::string wanted_;
    Match match_;
    std::vector<std::string> names_;
    bool is_met_ = false;
};

/// Processor time of all threads of this program, milliseconds.
inline double processor_ms() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// The value that a share of the values does not exceed; 0 without values.
inline double quantile(std::vector<double> values, double share) {
    if (values.empty()) return 0.0;
    std::ranges::sort(values);
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// Processor, threads it has, load at the moment, compiler: for the head of a table.
inline std::string describe_machine() {
    const tools::Machine machine = tools::this_machine();
    std::string load = "unknown";
    std::ifstream("/proc/loadavg") >> load;
    return machine.processor + ", " + std::to_string(machine.threads) + " threads, load " + load +
           "; " + machine.compiler + ", " + machine.build;
}

}  // namespace terrane::bench
