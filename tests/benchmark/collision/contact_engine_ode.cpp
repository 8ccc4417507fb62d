// SPDX-License-Identifier: MIT
//
// ODE's own height field. It is y up, and has the same diagonal in all cells: with its z to the south, from south-west
// to north-east. Poses are converted to its frame before the timing.
#include "benchmark/collision/contact_engine.h"

#include <ode/ode.h>

#include <algorithm>
#include <array>
#include <vector>

namespace terrane::bench {
namespace {

constexpr int kMostContacts = 16;

// A geometry outside of any space.
class Geometry {
public:
    explicit Geometry(dGeomID id) : id_(id) {}
    Geometry(const Geometry&) = delete;
    Geometry& operator=(const Geometry&) = delete;
    ~Geometry() {
        if (id_) dGeomDestroy(id_);
    }
    dGeomID get() const { return id_; }

private:
    dGeomID id_;
};

dGeomID make_shape(const Shape& shape) {
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) {
        return dCreateSphere(nullptr, dReal(sphere->radius));
    }
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
        return dCreateCapsule(nullptr, dReal(capsule->radius), dReal(2.0 * capsule->half_height));
    }
    if (const Box* box = std::get_if<Box>(&shape)) {
        const Eigen::Vector3d sides = 2.0 * box->half_extents;
        return dCreateBox(nullptr, dReal(sides.x()), dReal(sides.y()), dReal(sides.z()));
    }
    return nullptr;
}

class OdeEngine final : public ContactEngine {
public:
    explicit OdeEngine(const test::HeightTable& table)
        : spacing_(table.spacing),
          middle_x_(0.5 * table.spacing * (table.columns - 1)),
          middle_y_(0.5 * table.spacing * (table.rows - 1)) {
        dInitODE2(0);
        dAllocateODEDataForThread(dAllocateFlagCollisionData);
        for (int row = table.rows - 1; row >= 0; --row) {
            const auto first = table.heights.begin() + static_cast<long>(table.index(0, row));
            rows_from_north_.insert(rows_from_north_.end(), first, first + table.columns);
        }
        data_ = dGeomHeightfieldDataCreate();
        dGeomHeightfieldDataBuildSingle(data_, rows_from_north_.data(), /*copy=*/0,
                                        dReal(2.0 * middle_x_), dReal(2.0 * middle_y_),
                                        table.columns, table.rows, /*scale=*/dReal(1.0),
                                        /*offset=*/dReal(0.0), /*thickness=*/dReal(1.0),
                                        /*wrap=*/0);
        field_ = dCreateHeightfield(nullptr, data_, /*placeable=*/0);
    }
    OdeEngine(const OdeEngine&) = delete;
    OdeEngine& operator=(const OdeEngine&) = delete;
    ~OdeEngine() override {
        dGeomDestroy(field_);
        dGeomHeightfieldDataDestroy(data_);
        dCloseODE();
    }

    std::string name() const override {
        return std::string("ODE") + (sizeof(dReal) == sizeof(double) ? " (double)" : " (single)");
    }
    Cut cut_of_rays() const override { return cut_of_contacts(); }
    Cut cut_of_contacts() const override {
        return [](int, int) { return true; };
    }

    double height(double x, double y) override {
        const Geometry ray(dCreateRay(nullptr, dReal(kRayTop - kRayBottom)));
        dGeomRaySetClosestHit(ray.get(), 1);
        const std::array<dReal, 3> from = place(WorldPos(x, y, kRayTop));
        dGeomRaySet(ray.get(), from[0], from[1], from[2], 0, -1, 0);
        dContactGeom contact;
        const int count = dCollide(ray.get(), field_, 1, &contact, sizeof contact);
        return count > 0 ? kRayTop - static_cast<double>(contact.depth) : kRayBottom;
    }

    bool contacts(const Shape& shape, std::span<const Pose> poses, double /*margin*/,
                  std::span<int> counts_out) override {
        // It tests each triangle below with every other one: half a minute a query on 10^5 cells.
        constexpr double kMostCells = 100.0;  // along a side
        if (2.0 * bounding_radius(shape) > kMostCells * spacing_) return false;
        const Geometry geometry(make_shape(shape));
        if (!geometry.get()) return false;
        std::array<dContactGeom, kMostContacts> contacts;
        for (std::size_t i = 0; i < poses.size(); ++i) {
            const std::array<dReal, 3> at = place(poses[i].translation);
            dGeomSetPosition(geometry.get(), at[0], at[1], at[2]);
            dMatrix3 rotation{};
            for (int column = 0; column < 3; ++column) {
                rotation[column] = dReal(poses[i].rotation(0, column));
                rotation[4 + column] = dReal(poses[i].rotation(2, column));
                rotation[8 + column] = dReal(-poses[i].rotation(1, column));
            }
            dGeomSetRotation(geometry.get(), rotation);
            counts_out[i] = dCollide(geometry.get(), field_, kMostContacts, contacts.data(),
                                     sizeof(dContactGeom));
        }
        return true;
    }

    bool casts(const Shape&, std::span<const Sweep>, std::span<double>) override { return false; }

private:
    std::array<dReal, 3> place(const WorldPos& p) const {
        return {dReal(p.x() - middle_x_), dReal(p.z()), dReal(middle_y_ - p.y())};
    }

    double spacing_;
    double middle_x_, middle_y_;
    std::vector<float> rows_from_north_;
    dHeightfieldDataID data_ = nullptr;
    dGeomID field_ = nullptr;
};

}  // namespace

std::unique_ptr<ContactEngine> make_ode_engine(const test::HeightTable& table) {
    return std::make_unique<OdeEngine>(table);
}

}  // namespace terrane::bench
