// SPDX-License-Identifier: MIT
#include "contact_engine.h"

#include <terrane/collision/ground_queries.h>

#include <array>

namespace terrane::bench {
namespace {

class TerraneEngine final : public ContactEngine {
public:
    explicit TerraneEngine(const Ground& ground) : ground_(ground) {}

    std::string name() const override { return "Terrane"; }
    Cut cut_of_rays() const override { return cut_as_terrane; }
    Cut cut_of_contacts() const override { return cut_as_terrane; }

    bool heights(std::span<const Ray> places, std::span<double> heights_out) override {
        for (std::size_t i = 0; i < places.size(); ++i) {
            heights_out[i] = ground_.height(places[i].from.x(), places[i].from.y()).height;
        }
        return true;
    }

    bool rays(std::span<const Ray> rays, std::span<double> fractions_out) override {
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const RayAnswer answer = ground_.ray(rays[i].from, rays[i].to);
            fractions_out[i] = answer.status == GroundStatus::ok ? answer.fraction : kNoHit;
        }
        return true;
    }

    bool has_margin() const override { return true; }
    bool contacts(const Shape& shape, std::span<const Pose> poses, double margin,
                  std::span<int> counts_out) override {
        std::array<Contact, 16> contacts;
        for (std::size_t i = 0; i < poses.size(); ++i) {
            const ContactAnswer answer = find_contacts(shape, poses[i], ground_, margin, contacts);
            counts_out[i] = static_cast<int>(answer.count);
        }
        return true;
    }

    bool casts(const Shape& shape, std::span<const Sweep> sweeps,
               std::span<double> fractions_out) override {
        Motion motion;
        for (std::size_t i = 0; i < sweeps.size(); ++i) {
            motion.start = sweeps[i].start;
            motion.translation = sweeps[i].translation;
            const CastAnswer answer = cast(shape, motion, ground_);
            fractions_out[i] = answer.hit ? answer.fraction : kNoHit;
        }
        return true;
    }

private:
    Ground ground_;
};

}  // namespace

std::unique_ptr<ContactEngine> make_terrane_engine(const Ground& ground) {
    return std::make_unique<TerraneEngine>(ground);
}

}  // namespace terrane::bench
