// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/terrain_renderer.h>

#include <pybind11/pybind11.h>

#include <memory>
#include <thread>

namespace terrane::python {

namespace py = pybind11;

/// An OpenGL context and its renderer, in order of construction.
struct Drawing {
    GlContext context;
    TerrainRenderer renderer;
};

/// A renderer, as held by Python: for the thread that made it.
class HeldRenderer {
public:
    explicit HeldRenderer(Drawing drawing);
    HeldRenderer(const HeldRenderer&) = delete;
    HeldRenderer& operator=(const HeldRenderer&) = delete;
    /// OpenGL objects can only be freed on their own thread. If the destructor runs on another one, such as a garbage
    /// collector's, they are leaked.
    ~HeldRenderer();

    /// The renderer, with its context current.
    /// Fails: RuntimeError on another thread, ValueError if it is closed
    Drawing& use();
    /// As use(); null instead of an exception.
    Drawing* find();
    /// Frees the renderer; no effect if it is closed. Fails: RuntimeError on another thread
    void close();
    bool is_closed() const { return drawing_ == nullptr; }

private:
    std::unique_ptr<Drawing> drawing_;
    std::thread::id thread_ = std::this_thread::get_id();
};

}  // namespace terrane::python
