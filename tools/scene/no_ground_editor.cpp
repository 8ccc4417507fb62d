// SPDX-License-Identifier: MIT
//
// Replaces ground_editor.cpp if the program is built without terrane::volume. create() fails, so that the other
// functions are never called.
#include "scene/ground_editor.h"

namespace terrane::tools {

struct GroundEditor::State {};

GroundEditor::~GroundEditor() = default;

CommandResult<std::unique_ptr<GroundEditor>> GroundEditor::create(Terrain&, int,
                                                                  std::optional<std::size_t>) {
    return failure(
        "digs need a program that was built with TERRANE_VOLUME, which this one was not");
}

double GroundEditor::least_radius() const { return 0.0; }
Result<void> GroundEditor::add(const GroundEdit&) { return {}; }
Result<void> GroundEditor::undo() { return {}; }
Result<void> GroundEditor::set_edits(std::span<const GroundEdit>) { return {}; }
Aabb GroundEditor::update(Pager&) { return {}; }
Result<Aabb> GroundEditor::finish(Pager&) { return Aabb(); }
std::span<const GroundEdit> GroundEditor::edits_in_force() const { return {}; }
std::size_t GroundEditor::waiting() const { return 0; }

}  // namespace terrane::tools
