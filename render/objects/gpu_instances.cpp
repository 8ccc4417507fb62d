// SPDX-License-Identifier: MIT
//
// Source: M. Harris, S. Sengupta, J. D. Owens. Parallel Prefix Sum (Scan) with CUDA. GPU Gems 3, 2007.
#include "objects/gpu_instances.h"

#include "gl/arithmetic_probe.h"
#include "gl/host_state.h"
#include "gl/shader.h"

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

namespace terrane {

std::uint32_t DeviceInstances::small_count(std::uint32_t first) const {
    const auto found = std::lower_bound(
        billboards.begin(), billboards.end(), first,
        [](const Billboards& each, std::uint32_t value) { return each.first < value; });
    return found != billboards.end() && found->first == first ? found->small_count : 0;
}

}  // namespace terrane

namespace terrane::internal {
namespace {

// Layouts of instances.glsl
constexpr std::size_t kGroupObjects = 32, kModelWords = 32, kSlots = 16;
constexpr std::size_t kLevels = InstanceDevice::kMostLevels;
constexpr std::size_t kStateCounts = 4;
constexpr std::size_t kBins = 60 * 64 + 2;  // of FactorCounts

// Most groups of invocations along an axis of a dispatch, on any device.
constexpr std::size_t kMostGroups = 65535;

// Impostors up to this diameter, pixels, show a single view.
constexpr double kSmallImpostor_px = 20.0;

std::size_t size_of(std::size_t count) { return (count + kGroupObjects - 1) / kGroupObjects; }

}  // namespace

float most_small_squared(double pixels_per_radian, float radius) {
    const double most = kSmallImpostor_px / (2.0 * pixels_per_radian * static_cast<double>(radius));
    return static_cast<float>(most * most);
}

Result<std::unique_ptr<GpuInstances>> GpuInstances::create(const ImpostorStore& impostors,
                                                           bool is_hosted) {
    const HostState host(is_hosted);
    std::unique_ptr<GpuInstances> made(new GpuInstances(impostors, is_hosted));
    TERRANE_TRY(probe_arithmetic());
    TERRANE_TRY(made->make_programs());
    made->frame_ = make_buffer();
    glNamedBufferStorage(made->frame_.name(), sizeof(FrameBlock), nullptr, GL_DYNAMIC_STORAGE_BIT);
    TERRANE_TRY(check_gl("make what culls instances"));
    return made;
}

Result<void> GpuInstances::make_programs() {
    const auto make = [](const char* name, std::string_view text) {
        return make_compute_program(name, std::string(instances_glsl) + std::string(text));
    };
    TERRANE_TRY(cull_, make("instances_cull", instances_cull_comp));
    TERRANE_TRY(count_, make("instances_count", instances_count_comp));
    TERRANE_TRY(scan_, make("instances_scan", instances_scan_comp));
    TERRANE_TRY(place_, make("instances_place", instances_place_comp));
    TERRANE_TRY(write_, make("instances_write", instances_write_comp));
    return {};
}

void GpuInstances::clear() {
    models_.clear();
    object_end_ = 0;
    for (std::vector<std::uint32_t>& of_size : freed_) of_size.clear();
    group_count_ = 0;
}

// A cluster takes whole groups of 32 places, so that a later cluster of its size fits where a removed one was.
Result<std::uint32_t> GpuInstances::add(std::span<const DeviceObject> objects) {
    const HostState host(is_hosted_);
    const std::size_t size = size_of(objects.size());
    TERRANE_ASSERT(size <= kSizes, "clusters have at most 256 objects");
    auto first = static_cast<std::uint32_t>(object_end_);
    if (!freed_[size].empty()) {
        first = freed_[size].back();
        freed_[size].pop_back();
    } else {
        const std::size_t end = object_end_ + size * kGroupObjects;
        TERRANE_TRY(objects_.reserve(end * sizeof(DeviceObject), true));
        object_end_ = end;
    }
    objects_.write(first * sizeof(DeviceObject), objects.data(), objects.size_bytes());
    return first;
}

void GpuInstances::remove(std::uint32_t first, std::size_t count) {
    freed_[size_of(count)].push_back(first);
}

void GpuInstances::bind() const {
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, frame_.name());
    GLuint binding = 0;
    for (const DeviceArray* array :
         {&objects_, &clusters_, &groups_, &model_words_, &factors_, &state_, &slots_, &instances_})
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding++, array->name());
}

// Runs a program and makes its results visible to the next.
void GpuInstances::run(const GlProgram& program, std::size_t groups) const {
    const std::size_t rows = (groups + kMostGroups - 1) / kMostGroups;
    const std::size_t columns = rows == 0 ? 0 : (groups + rows - 1) / rows;
    glUseProgram(program.name());
    glDispatchCompute(static_cast<GLuint>(columns), static_cast<GLuint>(rows), 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

void GpuInstances::upload_block() {
    glNamedBufferSubData(frame_.name(), 0, sizeof block_, &block_);
    sent_bytes_ += sizeof block_;
}

template <class Value>
void GpuInstances::send(const DeviceArray& array, std::span<const Value> values) {
    array.write(0, values.data(), values.size_bytes());
    sent_bytes_ += values.size_bytes();
}

template <class Value>
std::vector<Value> GpuInstances::read(const DeviceArray& array, std::size_t first,
                                      std::size_t count) {
    read_bytes_ += count * sizeof(Value);
    return array.read<Value>(first, count);
}

Result<InstanceDevice::Culled> GpuInstances::cull(const DeviceFrame& frame) {
    const HostState host(is_hosted_);
    group_count_ = frame.groups.size();
    sent_bytes_ = read_bytes_ = 0;
    words_.assign(kModelWords * models_.size(), 0);
    const double pixels_per_radian = frame.view.pixels_per_radian();
    for (std::size_t i = 0; i < models_.size(); ++i) {
        const DeviceModel& model = models_[i];
        if (frame.group_of_model[i] == frame.group_of_model[i + 1]) continue;
        std::uint32_t* const words = &words_[kModelWords * i];
        words[0] = static_cast<std::uint32_t>(model.steps.size() - 1);
        words[1] = std::bit_cast<std::uint32_t>(model.log2_ratio);
        words[2] = frame.group_of_model[i];
        words[3] = frame.group_of_model[i + 1];
        for (std::size_t step = 0; step < model.steps.size(); ++step) {
            const DeviceModel::Step& of_step = model.steps[step];
            words[4 + step] = std::bit_cast<std::uint32_t>(of_step.log2_error);
            words[13] |= std::uint32_t{of_step.morphs} << step;
            if (!of_step.impostor) continue;
            words[14] |= std::uint32_t{1} << step;
            const StoredImpostor* stored = impostors_->find(*of_step.impostor);
            words[16 + step] = std::bit_cast<std::uint32_t>(
                stored != nullptr ? most_small_squared(pixels_per_radian, stored->radius) : 0.0f);
        }
    }
    const std::size_t models = models_.size();
    TERRANE_TRY(clusters_.reserve(frame.clusters.size_bytes(), false));
    TERRANE_TRY(groups_.reserve(frame.groups.size_bytes(), false));
    TERRANE_TRY(model_words_.reserve(4 * words_.size(), false));
    TERRANE_TRY(factors_.reserve(4 * kGroupObjects * group_count_, false));
    TERRANE_TRY(state_.reserve(4 * (kStateCounts + group_count_), false));
    const std::size_t slots = models * (kLevels + kSlots) + group_count_ * kSlots;
    TERRANE_TRY(slots_.reserve(4 * std::max(slots, models * kBins), false));

    const WorldPos& eye = frame.view.eye_world;
    block_ = {};
    block_.eye_far = {eye.x(), eye.y(), eye.z(), frame.far_distance};
    for (std::size_t i = 0; i < frame.normals.size(); ++i) {
        const Eigen::Vector3d& n = frame.normals[i];
        block_.normals[i] = {n.x(), n.y(), n.z(), 0.0};
    }
    block_.scalars = {frame.near_distance, frame.log2_pixels, frame.log2_least, 0.0f};
    block_.counts = {static_cast<std::uint32_t>(models),
                     static_cast<std::uint32_t>(frame.normals.size()), 0, 0};
    upload_block();
    send(clusters_, frame.clusters);
    send(groups_, frame.groups);
    send(model_words_, std::span<const std::uint32_t>(words_));
    constexpr std::uint32_t kNothing = 0;
    glClearNamedBufferSubData(state_.name(), GL_R32UI, 0, 4 * kStateCounts, GL_RED_INTEGER,
                              GL_UNSIGNED_INT, &kNothing);
    glClearNamedBufferSubData(slots_.name(), GL_R32UI, 0,
                              static_cast<GLsizeiptr>(4 * models * kBins), GL_RED_INTEGER,
                              GL_UNSIGNED_INT, &kNothing);
    bind();
    for (const GlProgram* program : {&cull_, &count_, &write_})
        glProgramUniform1ui(program->name(), 0, static_cast<GLuint>(group_count_));
    run(cull_, group_count_);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    const std::vector<std::uint32_t> counts = read<std::uint32_t>(state_, 0, kStateCounts);
    // an instance has at most two levels
    TERRANE_TRY(instances_.reserve(2 * sizeof(ObjectInstance) * std::size_t{counts[0]}, false));
    TERRANE_TRY(check_gl("cull instances on the device"));
    return Culled{counts[0], counts[1], counts[2]};
}

std::span<const std::uint32_t> GpuInstances::factor_counts(std::uint32_t model) {
    const HostState host(is_hosted_);
    factor_counts_ = read<std::uint32_t>(slots_, kBins * model, kBins);
    return factor_counts_;
}

InstanceDevice::Chosen GpuInstances::choose(float log2_threshold) {
    const HostState host(is_hosted_);
    block_.scalars[3] = log2_threshold;
    upload_block();
    constexpr std::uint32_t kNothing = 0;
    state_.write(4 * 3, &kNothing, sizeof kNothing);
    bind();
    run(count_, group_count_);
    run(scan_, models_.size() * kSlots);
    run(place_, 1);
    run(write_, group_count_);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_VERTEX_ATTRIB_ARRAY_BARRIER_BIT);
    const std::vector<std::uint32_t> counts =
        read<std::uint32_t>(slots_, models_.size() * kLevels, models_.size() * kSlots);
    level_counts_.clear();
    drawn_.buffer = instances_.name();
    drawn_.count = 0;
    drawn_.billboards.clear();
    for (std::size_t i = 0; i < counts.size(); i += 2) {
        const std::uint32_t count = counts[i] + counts[i + 1];
        level_counts_.push_back(count);
        const std::vector<DeviceModel::Step>& steps = models_[i / kSlots].steps;
        const std::size_t level = i % kSlots / 2;
        if (count > 0 && level < steps.size() && steps[level].impostor)
            drawn_.billboards.push_back({static_cast<std::uint32_t>(drawn_.count), counts[i]});
        drawn_.count += count;
    }
    return {.instances = &drawn_,
            .counts = level_counts_,
            .objects = read<std::uint32_t>(state_, 3, 1)[0]};
}

std::size_t GpuInstances::bytes() const {
    std::size_t bytes = sizeof block_;
    for (const DeviceArray* array :
         {&objects_, &clusters_, &groups_, &model_words_, &factors_, &state_, &slots_, &instances_})
        bytes += array->bytes();
    return bytes;
}

}  // namespace terrane::internal
