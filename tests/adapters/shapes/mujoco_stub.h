// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace terrane::test {

/// The members of mjModel and mjData that a MujocoWindow uses, written from the documentation: one hfield geom on a
/// mocap body, and balls on bodies that move.
struct MujocoStub {
    struct Model {
        int ngeom = 0, nhfield = 1;
        int* geom_type = nullptr;
        int* geom_dataid = nullptr;
        int* geom_bodyid = nullptr;
        int* body_mocapid = nullptr;
        int* body_weldid = nullptr;
        double* geom_pos = nullptr;
        double* geom_quat = nullptr;
        double* geom_rbound = nullptr;
        double* hfield_size = nullptr;
        int* hfield_nrow = nullptr;
        int* hfield_ncol = nullptr;
        int* hfield_adr = nullptr;
        float* hfield_data = nullptr;
    };
    struct Data {
        double* geom_xpos = nullptr;
        double* mocap_pos = nullptr;
        double* mocap_quat = nullptr;
    };

    /// Body 1 and geom 0 are the hfield, body 2 + i and geom 1 + i ball i.
    MujocoStub(int side, double spacing, double range, int balls)
        : size_{0.5 * spacing * (side - 1), 0.5 * spacing * (side - 1), range, 4.0},
          nrow_(side),
          ncol_(side),
          heights_(static_cast<std::size_t>(side) * static_cast<std::size_t>(side)),
          xpos_(static_cast<std::size_t>(3 + 3 * balls)),
          radius_(static_cast<std::size_t>(1 + balls), 0.5) {
        for (int i = 0; i < 1 + balls; ++i) {
            types_.push_back(i == 0 ? 1 : 2);
            hfields_.push_back(i == 0 ? 0 : -1);
            bodies_.push_back(i + 1);
            positions_.insert(positions_.end(), 3, 0.0);
            quats_.insert(quats_.end(), {1.0, 0.0, 0.0, 0.0});
        }
        for (int i = 0; i < 2 + balls; ++i) {
            mocap_ids_.push_back(i == 1 ? 0 : -1);
            welds_.push_back(i < 2 ? 0 : i);
        }
        model.ngeom = 1 + balls;
        model.geom_type = types_.data();
        model.geom_dataid = hfields_.data();
        model.geom_bodyid = bodies_.data();
        model.body_mocapid = mocap_ids_.data();
        model.body_weldid = welds_.data();
        model.geom_pos = positions_.data();
        model.geom_quat = quats_.data();
        model.geom_rbound = radius_.data();
        model.hfield_size = size_.data();
        model.hfield_nrow = &nrow_;
        model.hfield_ncol = &ncol_;
        model.hfield_adr = &first_;
        model.hfield_data = heights_.data();
        data.geom_xpos = xpos_.data();
        data.mocap_pos = mocap_pos_.data();
        data.mocap_quat = mocap_quat_.data();
    }
    MujocoStub(const MujocoStub&) = delete;
    MujocoStub& operator=(const MujocoStub&) = delete;
    ~MujocoStub() = default;

    void put_ball(int i, double x, double y, double z) {
        const auto at = static_cast<std::size_t>(3 * (i + 1));
        xpos_[at] = x;
        xpos_[at + 1] = y;
        xpos_[at + 2] = z;
    }
    /// Height of the hfield's surface at one of its samples, MuJoCo's frame.
    double height(int column, int row) const {
        const auto at = static_cast<std::size_t>(row) * static_cast<std::size_t>(ncol_);
        return mocap_pos_[2] +
               size_[2] * static_cast<double>(heights_[at + static_cast<std::size_t>(column)]);
    }
    double x(int column) const {
        return mocap_pos_[0] - size_[0] + 2.0 * size_[0] * column / (ncol_ - 1);
    }
    double y(int row) const {
        return mocap_pos_[1] - size_[1] + 2.0 * size_[1] * row / (nrow_ - 1);
    }
    int side() const { return ncol_; }

    Model model;
    Data data;

private:
    std::vector<int> types_, hfields_, bodies_, mocap_ids_, welds_;
    std::vector<double> positions_, quats_;
    std::array<double, 4> size_;
    int nrow_, ncol_, first_ = 0;
    std::vector<float> heights_;
    std::vector<double> xpos_, radius_;
    std::array<double, 3> mocap_pos_{};
    std::array<double, 4> mocap_quat_{};
};

}  // namespace terrane::test
