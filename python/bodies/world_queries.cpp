// SPDX-License-Identifier: MIT
// World: rays in batches, and the contact events of a step.
#include "bodies/worlds.h"
#include "values/answers.h"
#include "values/arrays.h"

#include <span>

namespace terrane::python {
namespace {

py::object rays(HeldWorld& world, const Ground& ground, const py::object& from,
                const py::object& to, std::uint32_t layers, std::uint64_t except,
                bool include_sensors, bool include_ground) {
    const Rows starts(from, "from_world", 3);
    const Rows ends(to, "to_world", 3);
    const Batch batch({&starts, &ends});
    auto hit = batch.make<bool>();
    auto fraction = batch.make<double>();
    auto body = batch.make<std::uint64_t>();
    auto point = batch.make<double>({3});
    auto normal = batch.make<double>({3});
    auto status = batch.make<std::int8_t>();
    bool* const hit_out = hit.mutable_data();
    double* const fraction_out = fraction.mutable_data();
    std::uint64_t* const body_out = body.mutable_data();
    double* const point_out = point.mutable_data();
    double* const normal_out = normal.mutable_data();
    std::int8_t* const status_out = status.mutable_data();
    const QueryFilter filter{.layers = layers,
                             .except = body_of(except),
                             .include_sensors = include_sensors,
                             .include_ground = include_ground};
    const auto use = world.read();
    without_lock([&] {
        const Eigen::Vector3d none = Eigen::Vector3d::Constant(kNaN);
        for (std::size_t i = 0; i < batch.count(); ++i) {
            const RayQueryAnswer answer =
                use->ray(ground, starts.vector(i), ends.vector(i), filter);
            const bool is_valid = answer.status != QueryStatus::invalid;
            hit_out[i] = is_valid && answer.hit;
            fraction_out[i] = is_valid ? answer.fraction : kNaN;
            body_out[i] = number_of(answer.body);
            write_vector(hit_out[i] ? answer.point_world : none, point_out + 3 * i);
            write_vector(hit_out[i] ? answer.normal : none, normal_out + 3 * i);
            status_out[i] = static_cast<std::int8_t>(answer.status);
        }
    });
    return make_answer("WorldRays", hit, fraction, body, point, normal, status);
}

py::object contact_events(HeldWorld& world) {
    const auto use = world.read();
    const std::span<const ContactEvent> events = use->contact_events();
    const auto count = static_cast<py::ssize_t>(events.size());
    py::array_t<std::uint64_t> a(count);
    py::array_t<std::uint64_t> b(count);
    py::array_t<std::int8_t> phase(count);
    py::array_t<bool> is_sensor(count);
    py::array_t<double> impulse({count, py::ssize_t{3}});
    py::array_t<double> normal({count, py::ssize_t{3}});
    for (std::size_t i = 0; i < events.size(); ++i) {
        const ContactEvent& event = events[i];
        a.mutable_data()[i] = number_of(event.a);
        b.mutable_data()[i] = number_of(event.b);
        phase.mutable_data()[i] = static_cast<std::int8_t>(event.phase);
        is_sensor.mutable_data()[i] = event.is_sensor;
        write_vector(event.impulse, impulse.mutable_data() + 3 * i);
        write_vector(event.normal, normal.mutable_data() + 3 * i);
    }
    return make_answer("ContactEvents", a, b, phase, is_sensor, impulse, normal);
}

}  // namespace

void bind_world_queries(WorldClass& world) {
    const QueryFilter defaults;
    world
        .def("rays", &rays, py::arg("ground"), py::arg("from_world"), py::arg("to_world"),
             py::kw_only(), py::arg("layers") = defaults.layers, py::arg("except_body") = kNoBody,
             py::arg("include_sensors") = defaults.include_sensors,
             py::arg("include_ground") = defaults.include_ground,
             R"(The first bodies, or ground, that segments meet: WorldRays. Without the lock.

from_world, to_world  shape (n, 3), or (3,) for one point that all share, metres
layers                sees bodies on at least one of these layers
except_body           is not seen)")
        .def("contact_events", &contact_events,
             "The contacts of the last step: ContactEvents; empty without report_contacts.");
}

}  // namespace terrane::python
