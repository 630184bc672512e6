// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/rig.h"
#include "tracking_stub/scenes/scene.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

/// Counters on a fine grid over every surface of a scene.
class SurfaceCells {
 public:
  /// @param scene must outlive this object.
  /// @param cell_m side of a cell. It is rounded to a divisor of each surface's sides.
  SurfaceCells(const Scene& scene, double cell_m);

  /// Adds one to the cell of a point. A point without a surface is ignored.
  void add(const SurfacePoint& point);

  /// Returns the centres of the cells with at least this count, frame `world`.
  std::vector<Eigen::Vector3f> centers(std::uint32_t min_count) const;

 private:
  struct Grid {
    int columns = 1;
    int rows = 1;
    std::vector<std::uint32_t> counts;  // row-major
  };

  const Scene* scene_;
  std::vector<Grid> grids_;  // per surface
};

/// Writes a simulated recording as a dataset:
///   camN/events.txt        a line `t x y p` per event
///   camchain.yaml          calibration in Kalibr's format
///   poses.txt              T_world_cam0 at 1 kHz, TUM
///   depth/cam0_<t>.tiff    exact z-depth in camera 0's undistorted pinhole view, float32 metres,
///                          every 50 ms from the recording's start
///   depth/index.txt        a line `t file` per depth map, relative to depth/
///   gt_cloud.ply, gt_edges.ply   the truth clouds, frame `world`
/// @param folder existing folder without files of these names.
/// @param recordings recordings of the simulation, one per camera.
/// @param before_file called before each file; it may throw.
/// @throws std::invalid_argument if camera 0 is not the rig's frame; std::runtime_error naming the
/// path if a file cannot be written.
void writeDataset(
    const std::filesystem::path& folder, const Simulation& simulation,
    const std::vector<CameraRecording>& recordings,
    const std::function<void()>& before_file = [] {});

/// Writes a line `t x y p` per event: seconds with nine decimals, polarity 0 or 1.
void writeEvents(const std::filesystem::path& file, const std::vector<Event>& events);
/// Appends the lines that `writeEvents` writes to a text.
void appendEvents(std::string& text, EventSpan events);

/// Returns the rig as a Kalibr camera chain.
std::string formatCamchain(const Rig& rig);

/// Writes a binary little-endian PLY file with float vertices x y z.
void writePly(const std::filesystem::path& file, const std::vector<Eigen::Vector3f>& points);

}  // namespace efm
