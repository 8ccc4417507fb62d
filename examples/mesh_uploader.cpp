// SPDX-License-Identifier: MIT
// Which data of a TerrainMesh are uploaded to a GPU, and when. Here the device is a few arrays, and its vertex shader
// is a function that reads nothing else. Its results are compared with the mesh.
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/terrain.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <unordered_map>
#include <vector>

using namespace terrane;

namespace {

constexpr std::size_t kSlotSamples = std::size_t{kChunkSamples} * kChunkSamples;

// One draw call, and what its vertex shader reads beside the buffers.
struct DrawCall {
    std::uint32_t first_index, index_count;  // into Device::indices
    std::uint32_t first_vertex;              // of the chunk's slot in Device::heights
    std::int32_t first_offset;               // in Device::offsets, or -1: nothing morphs
    std::int32_t corner_x, corner_y;         // south-west sample minus eye, finest spacings
    std::int32_t step;                       // finest spacings between samples
};

struct Device {
    std::vector<std::int32_t> heights;   // slots of 129 x 129, for resident chunks
    std::vector<std::uint16_t> indices;  // written each frame
    std::vector<float> offsets;          // written each frame, of chunks that morph
    std::vector<DrawCall> draws;         // written each frame
    float spacing, quantum;              // metres; written once
    std::int32_t eye_z;                  // quanta; each frame
    float remainder[3];                  // eye minus its lattice point, metres; each frame
};

class Uploader {
public:
    explicit Uploader(const Lattice& lattice) : lattice_(lattice) {
        device_.spacing = static_cast<float>(lattice.spacing);
        device_.quantum = static_cast<float>(lattice.quantum);
    }

    void upload(const TerrainMesh& mesh, const WorldPos& eye_world) {
        forget_absent(*mesh.resident);
        // The eye as integers and a remainder: positions are subtracted before they become float.
        const auto x = static_cast<std::int64_t>(
            std::floor((eye_world.x() - lattice_.origin_x) / lattice_.spacing));
        const auto y = static_cast<std::int64_t>(
            std::floor((eye_world.y() - lattice_.origin_y) / lattice_.spacing));
        device_.eye_z = static_cast<std::int32_t>(std::floor(eye_world.z() / lattice_.quantum));
        device_.remainder[0] = static_cast<float>(eye_world.x() - lattice_.x(x));
        device_.remainder[1] = static_cast<float>(eye_world.y() - lattice_.y(y));
        device_.remainder[2] = static_cast<float>(eye_world.z() - lattice_.quantum * device_.eye_z);

        device_.indices.assign(mesh.indices.begin(), mesh.indices.end());
        device_.offsets.clear();
        device_.draws.clear();
        for (const MeshChunk& part : mesh.chunks) {
            if (part.index_count == 0) continue;
            const Chunk& chunk = *part.chunk;
            DrawCall draw{};
            draw.first_index = part.first_index;
            draw.index_count = part.index_count;
            draw.first_vertex = static_cast<std::uint32_t>(slot_of(chunk) * kSlotSamples);
            draw.first_offset = -1;
            if (part.offsets != nullptr) {
                draw.first_offset = static_cast<std::int32_t>(device_.offsets.size());
                device_.offsets.insert(device_.offsets.end(), part.offsets,
                                       part.offsets + kSlotSamples);
            }
            draw.corner_x = static_cast<std::int32_t>(chunk.corner.x - x);
            draw.corner_y = static_cast<std::int32_t>(chunk.corner.y - y);
            draw.step = static_cast<std::int32_t>(chunk.step);
            device_.draws.push_back(draw);
        }
    }

    const Device& device() const { return device_; }
    std::size_t uploaded() const { return uploaded_; }

private:
    // Heights of a chunk never change: they are uploaded when it is first drawn.
    std::size_t slot_of(const Chunk& chunk) {
        if (const auto found = slots_.find(chunk.key); found != slots_.end()) return found->second;
        if (free_.empty()) {
            free_.push_back(device_.heights.size() / kSlotSamples);
            device_.heights.resize(device_.heights.size() + kSlotSamples);
        }
        const std::size_t slot = free_.back();
        free_.pop_back();
        std::memcpy(&device_.heights[slot * kSlotSamples], chunk.heights.data(),
                    kSlotSamples * sizeof(std::int32_t));
        ++uploaded_;
        return slots_[chunk.key] = slot;
    }

    // A chunk that is no longer resident is not drawn any more, so its slot is free.
    void forget_absent(const ResidentSet& resident) {
        std::erase_if(slots_, [&](const auto& entry) {
            if (resident.find_chunk(entry.first) != nullptr) return false;
            free_.push_back(entry.second);
            return true;
        });
    }

    Lattice lattice_;
    Device device_;
    std::unordered_map<ChunkKey, std::size_t, ChunkKeyHash> slots_;
    std::vector<std::size_t> free_;
    std::size_t uploaded_ = 0;
};

// The vertex shader: metres from the eye, world axes. Reads the device only.
LocalVec shade(const Device& device, const DrawCall& draw, std::uint16_t index) {
    const std::int32_t column = index % kChunkSamples, row = index / kChunkSamples;
    const std::int32_t x = draw.corner_x + draw.step * column;
    const std::int32_t y = draw.corner_y + draw.step * row;
    const std::int32_t z = device.heights[draw.first_vertex + index] - device.eye_z;
    LocalVec p(static_cast<float>(x) * device.spacing - device.remainder[0],
               static_cast<float>(y) * device.spacing - device.remainder[1],
               static_cast<float>(z) * device.quantum - device.remainder[2]);
    // Added last, so that vertices that do not morph have the same bits in every chunk.
    if (draw.first_offset >= 0) {
        p.z() += device.offsets[static_cast<std::size_t>(draw.first_offset) + index];
    }
    return p;
}

// Largest distance of a shaded vertex from its position in the mesh, divided by 1 m plus its distance from the eye.
double largest_error(const TerrainMesh& mesh, const Device& device, const WorldPos& eye_world) {
    const Lattice& lattice = mesh.resident->lattice();
    double largest = 0.0;
    std::size_t next = 0;
    for (const MeshChunk& part : mesh.chunks) {
        if (part.index_count == 0) continue;
        const DrawCall& draw = device.draws[next++];
        for (std::uint32_t i = 0; i < draw.index_count; ++i) {
            const std::uint16_t index = device.indices[draw.first_index + i];
            const std::int64_t column = index % kChunkSamples, row = index / kChunkSamples;
            const WorldPos p_world(lattice.x(part.chunk->corner.x + column * part.chunk->step),
                                   lattice.y(part.chunk->corner.y + row * part.chunk->step),
                                   part.displayed_height(index, lattice.quantum));
            const LocalVec expected = to_local(p_world, eye_world);
            const double off = (shade(device, draw, index) - expected).cast<double>().norm();
            largest = std::max(largest, off / (1.0 + expected.cast<double>().norm()));
        }
    }
    return largest;
}

}  // namespace

int main() {
    const auto source = FractalHeights::create({.seed = 7}).value();
    Terrain terrain = Terrain::create(source, {.paging = {.worker_count = 0},
                                               .meshes = {.triangle_budget = 50'000}})
                          .value();
    Uploader uploader(source->lattice());
    double largest = 0.0;
    std::size_t triangles = 0;
    for (int i = 0; i < 60; ++i) {
        const WorldPos eye(0.3, 20.7 * i, 900.1);
        const View view =
            look_at(eye, eye + Eigen::Vector3d(0, 4000, -700), 1.0, 1280, 720).value();
        const TerrainMesh& mesh = terrain.update({{.view = view}}, {}, i / 60.0).meshes[0];
        if (mesh.triangle_count == 0) continue;  // the roots have not arrived
        uploader.upload(mesh, eye);
        largest = std::max(largest, largest_error(mesh, uploader.device(), eye));
        triangles = mesh.triangle_count;
    }
    std::printf(
        "%zu triangles; %zu chunks were uploaded in 60 frames; vertices are right to %.0e\n",
        triangles, uploader.uploaded(), largest);
    return triangles > 0 && largest < 1e-6 ? 0 : 1;
}
