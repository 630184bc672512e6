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

/// The kind of files in a folder. A folder holds one kind.
enum class OutputKind {
  /// map.pcd, map.ply, map.simplemap, map.html, map.png, overview.png, trajectory.txt, report.json,
  /// keyframes/<t_ref>/ with images
  kMap,
  kDepth,  ///< The images of one keyframe, points.pcd, dsi.npy, report.json.
};

/// The style of depth.png and confidence.png.
enum class PictureStyle {
  kFigure,  ///< A figure for a paper: with a colour bar; small images are enlarged.
  kPlain,   ///< The image only, in the depth map's size.
};

/// The result of an earlier run in a folder.
struct EarlierResult {
  bool complete = false;               ///< False: the run was killed.
  std::vector<std::string> recording;  ///< The files of the recording. Empty: unknown.
  std::uint64_t keyframes = 0;

  /// Returns whether the result is of these files. Bytes that are not UTF-8 are not compared.
  bool isOf(const std::vector<std::string>& files) const;
};

/// The folder that a map is written to. A file gets its name when it is complete. The caller writes
/// report.json last: a folder with a report.json is complete, and all its files are from one run.
/// If a file cannot be written, a std::runtime_error names the file.
///
/// An earlier result with a report stays until the new report is written. Until then the new files
/// have temporary names; they are removed if no report is written. The files of an earlier run
/// without a report are removed before the first file is written.
///
/// From the first file to the report the folder has a RunMark. If the run is killed, the mark tells
/// the next run that it may replace the files.
///
///     map.pcd  map.simplemap  map.html  map.png  overview.png  trajectory.txt  report.json
///     map.ply                  by option
///     trajectory_tracker.txt   if poses were refined
///     keyframes/<t_ref, "%.9f">/{depth.tiff,confidence.tiff,depth.png,confidence.png}
///     keyframes/<t_ref>/camN/{the four images of one camera, events.png}   by option
class MapOutput {
 public:
  /// Creates the folder. Files of the other kind are removed only if they are an `earlierResult`.
  /// @param limits depth limits of the colours in depth.png.
  /// @param recording the files of the recording; the next run reads them.
  /// @throws std::runtime_error if the folder cannot be made, or another run writes its result
  /// there. The functions that write throw the same errors.
  MapOutput(std::filesystem::path folder, OutputKind kind, const DepthPlanesOptions& limits,
            PictureStyle style = PictureStyle::kFigure, std::vector<std::string> recording = {});

  /// Removes the files that still wait for the report.
  ~MapOutput();

  /// Returns the result of either kind in a folder, from a report or the mark of a killed run.
  /// @throws std::runtime_error if another run is writing its result there.
  static std::optional<EarlierResult> earlierResult(const std::filesystem::path& folder);
  /// Returns whether a folder has a file or a folder with a name that only this kind writes.
  static bool holdsFilesOf(OutputKind kind, const std::filesystem::path& folder);

  /// Writes the keyframe's four images below keyframes/.
  void writeKeyframe(const KeyframeDepthMap& keyframe);
  /// Writes the four images directly into the folder, for a folder of one keyframe.
  void writeImages(const KeyframeDepthMap& keyframe);
  /// Writes T_world_ref of the keyframes at t_ref, TUM format.
  /// @param name "trajectory.txt" or "trajectory_tracker.txt".
  void writeTrajectory(const std::string& name, const std::vector<StampedPose>& poses);
  /// Writes points. @param name "map.pcd" or "points.pcd".
  void writeCloud(const std::string& name, const MapCloud& cloud);
  /// Writes map.ply, coloured by height, with normals towards the keyframes.
  /// @param upward a unit vector, frame `world`. @param views the keyframes of the cloud.
  void writeColouredCloud(const MapCloud& cloud, const Eigen::Vector3d& upward,
                          const std::vector<StampedPose>& views);
  /// Writes a file by a function. @param name "map.simplemap".
  /// @param write writes the file at the given path; the file is renamed afterwards.
  void writeFile(const std::string& name,
                 const std::function<void(const std::filesystem::path&)>& write);
  /// Writes a picture. @param name "map.png" or "overview.png".
  void writePicture(const std::string& name, const cv::Mat3b& picture);
  /// Writes map.html.
  void writePage(const std::function<void(std::ostream&)>& write);
  /// Gives a complete file of the folder its name.
  void add(std::unique_ptr<AtomicFile> file);
  /// Writes the report after all other files are complete, and replaces an earlier result.
  void writeReport(const std::string& json);

  /// Returns whether an earlier result stays until the report is written.
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
  std::vector<std::unique_ptr<AtomicFile>> waiting_;  // files that wait for the report
  std::set<std::filesystem::path> not_on_disk_;       // pictures and their folders, not synced yet
};

}  // namespace efm
