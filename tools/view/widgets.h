// SPDX-License-Identifier: MIT
#pragma once

#include <imgui.h>

#include <array>

namespace terrane::tools {

/// A slider over powers of ten.
inline bool log_slider(const char* label, double& value, double low, double high,
                       const char* format) {
    return ImGui::SliderScalar(label, ImGuiDataType_Double, &value, &low, &high, format,
                               ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp);
}

/// A colour with display gamma in ImGui's form.
inline ImU32 colour_of(const std::array<float, 3>& rgb, float alpha = 1.0f) {
    return ImGui::ColorConvertFloat4ToU32(ImVec4(rgb[0], rgb[1], rgb[2], alpha));
}

}  // namespace terrane::tools
