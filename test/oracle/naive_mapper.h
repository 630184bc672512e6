// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/depth/depth_extraction.h"
#include "mapping/dsi/dsi_grid.h"
#include "mapping/dsi/plane_fusion.h"
#include "mapping/events/event.h"
#include "mapping/events/window.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/rays/rays.h"

namespace efm::oracle {

/// The method, written as simply as possible and in double precision. The ray of every event is
/// intersected with every plane; every DSI is a whole volume. Tests compare the fast code with this
/// code.

/// A whole DSI: [plane][row][column].
struct Dsi {
  int planes = 0;
  int width = 0;
  int height = 0;
  std::vector<double> values;

  Dsi(int planes_, const ReferenceView& view);
  double& at(int plane, int x, int y);
  double at(int plane, int x, int y) const;
};

/// An event and the pose of its camera in the reference view.
struct PosedEvent {
  Event event;
  Rigid3 T_ref_cam;
};

/// Returns each event with the pose of its own time. Events without a pose are left out.
std::vector<PosedEvent> poseEach(const std::vector<Event>& events, const RigCamera& camera,
                                 const Trajectory& trajectory, const Rigid3& T_world_ref);
/// Returns each event with the pose of its packet.
std::vector<PosedEvent> poseByPacket(const std::vector<Event>& events, const PosePackets& packets);

/// Returns the ray density of one camera's events (Ghosh and Gallego 2022, Eq. 2).
Dsi rayDensity(const std::vector<PosedEvent>& events, const UndistortionTable& undistortion,
               const ReferenceView& view, const DepthPlanes& planes);

/// Returns the mean of numbers under a rule, from the textbook formula.
double fuse(FusionRule rule, const std::vector<double>& values);
Dsi fuse(FusionRule rule, const std::vector<Dsi>& inputs);

/// Splits the events of the window [t0, t1) into sub-intervals. Windows may last up to 100 days.
std::vector<std::vector<Event>> splitEvents(const std::vector<Event>& events, std::int64_t t0_ns,
                                            std::int64_t t1_ns, int count, SubintervalSplit split);

/// Fuses numbers or DSIs, [camera][slot of the time axis], along both axes in the order of the
/// options (Ghosh and Gallego 2022, Algorithm 2).
double fuse(const FusionOptions& options, const std::vector<std::vector<double>>& values);
Dsi fuse(const FusionOptions& options, const std::vector<std::vector<Dsi>>& inputs);

/// Returns per pixel the plane of the largest value. Of equal values, the nearest plane is used.
std::vector<int> peakPlanes(const Dsi& dsi);
/// Returns per pixel the largest value.
std::vector<double> peakValues(const Dsi& dsi);

/// Runs the steps of `efm::extractDepth` one after another, each on the whole image.
DepthMap extractDepth(const DsiPeaks& peaks, const DepthPlanes& planes,
                      const DepthExtractionOptions& options,
                      std::optional<double> sequence_maximum = std::nullopt);

/// Computes `extractAggregated` as simply as possible, in double precision, from the whole DSI.
/// Every step visits every pixel; columns of the DSI are neither rounded nor left out.
/// @param dsi [plane][row][column]. Depths are not dilated.
/// @param step_planes unit of distances between peaks, in planes. Parabolas use adjacent planes.
DepthMap extractAggregated(const std::vector<float>& dsi, const cv::Size& size,
                           const DepthPlanes& planes, const DepthExtractionOptions& options,
                           double step_planes);

}  // namespace efm::oracle
