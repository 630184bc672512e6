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

/// The method, written as simply as possible and in double precision: every event is a ray in space
/// and meets every plane by itself; every DSI is a whole volume. Tests compare the fast code with
/// it.

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

/// An event as a ray: where its camera was in the reference view.
struct PosedEvent {
  Event event;
  Rigid3 T_ref_cam;
};

/// Each event with the pose of its own time. Events without a pose are left out.
std::vector<PosedEvent> poseEach(const std::vector<Event>& events, const RigCamera& camera,
                                 const Trajectory& trajectory, const Rigid3& T_world_ref);
/// Each event with the pose of its packet.
std::vector<PosedEvent> poseByPacket(const std::vector<Event>& events, const PosePackets& packets);

/// The ray density of one camera's events (Ghosh and Gallego 2022, Eq. 2).
Dsi rayDensity(const std::vector<PosedEvent>& events, const UndistortionTable& undistortion,
               const ReferenceView& view, const DepthPlanes& planes);

/// The mean of numbers under a rule, from its textbook formula.
double fuse(FusionRule rule, const std::vector<double>& values);
Dsi fuse(FusionRule rule, const std::vector<Dsi>& inputs);

/// The events of the window [t0, t1) by sub-interval; windows of up to 100 days.
std::vector<std::vector<Event>> splitEvents(const std::vector<Event>& events, std::int64_t t0_ns,
                                            std::int64_t t1_ns, int count, SubintervalSplit split);

/// One number, or DSI, per camera and slot of the time axis, [camera][slot], fused along both axes
/// in their order (Ghosh and Gallego 2022, Algorithm 2).
double fuse(const FusionOptions& options, const std::vector<std::vector<double>>& values);
Dsi fuse(const FusionOptions& options, const std::vector<std::vector<Dsi>>& inputs);

/// Per pixel the plane of the largest value, the nearest of equals.
std::vector<int> peakPlanes(const Dsi& dsi);
/// Per pixel the largest value.
std::vector<double> peakValues(const Dsi& dsi);

/// The steps of `efm::extractDepth` written down one after the other, each over the whole image.
DepthMap extractDepth(const DsiPeaks& peaks, const DepthPlanes& planes,
                      const DepthExtractionOptions& options,
                      std::optional<double> sequence_maximum = std::nullopt);

/// `extractAggregated` written down as simply as possible, in double precision and from the whole
/// DSI: every step looks at every pixel, no ray is rounded and none is left out.
/// @param dsi [plane][row][column]. Without dilation.
/// @param step_planes the unit of distances between peaks; parabolas go through the next planes.
DepthMap extractAggregated(const std::vector<float>& dsi, const cv::Size& size,
                           const DepthPlanes& planes, const DepthExtractionOptions& options,
                           double step_planes);

}  // namespace efm::oracle
