// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "test/studies/refinement/refinement_case.h"
#include "test/studies/report/study_section.h"

namespace efm::studies {

/// Draws the map from above at the tracker's poses and at refined poses, and the positions of the
/// keyframes.
void drawRefinement(const RefinementCase& what, const RefinementDrawing& drawing,
                    StudySection& section);

}  // namespace efm::studies
