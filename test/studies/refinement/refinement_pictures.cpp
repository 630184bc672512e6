// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/refinement/refinement_pictures.h"

#include <string>
#include <vector>

#include "plugin/results/pictures/curve_plot.h"
#include "plugin/results/pictures/picture.h"
#include "test/studies/figures/picture_grid.h"
#include "test/studies/figures/top_view.h"

namespace efm::studies {
namespace {

Curve pathOf(const std::string& label, const std::vector<Rigid3>& T_world_ref) {
  Curve curve{label, {}, CurveStyle::kMarkedLine, {}};
  for (const Rigid3& pose : T_world_ref) {
    curve.points.emplace_back(pose.translation.x(), pose.translation.y());
  }
  return curve;
}

/// The maps at the tracker's poses and at refined poses: the whole map, and the corner that is seen
/// at the beginning and at the end.
cv::Mat3b drawMaps(const RefinementDrawing& drawing, const std::vector<Wall>& walls) {
  constexpr int kWidthPx = 620;
  TopView all = viewOfAll(walls, 0.01);
  all.pixel_m = (all.high_m.x() - all.low_m.x()) / kWidthPx;
  TopView corner = all;
  corner.low_m = {1.9, 0.9};
  corner.pixel_m = (corner.high_m.x() - corner.low_m.x()) / kWidthPx;
  PictureGrid grid;
  grid.columns = {"at the tracker's poses", "at refined poses"};
  grid.rows = {"all", "the corner that is seen twice"};
  for (const TopView& view : {all, corner}) {
    grid.pictures.push_back({drawTopView(*drawing.tracker_map, walls, view),
                             drawTopView(*drawing.refined_map, walls, view)});
  }
  grid.width_px = kWidthPx;
  return drawGrid(grid);
}

cv::Mat3b drawPaths(const RefinementDrawing& drawing) {
  CurvePlot plot;
  plot.title = "keyframes from above";
  plot.size = {700, 480};
  plot.equal_units = true;
  plot.x.label = "x [m]";
  plot.y.label = "y [m]";
  plot.curves = {pathOf("true", drawing.T_world_true), pathOf("tracker", drawing.T_odom_ref),
                 pathOf("refined", drawing.T_world_ref)};
  return drawCurves(plot);
}

/// The distance of each keyframe from the truth.
cv::Mat3b drawDrift(const RefinementDrawing& drawing) {
  CurvePlot plot;
  plot.title = "distance from the truth";
  plot.size = {560, 480};
  plot.x = {"keyframe", AxisScale::kLinear, 0, {}};
  plot.y = {"[cm]", AxisScale::kLinear, 0, {}};
  const auto add = [&](const std::string& label, const std::vector<Rigid3>& T_world_ref,
                       std::size_t colour) {
    Curve curve{label, {}, CurveStyle::kMarkedLine, curveColour(colour)};
    for (std::size_t i = 0; i < T_world_ref.size(); ++i) {
      const double distance_m =
          (T_world_ref[i].translation - drawing.T_world_true[i].translation).norm();
      curve.points.emplace_back(static_cast<double>(i), 100 * distance_m);
    }
    plot.curves.push_back(curve);
  };
  add("tracker", drawing.T_odom_ref, 1);
  add("refined", drawing.T_world_ref, 2);
  return drawCurves(plot);
}

}  // namespace

void drawRefinement(const RefinementCase& what, const RefinementDrawing& drawing,
                    StudySection& section) {
  section.picture("refinement_map.png", drawMaps(drawing, wallsOf(what.simulation().scene)),
                  "The loop's map from above, with drift (seed 1), where the first poses coincide; "
                  "blue low, red high; grey lines: the true walls");
  section.picture("refinement_trajectory.png", sideBySide({drawPaths(drawing), drawDrift(drawing)}),
                  "The same keyframes: their positions, and their distances from the truth");
}
}  // namespace efm::studies
