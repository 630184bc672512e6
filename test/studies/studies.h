// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "test/studies/study_run.h"
#include "test/studies/study_section.h"

namespace efm::studies {

/// The six fusion functions across cameras.
void studyFusionFunctions(const StudyRun& run, StudySection& section);
/// One camera, every order of fusing two across cameras and time, and late fusion.
void studyAlgorithms(const StudyRun& run, StudySection& section);

}  // namespace efm::studies
