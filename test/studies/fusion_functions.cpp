// SPDX-License-Identifier: BSD-3-Clause
// Ghosh and Gallego 2022, Sec. 4.2: which function fuses the DSIs of two cameras best.
#include <string>

#include "plugin/depth_picture.h"
#include "test/studies/error_table.h"
#include "test/studies/method_comparison.h"
#include "test/studies/picture_grid.h"
#include "test/studies/real_rigs.h"
#include "test/studies/studies.h"

namespace efm::studies {

void studyFusionFunctions(const StudyRun& run, StudySection& section) {
  const Recording recording =
      run.recordings->make("mvsec_room", mvsecInRoom(run, run.pick(5.0, 0.2)));
  const auto windows = recording.windows(0.1, run.pick(20, 2));
  std::vector<Method> methods;
  for (const FusionRule rule : allFusionRules()) {
    Method method{std::string(nameOf(rule)), paperOptions(1, 6.5)};
    method.options.sweep.fusion.across_cameras = rule;
    methods.push_back(method);
  }
  ComparisonOptions options;
  options.focal_baseline = focalBaselineOf(recording.simulation.rig);
  const auto results = compareMethods(recording, windows, methods, options);
  section.table(errorTable(results, {true, false}));

  PictureGrid grid;
  grid.rows = {"depth", "confidence"};
  grid.pictures.resize(2);
  for (const MethodResult& result : results) {
    grid.columns.push_back(result.name);
    const DepthMap& map = result.keyframes.front().map;
    grid.pictures[0].push_back(boldDepthPicture(map.depth, methods.front().options.planes));
    grid.pictures[1].push_back(confidencePicture(map.confidence));
  }
  section.picture("fusion_functions.png", drawGrid(grid),
                  "Depth and confidence by fusion function");
}

}  // namespace efm::studies
