// SPDX-License-Identifier: MIT
#include "ground/pager.h"
#include "values/arrays.h"

namespace terrane::python {
namespace {

// A chunk, as Python holds it.
struct HeldChunk {
    std::shared_ptr<const Chunk> chunk;
    Lattice lattice;
};

py::array_t<std::int32_t> keys_of(const Resident& resident) {
    const auto chunks = resident.set->chunks();
    py::array_t<std::int32_t> keys({static_cast<py::ssize_t>(chunks.size()), py::ssize_t{3}});
    std::int32_t* out = keys.mutable_data();
    for (const ResidentChunk& chunk : chunks) {
        *out++ = chunk->key.level;
        *out++ = chunk->key.x;
        *out++ = chunk->key.y;
    }
    return keys;
}

HeldChunk chunk_of(const Resident& resident, std::size_t index) {
    const auto chunks = resident.set->chunks();
    if (index >= chunks.size())
        throw py::index_error("there are " + std::to_string(chunks.size()) +
                              " chunks, none of index " + std::to_string(index));
    return {chunks[index], resident.set->lattice()};
}

py::object flags_of(const py::object& self) {
    const auto& chunk = *py::cast<const HeldChunk&>(self).chunk;
    if (chunk.cell_flags.empty()) return py::none();
    return view_of(chunk.cell_flags.data(), {kChunkCells, kChunkCells}, self);
}

void bind_chunk(py::module_& module) {
    py::class_<HeldChunk>(module, "Chunk",
                          "One square of 129 x 129 heights with certified bounds. Immutable.")
        .def_property_readonly(
            "key",
            [](const HeldChunk& held) {
                const ChunkKey& key = held.chunk->key;
                return py::make_tuple(key.level, key.x, key.y);
            },
            "Level (0 is the coarsest), column and row.")
        .def_property_readonly(
            "origin",
            [](const HeldChunk& held) {
                const LatticePoint& corner = held.chunk->corner;
                return py::make_tuple(held.lattice.x(corner.x), held.lattice.y(corner.y));
            },
            "World x and y of the south-western sample, metres.")
        .def_property_readonly(
            "spacing",
            [](const HeldChunk& held) {
                return held.lattice.spacing * static_cast<double>(held.chunk->step);
            },
            "Between neighbouring samples, metres.")
        .def_property_readonly(
            "quantum", [](const HeldChunk& held) { return held.lattice.quantum; },
            "Metres of one unit of heights.")
        .def_property_readonly(
            "heights",
            [](const py::object& self) {
                return view_of(py::cast<const HeldChunk&>(self).chunk->heights.data(),
                               {kChunkSamples, kChunkSamples}, self);
            },
            "A view, not a copy: int32 of shape (129, 129) in quanta, row 0 south, column 0 west; "
            "read only.")
        .def_property_readonly(
            "cell_bounds",
            [](const py::object& self) {
                return view_of(py::cast<const HeldChunk&>(self).chunk->cell_bounds.data(),
                               {kChunkCells, kChunkCells}, self);
            },
            "A view: float32 of shape (128, 128), metres: the true surface is within this of a "
            "cell; read only.")
        .def_property_readonly("cell_flags", &flags_of,
                               "A view: uint8 of shape (128, 128), bits of CellFlag; None where "
                               "all cells are ground; read only.")
        .def_property_readonly(
            "bytes", [](const HeldChunk& held) { return held.chunk->bytes(); },
            "What it counts for under the pager's ceiling.");
}

}  // namespace

void bind_resident(py::module_& module) {
    bind_chunk(module);
    py::class_<Resident>(module, "ResidentSet",
                         "A snapshot of resident chunks. Immutable; outlives its pager.")
        .def("__len__", [](const Resident& resident) { return resident.set->chunks().size(); })
        .def("chunk", &chunk_of, py::arg("index"),
             "The Chunk of an index; IndexError where there is none.")
        .def_property_readonly("keys", &keys_of,
                               "Level, column and row of each chunk: int32 of shape (n, 3), by "
                               "level, then row, then column.")
        .def_property_readonly(
            "fades",
            [](const Resident& resident) {
                const auto fades = resident.set->fades();
                return py::array_t<float>(static_cast<py::ssize_t>(fades.size()), fades.data());
            },
            "Of each chunk: float32 of shape (n,), 0 (not drawn) to 1. Ground does not fade.")
        .def_property_readonly(
            "epoch", [](const Resident& resident) { return resident.set->epoch(); },
            "Counts the changes of the pager's set: sets of one pager with equal epochs are equal.")
        .def_property_readonly(
            "has_roots", [](const Resident& resident) { return resident.set->has_roots(); },
            "Whether all root squares are resident: without them nothing is drawn.");
}

}  // namespace terrane::python
