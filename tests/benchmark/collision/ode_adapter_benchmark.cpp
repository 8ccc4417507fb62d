// SPDX-License-Identifier: MIT
//
// Time of a step of ODE with bodies on Terrane's geometry (OdeGround) beside ODE's own height field on the same
// heights: medians of steps that take turns. ODE's height field is y up, so its world is turned; it cuts all cells one
// way.
//
//   ode_adapter_benchmark [--quick]
#include "benchmark/collision/adapter_drop.h"

#include <terrane/adapters/ode_ground.h>

#include <ode/ode.h>

#include <array>
#include <memory>
#include <variant>

namespace terrane::bench {
namespace {

constexpr double kDt = 1.0 / 60.0;

class OdeBodiesOnGround {
public:
    OdeBodiesOnGround(const ContactMap& map, const AdapterDrop& drop, int our_class)
        : map_(map), is_ours_(our_class >= 0), middle_(0.5 * map.width()) {
        world_ = dWorldCreate();
        space_ = dHashSpaceCreate(nullptr);
        joints_ = dJointGroupCreate(0);
        dWorldSetGravity(world_, 0, dReal(is_ours_ ? 0.0 : -9.81), dReal(is_ours_ ? -9.81 : 0.0));
        if (is_ours_) {
            ours_ = std::make_unique<adapters::OdeGround>(our_class);
        } else {
            make_field();
        }
        for (std::size_t i = 0; i < drop.places.size(); ++i) add(drop, i);
    }
    ~OdeBodiesOnGround() {
        ours_.reset();
        if (field_ != nullptr) dGeomDestroy(field_);
        if (data_ != nullptr) dGeomHeightfieldDataDestroy(data_);
        dJointGroupDestroy(joints_);
        dSpaceDestroy(space_);
        dWorldDestroy(world_);
    }
    OdeBodiesOnGround(const OdeBodiesOnGround&) = delete;
    OdeBodiesOnGround& operator=(const OdeBodiesOnGround&) = delete;

    void step() {
        if (is_ours_) ours_->update(map_.ground, kDt);
        dSpaceCollide2(is_ours_ ? ours_->geom() : field_, reinterpret_cast<dGeomID>(space_), this,
                       &near);
        dSpaceCollide(space_, this, &near);
        dWorldQuickStep(world_, dReal(kDt));
        dJointGroupEmpty(joints_);
    }
    std::size_t below() const {
        std::size_t count = 0;
        for (const dBodyID body : bodies_) {
            const dReal* const p = dBodyGetPosition(body);
            const WorldPos place = is_ours_ ? WorldPos(p[0], p[1], p[2])
                                            : WorldPos(p[0] + middle_, middle_ - p[2], p[1]);
            if (map_.is_below(place)) ++count;
        }
        return count;
    }

private:
    void make_field() {
        const test::HeightTable& table = map_.table;
        for (int row = table.rows - 1; row >= 0; --row) {
            const auto first = table.heights.begin() + static_cast<long>(table.index(0, row));
            rows_from_north_.insert(rows_from_north_.end(), first, first + table.columns);
        }
        data_ = dGeomHeightfieldDataCreate();
        dGeomHeightfieldDataBuildSingle(data_, rows_from_north_.data(), 0, dReal(2.0 * middle_),
                                        dReal(2.0 * middle_), table.columns, table.rows, 1, 0, 1,
                                        0);
        field_ = dCreateHeightfield(nullptr, data_, 0);
    }
    void add(const AdapterDrop& drop, std::size_t i) {
        const auto real = [](double v) { return dReal(v); };
        dGeomID geom = nullptr;
        if (const auto* const sphere = std::get_if<Sphere>(&drop.shapes[i])) {
            geom = dCreateSphere(space_, real(sphere->radius));
        } else if (const auto* const capsule = std::get_if<Capsule>(&drop.shapes[i])) {
            geom = dCreateCapsule(space_, real(capsule->radius), real(2.0 * capsule->half_height));
        } else {
            const Eigen::Vector3d sides = 2.0 * std::get<Box>(drop.shapes[i]).half_extents;
            geom = dCreateBox(space_, real(sides.x()), real(is_ours_ ? sides.y() : sides.z()),
                              real(is_ours_ ? sides.z() : sides.y()));
        }
        const dBodyID body = dBodyCreate(world_);
        dMass mass;
        dMassSetBoxTotal(&mass, 100, 1, 1, 1);
        dBodySetMass(body, &mass);
        dGeomSetBody(geom, body);
        const WorldPos& p = drop.places[i];
        const Eigen::Vector3d& w = drop.spins[i];
        if (is_ours_) {
            dBodySetPosition(body, real(p.x()), real(p.y()), real(p.z()));
            dBodySetAngularVel(body, real(w.x()), real(w.y()), real(w.z()));
        } else {
            dBodySetPosition(body, real(p.x() - middle_), real(p.z()), real(middle_ - p.y()));
            dBodySetAngularVel(body, real(w.x()), real(w.z()), real(-w.y()));
        }
        bodies_.push_back(body);
    }
    static void near(void* data, dGeomID a, dGeomID b) {
        const auto& world = *static_cast<OdeBodiesOnGround*>(data);
        constexpr int kMost = 8;
        std::array<dContact, kMost> contacts{};
        const int count = dCollide(a, b, kMost, &contacts[0].geom, sizeof(dContact));
        for (int i = 0; i < count; ++i) {
            dContact& contact = contacts[static_cast<std::size_t>(i)];
            contact.surface.mode = dContactApprox1;
            contact.surface.mu = dReal(0.7);
            dJointAttach(dJointCreateContact(world.world_, world.joints_, &contact),
                         dGeomGetBody(contact.geom.g1), dGeomGetBody(contact.geom.g2));
        }
    }

    const ContactMap& map_;
    bool is_ours_;
    double middle_;
    dWorldID world_ = nullptr;
    dSpaceID space_ = nullptr;
    dJointGroupID joints_ = nullptr;
    std::unique_ptr<adapters::OdeGround> ours_;
    std::vector<float> rows_from_north_;
    dHeightfieldDataID data_ = nullptr;
    dGeomID field_ = nullptr;
    std::vector<dBodyID> bodies_;
};

void measure(bool is_quick) {
    dInitODE2(0);
    dAllocateODEDataForThread(dAllocateFlagCollisionData);
    const int our_class = adapters::OdeGround::make_class();
    const ContactMap map = make_contact_map(is_quick ? 513 : 1025, 1.0);
    const std::size_t count = is_quick ? 20 : 1000;
    for (const DropKind& kind : drop_kinds()) {
        const AdapterDrop drop = lay_out_adapter_drop(map, kind, count);
        OdeBodiesOnGround ours(map, drop, our_class), theirs(map, drop, -1);
        compare_steps("ODE", kind.name, count, is_quick ? 20 : 300, ours, theirs);
    }
    dCloseODE();
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    terrane::bench::Arguments arguments(argc, argv, "ode_adapter_benchmark [--quick]");
    const bool is_quick = arguments.has("--quick");
    arguments.finish();
    terrane::bench::measure(is_quick);
    return 0;
}
