// SPDX-License-Identifier: MIT
#pragma once

#include "scene/ground_editor.h"
#include "scene/terrain_options.h"

#include <terrane/base/math.h>
#include <terrane/collision/vehicle.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/pager.h>

#include <cstdint>
#include <memory>
#include <span>

namespace terrane::tools {

/// Coarsest spacing of ground that can have ruts, and the spacing that --ruts requests, metres.
inline constexpr double kMostRutSpacing = 0.5;
inline constexpr double kRutSpacing = 0.25;

/// The ruts that a vehicle's wheels leave in the heightfield: grooves of constant depth below the undisturbed ground,
/// dug by a GroundEditor. Wheels leave no ruts on the floors of caves or on bodies.
class WheelRuts {
public:
    /// Makes the terrain's source diggable: call before a pager is created.
    ///
    /// @param worker_count of the editor: 0 or 1
    ///
    /// Fails: exit_usage for ground coarser than kMostRutSpacing; exit_failed if the program was built without
    ///        terrane::volume
    static CommandResult<std::unique_ptr<WheelRuts>> create(Terrain& terrain, int worker_count);
    ~WheelRuts();

    /// Extends the rut of each wheel that has rolled far enough since its last dig: digs from there to slightly ahead
    /// of the wheel, so that it does not roll over the end of its rut.
    void roll(const VehicleState& vehicle, double wheel_radius, const Ground& ground);
    /// Applies completed digs. Call once a frame, before Pager::update().
    ///
    /// Returns: bounds of the change, metres; empty (low > high) if nothing changed
    Aabb update(Pager& pager);

    /// As GroundEditor::edits_in_force()
    std::span<const GroundEdit> edits_in_force() const;
    /// Number of tubes dug; each covers about 0.5 m of the path of one wheel.
    std::uint64_t digs() const;

private:
    struct State;
    explicit WheelRuts(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane::tools
