// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/study/study.h"

namespace terrane::tools {

/// Sentences about a measured table, with its figures: which published claims the measurement confirms, and from which
/// number of bodies, size or aspect on it contradicts them. A pure function of the table.
std::vector<std::string> study_findings(const StudyTable& table);

}  // namespace terrane::tools
