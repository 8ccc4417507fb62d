// SPDX-License-Identifier: MIT
#include "world/solver/body_checks.h"
#include "world/world_bytes.h"
#include "world/world_state.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>

namespace terrane::internal {
namespace {

constexpr double kMostStoredSize = 1e5;  // metres; validate(Shape) has the same limit
constexpr std::uint32_t kLastConvexKind = std::variant_size_v<ConvexShape> - 1;
constexpr std::uint32_t kLastKind = std::variant_size_v<Shape> - 1;
constexpr std::size_t kVertexBytes = 24, kLeastPartBytes = 104;

const void* data_of(const ConvexHull& hull) { return &hull_data(hull); }
const void* data_of(const Compound& compound) { return &compound_data(compound); }

}  // namespace

void ShapeWriter::write(const Shape& shape) {
    out_.word("kind", static_cast<std::uint32_t>(shape.index()));
    std::visit([this](const auto& each) { write_shape(each); }, shape);
}

void ShapeWriter::write_shape(const Sphere& sphere) {
    out_.number("radius", sphere.radius, 0.0, kMostStoredSize);
}

void ShapeWriter::write_shape(const Capsule& capsule) {
    out_.number("radius", capsule.radius, 0.0, kMostStoredSize);
    out_.number("half_height", capsule.half_height, 0.0, kMostStoredSize);
}

void ShapeWriter::write_shape(const Box& box) {
    out_.vector("half_extents", box.half_extents, kMostStoredSize);
}

void ShapeWriter::write_shape(const ConvexHull& hull) {
    if (!write_index(hulls_, data_of(hull))) return;
    out_.list("vertices", hull.vertices(), kVertexBytes, [this](const Eigen::Vector3d& vertex) {
        out_.vector("vertex", vertex, ConvexHull::kLargestCoordinate);
    });
}

void ShapeWriter::write_shape(const Compound& compound) {
    if (!write_index(compounds_, data_of(compound))) return;
    out_.list("parts", compound.parts(), kLeastPartBytes, [this](const CompoundPart& part) {
        out_.word("kind", static_cast<std::uint32_t>(part.shape.index()));
        std::visit([this](const auto& each) { write_shape(each); }, part.shape);
        out_.pose("pose", part.body_from_part);
    });
}

/// Writes the index of shared data. Returns whether the data itself must follow.
bool ShapeWriter::write_index(Indices& known, const void* data) {
    const auto [found, is_new] = known.emplace(data, static_cast<std::uint32_t>(known.size()));
    out_.word("index", found->second);
    return is_new;
}

Shape ShapeReader::read() { return read_kind<Shape>(kLastKind); }

template <class AnyShape>
AnyShape ShapeReader::read_kind(std::uint32_t last_kind) {
    std::uint32_t kind = 0;
    in_.integer("shape kind", kind, last_kind);
    if (kind == 0) {
        Sphere sphere;
        in_.number("radius", sphere.radius, 0.0, kMostStoredSize);
        return sphere;
    }
    if (kind == 1) {
        Capsule capsule;
        in_.number("radius", capsule.radius, 0.0, kMostStoredSize);
        in_.number("half_height", capsule.half_height, 0.0, kMostStoredSize);
        return capsule;
    }
    if (kind == 2) {
        Box box;
        for (int axis = 0; axis < 3; ++axis) {
            in_.number("half_extents", box.half_extents[axis], 0.0, kMostStoredSize);
        }
        return box;
    }
    if constexpr (std::is_same_v<AnyShape, Shape>) {
        if (kind == 4) return read_compound();
    }
    return read_hull();
}

ConvexHull ShapeReader::read_hull() {
    static const ConvexHull point = *ConvexHull::create(std::vector{Eigen::Vector3d(0, 0, 0)});
    std::uint32_t index = 0;
    in_.integer("hull index", index, static_cast<std::uint32_t>(hulls_.size()));
    if (in_.has_failed()) return point;
    if (index < hulls_.size()) return hulls_[index];
    std::vector<Eigen::Vector3d> vertices;
    in_.list("hull vertices", vertices, kVertexBytes, [this](Eigen::Vector3d& vertex) {
        in_.vector("hull vertex", vertex, ConvexHull::kLargestCoordinate);
    });
    if (in_.has_failed()) return point;
    const Result<ConvexHull> hull = ConvexHull::create(vertices);
    if (!hull) {
        in_.fail("hull", hull.error().message);
        return point;
    }
    return hulls_.emplace_back(*hull);
}

Compound ShapeReader::read_compound() {
    static const Compound sphere = *Compound::create(std::vector{CompoundPart{Sphere{}, {}}});
    std::uint32_t index = 0;
    in_.integer("compound index", index, static_cast<std::uint32_t>(compounds_.size()));
    if (in_.has_failed()) return sphere;
    if (index < compounds_.size()) return compounds_[index];
    std::vector<CompoundPart> parts;
    in_.list("compound parts", parts, kLeastPartBytes, [this](CompoundPart& part) {
        part.shape = read_kind<ConvexShape>(kLastConvexKind);
        in_.pose("pose of a compound part", part.body_from_part);
    });
    if (in_.has_failed()) return sphere;
    const Result<Compound> compound = Compound::create(parts);
    if (!compound) {
        in_.fail("compound", compound.error().message);
        return sphere;
    }
    return compounds_.emplace_back(*compound);
}

}  // namespace terrane::internal

// Format of a saved world: magic, version, settings, ids, bodies, contacts of bodies, touching pairs, checksum. Data
// derived from settings and shapes is recomputed; queries, islands and events are rebuilt by the next call that needs
// them.

namespace terrane {
namespace {

using internal::BodyRole;
using internal::FieldReader;
using internal::FieldWriter;

constexpr std::uint64_t kMagic = 0x444c524f574e5254u;  // "TRNWORLD"
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderBytes = 12, kChecksumBytes = 8;
constexpr std::size_t kIndexBytes = 4, kManifoldBytes = 12, kTouchingPairBytes = 17;

/// Presence of callbacks, which are not saved themselves.
struct CallbackFlags {
    bool gravity_at = false, may_collide = false;
};

template <class Stream>
void list_callbacks(Stream& stream, auto& callbacks) {
    stream.flag("gravity_at", callbacks.gravity_at);
    stream.flag("may_collide", callbacks.may_collide);
}

/// Serialises the settings of a world without the callbacks and the number of threads.
template <class Stream>
void list_world_settings(Stream& stream, auto& settings) {
    stream.vector("gravity", settings.gravity, internal::kMostStoredSpeed);
    stream.number("max_substep", settings.max_substep, 0.0, 1.0);
    stream.flag("allow_sleep", settings.allow_sleep);
    stream.flag("collide_bodies", settings.collide_bodies);
    stream.flag("report_contacts", settings.report_contacts);
    stream.flag("measure_depth", settings.measure_depth);
    // Value 3 is a former kind, which found the same pairs.
    stream.choice("broadphase", settings.broadphase, BroadphaseKind{3});
}

/// Serialises the settings of a body without the shape. check_body() checks their ranges.
template <class Stream>
void list_body_settings(Stream& stream, auto& settings) {
    stream.choice("type", settings.type, BodyType::dynamic_body);
    stream.number("mass", settings.mass, 0.0, internal::kInfinity);
    stream.number("friction", settings.friction, 0.0, internal::kInfinity);
    stream.number("restitution", settings.restitution, 0.0, internal::kInfinity);
    stream.number("contact_tolerance", settings.contact_tolerance, 0.0, internal::kInfinity);
    stream.word("layers", settings.filter.layers);
    stream.word("collides_with", settings.filter.collides_with);
    stream.flag("is_sensor", settings.is_sensor);
    stream.flag("rotates", settings.rotates);
}

/// Serialises all other state of a body that steps change. Add new state of bodies here.
template <class Stream>
void list_body_state(Stream& stream, auto& world, std::size_t index) {
    auto& body = world.bodies[index];
    auto& state = world.states[index];
    auto& record = world.records[index];
    stream.pose("pose", state.pose);
    stream.choice("condition", state.condition, BodyCondition::fixed);
    stream.pose("centred pose", body.pose);
    stream.vector("velocity", body.velocity.linear, internal::kMostStoredSpeed);
    stream.vector("angular_velocity", body.velocity.angular, internal::kMostStoredSpin);
    stream.vector("acceleration", body.acceleration, internal::kMostStoredSpeed);
    stream.flag("started_deep", body.started_deep);
    stream.flag("is_fresh", body.is_fresh);
    stream.place("escape_translation", body.escape_translation);
    stream.flag("is_placed_anew", record.is_placed_anew);
    stream.number("quiet time", record.quiet_time, 0.0, internal::kMostStoredLength);
    stream.integer("sleep group", world.sleep_groups[index],
                   static_cast<std::uint32_t>(world.bodies.size() - 1));
    stream.impulse("force", record.force);
    stream.impulse("torque", record.torque);
    internal::GroundContactCache::list_fields(stream, world.gates[index].contacts());

    bool has_target = record.target.has_value();
    stream.flag("has target", has_target);
    if (!has_target) return;
    if constexpr (Stream::kReads) record.target.emplace();
    stream.pose("target", record.target->pose);
    stream.number("time to the target", record.target->time_left, 0.0, kMostStep);
}

template <class Stream>
void list_touching_pair(Stream& stream, auto& pair) {
    stream.word("body a", pair.a.index);
    stream.word("generation of a", pair.a.generation);
    stream.word("body b", pair.b.index);
    stream.word("generation of b", pair.b.generation);
    stream.flag("is_sensor", pair.is_sensor);
}

void fail_unless(FieldReader& in, bool condition, const char* name, const char* what) {
    if (!condition) in.fail(name, what);
}

/// Fails if a condition does not match the body's type, or if the body has a velocity but must not move.
void check_condition(FieldReader& in, BodyType type, const internal::RigidBody& body,
                     BodyCondition condition) {
    const bool is_dynamic_body = type == BodyType::dynamic_body;
    const bool is_fixed = condition == BodyCondition::fixed;
    fail_unless(in, is_fixed == (type == BodyType::static_body), "condition",
                "must be fixed for a static body only");
    fail_unless(in, is_dynamic_body || is_fixed || condition == BodyCondition::awake, "condition",
                "must be awake for a kinematic body");
    const bool rests = is_fixed || condition == BodyCondition::asleep;
    fail_unless(in,
                !rests || (body.velocity.linear.isZero(0.0) && body.velocity.angular.isZero(0.0)),
                "velocity", "must be 0 at rest");
}

void read_ids(FieldReader& in, internal::SlotIds& ids_out) {
    std::vector<std::uint32_t> generations, free;
    in.list("slots", generations, kIndexBytes,
            [&](std::uint32_t& generation) { in.word("generation", generation); });
    in.list("free slots", free, kIndexBytes,
            [&](std::uint32_t& slot) { in.word("free slot", slot); });
    std::vector<bool> is_free(generations.size(), false);
    for (const std::uint32_t slot : free) {
        const bool is_valid = slot < is_free.size() && !is_free[slot];
        fail_unless(in, is_valid, "free slot", "must be a slot, and be listed once");
        if (in.has_failed()) return;
        is_free[slot] = true;
    }
    ids_out.restore(std::move(generations), std::move(free));
}

std::vector<internal::PairManifold> read_manifolds(FieldReader& in, const internal::SlotIds& ids,
                                                   std::span<const internal::RigidBody> bodies) {
    std::vector<internal::PairManifold> manifolds;
    std::size_t index = 0;
    std::size_t left = 0;  // remaining manifolds of the current pair
    in.list("contacts of bodies", manifolds, kManifoldBytes, [&](internal::PairManifold& manifold) {
        in.begin("contact manifold", index);
        internal::PairManifold::list_fields(in, manifold);
        const auto [a, b] = manifold.pair;
        const bool exists = a < b && b < bodies.size() && ids.is_used(a) && ids.is_used(b) &&
                            (internal::is_dynamic(bodies[a]) || internal::is_dynamic(bodies[b]));
        fail_unless(in, exists, "pair", "must be two bodies, ascending, one of them dynamic");
        if (in.has_failed()) return;
        const BodyPair before = index > 0 ? manifolds[index - 1].pair : BodyPair{0, 0};
        ++index;
        if (left > 0) {
            --left;
            fail_unless(in, manifold.pair == before, "pair", "must have all its manifolds");
            return;
        }
        const bool ascends = before.a != a ? before.a < a : before.b < b;
        fail_unless(in, ascends || index == 1, "pair", "must come after the pair before");
        fail_unless(in, manifold.count() > 0, "contact count",
                    "must not be 0 in the first manifold");
        left = internal::PairManifold::max_count(bodies[a], bodies[b]) - 1;
    });
    fail_unless(in, left == 0, "pair", "must have all its manifolds");
    return manifolds;
}

std::vector<internal::TouchingPair> read_touching(FieldReader& in, std::size_t slot_count) {
    std::vector<internal::TouchingPair> touching;
    std::size_t index = 0;
    in.list("touching pairs", touching, kTouchingPairBytes, [&](internal::TouchingPair& pair) {
        in.begin("touching pair", index);
        list_touching_pair(in, pair);
        const bool exists = pair.a.index < pair.b.index && pair.a.index < slot_count &&
                            (pair.b.index < slot_count || pair.b == BodyId{});
        fail_unless(in, exists, "pair", "must be two slots, or a slot and the ground");
        if (index > 0 && !in.has_failed()) {
            const internal::TouchingPair& before = touching[index - 1];
            fail_unless(in, std::tie(before.a, before.b) < std::tie(pair.a, pair.b), "pair",
                        "must come after the pair before");
        }
        ++index;
    });
    return touching;
}

/// Checks header and checksum, and returns the fields between them.
Result<std::span<const std::byte>> open_bytes(std::span<const std::byte> bytes) {
    const auto refuse = [](const std::string& what) {
        return fail(ErrorCode::bad_data, "saved world: " + what);
    };
    if (bytes.size() < kHeaderBytes + kChecksumBytes) {
        return refuse("too short, got " + std::to_string(bytes.size()) + " bytes");
    }
    FieldReader header(bytes);
    if (header.get("magic", 8) != kMagic) return refuse("the bytes are not of a world");
    if (const std::uint64_t version = header.get("version", 4); version != kVersion) {
        return refuse("version must be " + std::to_string(kVersion) + ", got " +
                      std::to_string(version));
    }
    const std::size_t end = bytes.size() - kChecksumBytes;
    FieldReader footer(bytes.subspan(end));
    if (footer.get("checksum", kChecksumBytes) != internal::checksum_of(bytes.first(end))) {
        return refuse("the checksum is not that of the bytes");
    }
    return bytes.subspan(kHeaderBytes, end - kHeaderBytes);
}

Result<void> check_callback(const char* name, bool was_there, bool is_there) {
    if (was_there == is_there) return {};
    return fail(ErrorCode::invalid_argument,
                std::string(name) + (was_there ? " must be given, as the saved world had one"
                                               : " must be empty, as the saved world had none"));
}

}  // namespace

std::vector<std::byte> World::State::save() const {
    FieldWriter out;
    internal::ShapeWriter shapes(out);
    out.put(kMagic, 8);
    out.put(kVersion, 4);
    const CallbackFlags flags{static_cast<bool>(settings.callbacks.gravity_at),
                              static_cast<bool>(settings.callbacks.may_collide)};
    list_callbacks(out, flags);
    list_world_settings(out, settings);
    const auto write_index = [&](std::uint32_t index) { out.word("", index); };
    out.list("", ids.generations(), kIndexBytes, write_index);
    out.list("", ids.free_slots(), kIndexBytes, write_index);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (!ids.is_used(i)) continue;
        shapes.write(body_settings[i].shape);
        list_body_settings(out, body_settings[i]);
        save_role(i, out);
        list_body_state(out, *this, i);
    }
    out.list("", island_solver.manifolds(), kManifoldBytes,
             [&](const auto& manifold) { internal::PairManifold::list_fields(out, manifold); });
    out.list("", contacts.touching(), kTouchingPairBytes,
             [&](const auto& pair) { list_touching_pair(out, pair); });
    out.put(internal::checksum_of(out.bytes()), kChecksumBytes);
    return std::move(out.bytes());
}

/// Writes the role of a body, and the settings and state of a vehicle or character.
void World::State::save_role(std::size_t index, FieldWriter& out) const {
    const internal::Vehicle* const vehicle = records[index].vehicle.get();
    const internal::Character* const character = records[index].character.get();
    const BodyRole role = vehicle != nullptr     ? BodyRole::vehicle
                          : character != nullptr ? BodyRole::character
                                                 : BodyRole::plain;
    out.choice("", role, BodyRole::character);
    if (vehicle != nullptr) {
        out.word("", static_cast<std::uint32_t>(vehicle->settings().bodywork.size()));
        internal::list_vehicle_settings(out, vehicle->settings());
        internal::Vehicle::list_fields(out, *vehicle);
    } else if (character != nullptr) {
        internal::list_character_settings(out, character->settings());
        internal::Character::list_fields(out, *character);
    }
}

/// @param own settings of the body
void World::State::load_role(std::size_t index, const BodySettings& own, FieldReader& in) {
    BodyRole role = BodyRole::plain;
    in.choice("role", role, BodyRole::character);
    if (role == BodyRole::vehicle) load_vehicle(index, own, in);
    if (role == BodyRole::character) load_character(index, own, in);
}

void World::State::load_vehicle(std::size_t index, const BodySettings& own, FieldReader& in) {
    VehicleSettings made;
    std::uint32_t bodywork_count = 0;
    in.word("bodywork count", bodywork_count);
    internal::list_vehicle_settings(in, made);
    const auto* const chassis = std::get_if<Compound>(&own.shape);
    const bool has_parts = chassis != nullptr && bodywork_count < chassis->parts().size() &&
                           own.type == BodyType::dynamic_body &&
                           std::holds_alternative<Box>(chassis->parts()[0].shape);
    fail_unless(in, has_parts, "shape", "must be a compound of a chassis box, bodywork and wheels");
    if (in.has_failed()) return;
    const std::span<const CompoundPart> chassis_parts = chassis->parts();
    made.chassis_half_extents = std::get<Box>(chassis_parts[0].shape).half_extents;
    made.bodywork.assign(chassis_parts.begin() + 1, chassis_parts.begin() + 1 + bodywork_count);
    made.mass = own.mass;
    made.friction = own.friction;
    made.restitution = own.restitution;
    made.filter = own.filter;
    if (auto ok = internal::check_vehicle(made); !ok) {
        return in.fail("vehicle", ok.error().message);
    }
    auto vehicle = std::make_unique<internal::Vehicle>(made);
    internal::Vehicle::list_fields(in, *vehicle);
    vehicle->restore();
    records[index].vehicle = std::move(vehicle);
    actuators.vehicles.push_back(static_cast<std::uint32_t>(index));
}

void World::State::load_character(std::size_t index, const BodySettings& own, FieldReader& in) {
    CharacterSettings made;
    internal::list_character_settings(in, made);
    const auto* const capsule = std::get_if<Capsule>(&own.shape);
    fail_unless(in, capsule != nullptr && own.type == BodyType::dynamic_body && !own.rotates,
                "shape", "must be a capsule that does not rotate");
    if (in.has_failed()) return;
    made.radius = capsule->radius;
    made.half_height = capsule->half_height;
    made.mass = own.mass;
    made.contact_tolerance = own.contact_tolerance;
    made.filter = own.filter;
    if (auto ok = internal::check_character(made); !ok) {
        return in.fail("character", ok.error().message);
    }
    auto character = std::make_unique<internal::Character>(made);
    internal::Character::list_fields(in, *character);
    records[index].character = std::move(character);
    actuators.characters.push_back(static_cast<std::uint32_t>(index));
}

void World::State::load_body(std::size_t index, FieldReader& in, internal::ShapeReader& shapes) {
    in.begin("body", index);
    BodySettings own;
    own.shape = shapes.read();
    list_body_settings(in, own);
    if (in.has_failed()) return;
    if (auto ok = internal::check_body(own, {}); !ok)
        return in.fail("settings", ok.error().message);
    fail_unless(in, own.contact_tolerance > 0.0, "contact_tolerance", "must be above 0");
    internal::CentredShape shape{own.shape, {}};
    if (own.type == BodyType::dynamic_body) {
        Result<internal::CentredShape> centred = internal::make_centred(own.shape);
        if (!centred) return in.fail("shape", centred.error().message);
        shape = std::move(*centred);
    }
    load_role(index, own, in);
    if (in.has_failed()) return;
    const BodyRecord& record = records[index];
    internal::MassProperties mass;
    if (record.vehicle != nullptr) {
        mass = record.vehicle->mass();
        shape = {own.shape, {}};
    }
    set_up(index, own, std::move(shape), record.vehicle != nullptr ? &mass : nullptr);
    list_body_state(in, *this, index);
    check_condition(in, own.type, bodies[index], states[index].condition);
    if (auto ok = check_force(index, record.force); !ok) in.fail("force", ok.error().message);
    if (auto ok = check_torque(index, record.torque); !ok) in.fail("torque", ok.error().message);
    fail_unless(in, !record.target || own.type == BodyType::kinematic_body, "target",
                "must be of a kinematic body");
    states[index].velocity = bodies[index].velocity.linear;
    states[index].angular_velocity = bodies[index].velocity.angular;
    show_to_actuators(index);
}

Result<World> World::load(std::span<const std::byte> bytes, const WorldCallbacks& callbacks,
                          int worker_count) {
    TERRANE_TRY(const std::span<const std::byte> fields, open_bytes(bytes));
    FieldReader in(fields);
    CallbackFlags flags;
    WorldSettings settings{.worker_count = worker_count, .callbacks = callbacks};
    list_callbacks(in, flags);
    list_world_settings(in, settings);
    if (settings.broadphase > BroadphaseKind::two_scene) settings.broadphase = BroadphaseKind::sap;
    const auto bad_data = [](const std::string& message) {
        return fail(ErrorCode::bad_data, message);
    };
    if (in.has_failed()) return bad_data(in.error());
    TERRANE_TRY(internal::check_value("worker_count", worker_count, 1, 64));
    if (auto ok = internal::check_world(settings); !ok) {
        return bad_data("saved world: " + ok.error().message);
    }
    for (const auto& ok :
         {check_callback("gravity_at", flags.gravity_at, static_cast<bool>(callbacks.gravity_at)),
          check_callback("may_collide", flags.may_collide,
                         static_cast<bool>(callbacks.may_collide))}) {
        if (!ok) return tl::unexpected<Error>(ok.error());
    }

    auto state = std::make_unique<State>(settings);
    read_ids(in, state->ids);
    if (in.has_failed()) return bad_data(in.error());
    state->resize(state->ids.slot_count());
    internal::ShapeReader shapes(in);
    for (std::size_t i = 0; i < state->bodies.size(); ++i) {
        state->states[i].condition = BodyCondition::removed;
        if (state->ids.is_used(i)) state->load_body(i, in, shapes);
        if (in.has_failed()) return bad_data(in.error());
    }
    state->island_solver.restore_contacts(read_manifolds(in, state->ids, state->bodies));
    state->contacts.restore(read_touching(in, state->bodies.size()));
    in.begin(nullptr, 0);
    fail_unless(in, in.bytes_left() == 0, "end", "must come after the last field");
    if (in.has_failed()) return bad_data(in.error());
    return World(std::move(state));
}

std::vector<std::byte> World::save() const { return state_->save(); }

}  // namespace terrane
