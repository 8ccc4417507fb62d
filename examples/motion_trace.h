// SPDX-License-Identifier: MIT
#pragma once

// Writes where the bodies of an example were to a CSV file for plot_motion.py, if the program is given the file's name.

#include <terrane/base/math.h>

#include <cstdio>
#include <string>

class MotionTrace {
public:
    MotionTrace(int argc, char** argv) : file_(argc > 1 ? std::fopen(argv[1], "w") : nullptr) {
        if (file_ != nullptr) std::fputs("body,time_s,x,y,z,ground_z\n", file_);
    }
    MotionTrace(const MotionTrace&) = delete;
    MotionTrace& operator=(const MotionTrace&) = delete;
    ~MotionTrace() {
        if (file_ != nullptr) std::fclose(file_);
    }
    // A position in the world at a time, and the height of the ground below it.
    void add(const std::string& body, double time, const terrane::WorldPos& p_world,
             double ground_z) {
        if (file_ == nullptr) return;
        std::fprintf(file_, "%s,%.9g,%.9g,%.9g,%.9g,%.9g\n", body.c_str(), time, p_world.x(),
                     p_world.y(), p_world.z(), ground_z);
    }

private:
    std::FILE* file_;
};
