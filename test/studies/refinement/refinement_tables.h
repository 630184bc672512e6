// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "test/studies/refinement/refinement_case.h"
#include "test/studies/report/study_section.h"

namespace efm::studies {

/// A number of the errors, with its label and unit.
struct Figure {
  std::string head;
  double MapErrors::*value;
  double unit;
};

inline const Figure kTrajectory{"trajectory [cm]", &MapErrors::trajectory_m, 0.01};
inline const Figure kRotation{"trajectory [°]", &MapErrors::trajectory_rad, kRadiansPerDegree};
inline const Figure kMap{"map [cm]", &MapErrors::map_m, 0.01};
inline const Figure kRays{"rays [cm]", &MapErrors::rays_m, 0.01};
inline const Figure kEnd{"end to end [cm]", &MapErrors::end_to_end_m, 0.01};
inline const Figure kEndRotation{"end to end [°]", &MapErrors::end_to_end_rad, kRadiansPerDegree};
inline const Figure kWalls{"walls [cm]", &MapErrors::thickness_m, 0.01};

/// Mean over the seeds; `side` is `&RefinementOutcome::with`, for example.
double meanOf(const std::vector<RefinementOutcome>& outcomes, MapErrors RefinementOutcome::*side,
              const Figure& figure);
/// Ratio of the means: refined over not refined.
double ratioOf(const std::vector<RefinementOutcome>& outcomes, const Figure& figure);
/// "0.38 times; by seed 0.31, 0.40"
std::string ratiosOf(const std::vector<RefinementOutcome>& outcomes, const Figure& figure);

/// All figures by seed, and their means.
void seedTable(const RefinementStudyResults& all,
               std::vector<RefinementOutcome> RefinementResults::*which, StudySection& section);
/// Exact poses, small noise, and wrong options.
void otherTable(const RefinementStudyResults& all, StudySection& section);
void loopTable(const RefinementStudyResults& all, StudySection& section);
/// Numbers of true loops, with drift.
void sayLoops(const RefinementStudyResults& all, StudySection& section);
void timeTable(const RefinementStudyResults& all, StudySection& section);

}  // namespace efm::studies
