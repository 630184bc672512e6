// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "test/studies/recordings/study_run.h"
#include "test/studies/report/study_section.h"

namespace efm::studies {

/// The six fusion functions across cameras.
void studyFusionFunctions(const StudyRun& run, StudySection& section);
/// One camera, every order of fusing two across cameras and time, and late fusion.
void studyAlgorithms(const StudyRun& run, StudySection& section);

/// Sub-intervals, what each of them would have given, and one camera fused across time.
void studySubintervals(const StudyRun& run, StudySection& section);
/// DSEC's car in a street.
void studyDriving(const StudyRun& run, StudySection& section);
/// What a keyframe costs by step, and the formulas of its complexity.
void studyRuntime(const StudyRun& run, StudySection& section);
/// How the DSI becomes clear as events come in.
void studyConvergence(const StudyRun& run, StudySection& section);
/// Sensors of more and fewer pixels.
void studyResolution(const StudyRun& run, StudySection& section);
/// Sensors of more and less sensitivity.
void studyContrastThreshold(const StudyRun& run, StudySection& section);
/// Three cameras against two and one.
void studyThreeCameras(const StudyRun& run, StudySection& section);
/// Poses and clocks that are wrong.
void studyPoseAccuracy(const StudyRun& run, StudySection& section);
/// The real slider, against depth from its own frames.
void studySlider(const StudyRun& run, StudySection& section);

/// Split fusion and aggregation against the paper's extraction.
void studyBetterDepth(const StudyRun& run, StudySection& section);

/// Each event's one vote, shared by what the first pass fused.
/// A tracker that is wrong within the window, corrected.
void studyMotionCorrection(const StudyRun& run, StudySection& section);
/// A tracker that drifts and errs, its keyframes' poses refined.
void studyRefinement(const StudyRun& run, StudySection& section);

}  // namespace efm::studies
