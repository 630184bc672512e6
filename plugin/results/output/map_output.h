// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <ostream>
#include <set>
#include <string>
#include <vector>

#include "mapping/base/atomic_file.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "maps/cloud/map_point.h"
#include "plugin/results/output/keyframe_writer.h"

namespace efm {

/// The files of a folder, which holds one kind.
enum class OutputKind {
  /// map.pcd, map.ply, map.simplemap, map.html, map.png, overview.png, trajectory.txt, report.json,
  /// keyframes/<t_ref>/ with images
  kMap,
  kDepth,  ///< the images of one keyframe, points.pcd, dsi.npy, report.json
};

/// How depth.png and confidence.png are drawn.
enum class PictureStyle {
  kFigure,  ///< For a paper: with a colour bar, small ones enlarged.
  kPlain,   ///< The image alone, of the depth map's size.
};

/// The result of an earlier run in a folder.
struct EarlierResult {
  bool complete = false;               ///< Otherwise its run was killed.
  std::vector<std::string> recording;  ///< Its files. Empty: the result does not name them.
  std::uint64_t keyframes = 0;

  /// Whether it is of these files. Bytes that are not UTF-8 may differ.
  bool isOf(const std::vector<std::string>& files) const;
};

/// The folder that a map is written to. A file appears under its name when it is complete. The
/// caller writes report.json last: a folder with a report.json is complete, and all its files are
/// of one run. A std::runtime_error names a file that cannot be written.
///
/// An earlier result with a report stays until the new report is written: until then the new files
/// have temporary names, and without a report they are removed. What else an earlier run left is
/// removed right before the first file.
///
/// Until then the folder has a RunMark, by which the next run knows that it may replace what a
/// killed run left.
///
///     map.pcd  map.simplemap  map.html  map.png  overview.png  trajectory.txt  report.json
///     map.ply                  by option
///     trajectory_tracker.txt   where poses were refined
///     keyframes/<t_ref, "%.9f">/{depth.tiff,confidence.tiff,depth.png,confidence.png}
///     keyframes/<t_ref>/camN/{the same of one camera, events.png}   by option
class MapOutput {
 public:
  /// Creates the folder. Files of the other kind are removed only where they are an
  /// `earlierResult`.
  /// @param limits the colours of depth.png run between its depths.
  /// @param recording its files, for the next run.
  /// @throws std::runtime_error where the folder cannot be made, or another run writes its result
  /// there; so do the functions that write.
  MapOutput(std::filesystem::path folder, OutputKind kind, const DepthPlanesOptions& limits,
            PictureStyle style = PictureStyle::kFigure, std::vector<std::string> recording = {});

  /// Removes the files that wait for the report.
  ~MapOutput();

  /// The result of either kind in a folder: a report, or the mark of a run that was killed.
  /// @throws std::runtime_error where another run is writing its result there.
  static std::optional<EarlierResult> earlierResult(const std::filesystem::path& folder);
  /// Whether a folder has a file or a folder with a name that only this kind writes.
  static bool holdsFilesOf(OutputKind kind, const std::filesystem::path& folder);

  /// Writes the keyframe's four images below keyframes/.
  void writeKeyframe(const KeyframeDepthMap& keyframe);
  /// Writes the four images straight into the folder: for a folder of one keyframe.
  void writeImages(const KeyframeDepthMap& keyframe);
  /// T_world_ref at t_ref of the keyframes, TUM format.
  /// @param name "trajectory.txt" or "trajectory_tracker.txt".
  void writeTrajectory(const std::string& name, const std::vector<StampedPose>& poses);
  /// @param name "map.pcd" or "points.pcd".
  void writeCloud(const std::string& name, const MapCloud& cloud);
  /// map.ply, coloured by height.
  /// @param upward a unit vector, frame `world`.
  void writeColouredCloud(const MapCloud& cloud, const Eigen::Vector3d& upward);
  /// @param name "map.simplemap".
  /// @param write writes a file at the given path; the file is renamed afterwards.
  void writeFile(const std::string& name,
                 const std::function<void(const std::filesystem::path&)>& write);
  /// @param name "map.png" or "overview.png".
  void writePicture(const std::string& name, const cv::Mat3b& picture);
  /// map.html.
  void writePage(const std::function<void(std::ostream&)>& write);
  /// Gives a complete file of the folder its name.
  void add(std::unique_ptr<AtomicFile> file);
  /// All other files are complete: replaces an earlier result.
  void writeReport(const std::string& json);

  /// Whether an earlier result stays until the report is written.
  bool keepsEarlier() const { return keeps_earlier_; }

  const std::filesystem::path& folder() const { return folder_; }

 private:
  void begin();
  void removeEarlier(bool of_both_kinds);
  void write(const std::filesystem::path& path,
             const std::function<void(const std::filesystem::path&)>& fill,
             DiskSync sync = DiskSync::kNow);
  void writeImagesTo(const std::filesystem::path& folder, const KeyframeDepthMap& keyframe);
  void writeImage(const std::filesystem::path& path, const cv::Mat& image);
  void writeMap(const std::filesystem::path& folder, const DepthMap& map);

  std::filesystem::path folder_;
  OutputKind kind_;
  DepthPlanesOptions limits_;
  PictureStyle style_;
  std::vector<std::string> recording_;
  std::unique_ptr<RunMark> mark_;  // from the first file on
  bool keeps_earlier_ = false;
  std::vector<std::unique_ptr<AtomicFile>> waiting_;  // for the report
  std::set<std::filesystem::path> not_on_disk_;       // pictures and their folders
};

}  // namespace efm
