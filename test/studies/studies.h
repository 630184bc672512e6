// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "test/studies/recordings/study_run.h"
#include "test/studies/report/study_section.h"

namespace efm::studies {

/// The six fusion functions across cameras.
void studyFusionFunctions(const StudyRun& run, StudySection& section);
/// One camera, every order of fusing two across cameras and time, and late fusion.
void studyAlgorithms(const StudyRun& run, StudySection& section);

/// Sub-intervals alone and fused, and one camera fused across time.
void studySubintervals(const StudyRun& run, StudySection& section);
/// DSEC's car in a street.
void studyDriving(const StudyRun& run, StudySection& section);
/// The time of a keyframe by step, and the formulas of its complexity.
void studyRuntime(const StudyRun& run, StudySection& section);
/// The DSI becomes clear with more events.
void studyConvergence(const StudyRun& run, StudySection& section);
/// Sensors with different numbers of pixels.
void studyResolution(const StudyRun& run, StudySection& section);
/// Sensors with different contrast thresholds.
void studyContrastThreshold(const StudyRun& run, StudySection& section);
/// Three cameras against two and one.
void studyThreeCameras(const StudyRun& run, StudySection& section);
/// Poses and clocks with errors.
void studyPoseAccuracy(const StudyRun& run, StudySection& section);
/// The real slider, compared with depth from its own frames.
void studySlider(const StudyRun& run, StudySection& section);

/// Split fusion and aggregation against the paper's extraction.
void studyBetterDepth(const StudyRun& run, StudySection& section);

/// Motion corrected within the window of a keyframe.
void studyMotionCorrection(const StudyRun& run, StudySection& section);
/// Poses of keyframes refined, with drift and noise of the tracker.
void studyRefinement(const StudyRun& run, StudySection& section);

/// Options chosen from the data, against options set by hand.
void studyAutomatic(const StudyRun& run, StudySection& section);

}  // namespace efm::studies
