// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/study/study.h"

namespace terrane::tools {

/// What a measured table says, sentence by sentence, each with its figures: which published claims hold for it, and
/// where they end. Nothing but the table decides what is said.
std::vector<std::string> study_findings(const StudyTable& table);

}  // namespace terrane::tools
