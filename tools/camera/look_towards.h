// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/view.h>

namespace terrane::tools {

/// The view from another eye position towards a target; field of view and size are kept. The orientation is kept
/// where eye and target coincide.
inline View look_towards(View view, const WorldPos& eye_world, const WorldPos& target_world) {
    const Result<View> looking =
        look_at(eye_world, target_world, view.vertical_fov, view.width_px, view.height_px);
    view.eye_world = eye_world;
    if (looking) {
        view.forward = looking->forward;
        view.up = looking->up;
    }
    return view;
}

}  // namespace terrane::tools
