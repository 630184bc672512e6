// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/cloud/map_point.h"
#include "plugin/session/map_snapshot.h"

namespace efm {

/// The style of depth.png and confidence.png.
enum class PictureStyle {
  kFigure,  ///< A figure for a paper: with a colour bar; small images are enlarged.
  kPlain,   ///< The image only, in the depth map's size.
};

/// Writes the files of a result into its folder. If a file cannot be written, a std::runtime_error
/// names the file.
///
///     map.pcd  map.simplemap  map.html  map.png  overview.png  trajectory.txt  report.json
///     map.ply                  by option
///     trajectory_tracker.txt   if poses were refined
///     keyframes/<t_ref, "%.9f">/{depth.tiff,confidence.tiff,depth.png,confidence.png}
///     keyframes/<t_ref>/camN/{the four images of one camera, events.png}   by option
class MapOutput {
 public:
  /// @param folder exists.
  /// @param limits depth limits of the colours in depth.png.
  MapOutput(std::filesystem::path folder, const DepthPlanesOptions& limits,
            PictureStyle style = PictureStyle::kFigure)
      : folder_(std::move(folder)), limits_(limits), style_(style) {}

  /// Writes the keyframe's four images below keyframes/. After an error none of them is there.
  void writeKeyframe(const KeyframeDepthMap& keyframe) const;
  /// Writes the four images directly into the folder, for a folder of one keyframe.
  void writeImages(const KeyframeDepthMap& keyframe) const { writeImagesTo(folder_, keyframe); }
  /// Writes T_world_ref of the keyframes at t_ref, TUM format.
  /// @param name "trajectory.txt" or "trajectory_tracker.txt".
  void writeTrajectory(const std::string& name, const std::vector<StampedPose>& poses) const;
  /// Writes points. @param name "map.pcd" or "points.pcd".
  void writeCloud(const std::string& name, const MapCloud& cloud) const;
  /// Writes map.ply, coloured by height, with normals towards the keyframes.
  /// @param upward a unit vector, frame `world`. @param views the keyframes of the cloud.
  void writeColouredCloud(const MapCloud& cloud, const Eigen::Vector3d& upward,
                          const std::vector<StampedPose>& views) const;
  /// Writes map.simplemap, for MRPT's programs: see `simpleMapArchive`.
  void writeSimpleMap(const std::vector<StoredKeyframe>& keyframes) const;
  /// Writes a picture. @param name "map.png" or "overview.png".
  void writePicture(const std::string& name, const cv::Mat3b& picture) const;
  /// Writes a text by a function. @param name "map.html" or "report.json".
  void writeText(const std::string& name, const std::function<void(std::ostream&)>& write) const;

 private:
  void writeImagesTo(const std::filesystem::path& folder, const KeyframeDepthMap& keyframe) const;
  void writeMap(const std::filesystem::path& folder, const DepthMap& map) const;

  std::filesystem::path folder_;
  DepthPlanesOptions limits_;
  PictureStyle style_;
};

}  // namespace efm
