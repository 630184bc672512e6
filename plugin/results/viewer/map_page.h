// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/trajectory.h"
#include "maps/cloud/map_point.h"

namespace efm {

/// Returns bytes in base64 (RFC 4648, with padding). Results can be joined if all contents but the
/// last have a multiple of 3 bytes.
std::string base64(std::string_view bytes);

/// The page without data: `page/page.html` with its style and scripts inside. `embed_page.cmake`
/// makes it.
extern const std::string_view kPageSource;

/// A point of the page, `kBytes` bytes, little-endian: the position (x, y, z: 2 bytes each), the
/// confidence (1 byte), the support (1 byte), the first keyframe (2 bytes).
struct PagePoint {
  static constexpr std::size_t kBytes = 10;

  std::uint16_t cell[3] = {};   ///< p_world = origin + step * cell, per axis.
  std::uint8_t confidence = 0;  ///< Logarithmic between `lowConfidence` and `highConfidence`.
  std::uint8_t support = 0;     ///< Number of keyframes, at most 255.
  std::uint16_t keyframe = 0;   ///< First keyframe divided by `keyframeStep`, rounded down.

  void appendTo(std::string& bytes) const;
};

/// The points of a map in the page: quantised, at most `limit` points. A larger map is subsampled:
/// each cell of a grid keeps the point with the highest support; if several points have it, the
/// point with the highest confidence. The points are ordered with a long stride through the map, so
/// that any first part of the points shows the whole map evenly.
class PagePoints {
 public:
  static constexpr std::size_t kDefaultLimit = 2'000'000;

  /// Keeps a reference to the cloud. Memory: 4 bytes per point of the page; while points are
  /// subsampled, also 4 bytes per cell of a hash table with at least twice `limit` cells.
  /// @param cloud finite points with confidences above 0.
  /// @param voxel_size_m voxel size of the map, above 0.
  explicit PagePoints(const MapCloud& cloud, double voxel_size_m,
                      std::size_t limit = kDefaultLimit);

  std::size_t size() const { return cloud_.size() <= limit_ ? cloud_.size() : kept_.size(); }
  /// Returns a point. @param i below `size`.
  PagePoint at(std::size_t i) const;

  /// Returns the edge of the grid's cells in metres, 0 if points were not subsampled.
  double subsampled_m() const { return subsampled_m_; }
  /// Returns the smallest coordinates, frame `world`, metres.
  const Eigen::Vector3d& origin_m() const { return origin_m_; }
  /// Returns the resolution of positions: the extent / 65535, metres.
  const Eigen::Vector3d& step_m() const { return step_m_; }
  /// The next two return the confidences of bytes 0 and 255: the 1st and the 99th percentile.
  float lowConfidence() const { return low_confidence_; }
  float highConfidence() const { return high_confidence_; }
  std::uint64_t keyframeStep() const { return keyframe_step_; }

 private:
  double countCells(double cell_m) const;
  bool thin(double cell_m);
  void findConfidences();

  const MapCloud& cloud_;
  std::size_t limit_;
  std::vector<std::uint32_t> kept_;  // indices of points, if the map was subsampled
  double subsampled_m_ = 0;
  std::size_t stride_ = 1;
  Eigen::Vector3d origin_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d step_m_ = Eigen::Vector3d::Zero();
  float low_confidence_ = 1;
  float high_confidence_ = 1;
  std::uint64_t keyframe_step_ = 1;
};

/// Small pictures of a keyframe, PNG files of the same size.
struct KeyframePicture {
  std::string depth;
  std::string events;  ///< Empty if the events are not known.

  std::size_t bytes() const { return depth.size() + events.size(); }
};

/// Small pictures of the keyframes' depth maps and events, for the page. Memory is bounded: if all
/// pictures together exceed `max_bytes`, the pictures of every second keyframe are removed, and
/// from then on only keyframes of the doubled stride get pictures. One thread at a time.
class KeyframePictures {
 public:
  static constexpr int kMaxWidth = 360;  ///< Pixels. Wider depth maps are reduced.
  static constexpr std::size_t kDefaultMaxBytes = 5'000'000;

  /// @param limits depth limits of the colours.
  explicit KeyframePictures(const DepthPlanesOptions& limits,
                            std::size_t max_bytes = kDefaultMaxBytes)
      : limits_(limits), max_bytes_(max_bytes) {}

  /// Adds the next keyframe. Keyframes are numbered from 0.
  /// @param events `KeyframeDepthMap::view_events`, of the depth map's size, or empty.
  void add(const cv::Mat1f& depth_m, const cv::Mat_<cv::Vec2i>& events);

  /// Returns the pictures by the numbers of their keyframes.
  const std::map<std::size_t, KeyframePicture>& pictures() const { return pictures_; }
  const DepthPlanesOptions& limits() const { return limits_; }

 private:
  DepthPlanesOptions limits_;
  std::size_t max_bytes_;
  std::size_t keyframes_ = 0;
  std::size_t stride_ = 1;
  std::size_t bytes_ = 0;
  std::map<std::size_t, KeyframePicture> pictures_;
};

/// The content of map.html.
struct MapPage {
  std::string name;        ///< Name of the map, for the title.
  const MapCloud& points;  ///< Points of the map, with their first keyframes.
  double voxel_size_m;     ///< Voxel size of the map.
  /// T_world_ref of the keyframes at t_ref. A point's first keyframe is an index into this list.
  const std::vector<StampedPose>& trajectory;
  const KeyframePictures& pictures;
  std::optional<ReferenceView> view;  ///< View of the keyframes. std::nullopt: no frusta are drawn.
  std::string report_json;            ///< Content of report.json.
  std::size_t max_points = PagePoints::kDefaultLimit;
};

/// Writes the map as one HTML page that needs no other file and no network: the points, the
/// keyframes and the report as data, and the program that shows them (`page/`). About 13.4 bytes
/// per point. The page shows how many points and pictures were left out. Bytes that are not UTF-8
/// become U+FFFD. The stream's state shows errors of the stream.
void writeMapPage(std::ostream& stream, const MapPage& page);

}  // namespace efm
