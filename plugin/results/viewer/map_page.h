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

/// RFC 4648, with padding. Parts of a longer content can be joined where all but the last have a
/// multiple of 3 bytes.
std::string base64(std::string_view bytes);

/// The page without data: `page/page.html` with its style and scripts inside. Made by
/// `embed_page.cmake`.
extern const std::string_view kPageSource;

/// A point of the page, `kBytes` bytes, little-endian: the position (x, y, z: 2 bytes each), the
/// confidence (1), the support (1), the first keyframe (2).
struct PagePoint {
  static constexpr std::size_t kBytes = 10;

  std::uint16_t cell[3] = {};   ///< p_world = origin + step * cell, per axis.
  std::uint8_t confidence = 0;  ///< Logarithmic between two values of `PagePoints`.
  std::uint8_t support = 0;     ///< Number of keyframes, at most 255.
  std::uint16_t keyframe = 0;   ///< The first one, divided by `keyframe_step`, rounded down.

  void appendTo(std::string& bytes) const;
};

/// The points of a map as the page has them: quantised, at most `limit` of them. Where the map has
/// more, each cell of a grid keeps its point with the highest support, and among these the one with
/// the highest confidence. The order is that of a walk through the map with a long stride: any
/// first part of the points covers the whole map evenly.
class PagePoints {
 public:
  static constexpr std::size_t kDefaultLimit = 2'000'000;

  /// Keeps a reference to the cloud. Memory: 4 bytes per point of the page, and while points are
  /// thinned 4 bytes per cell of a hash table, twice the limit or more.
  /// @param cloud all finite, with confidences above 0.
  /// @param voxel_size_m of the map. Above 0.
  explicit PagePoints(const MapCloud& cloud, double voxel_size_m,
                      std::size_t limit = kDefaultLimit);

  std::size_t size() const { return cloud_.size() <= limit_ ? cloud_.size() : kept_.size(); }
  /// @param i below `size`.
  PagePoint at(std::size_t i) const;

  /// The edge of the grid's cells where points were thinned, otherwise 0. Metres.
  double thinned_m() const { return thinned_m_; }
  /// The smallest coordinates, frame `world`, metres.
  const Eigen::Vector3d& origin_m() const { return origin_m_; }
  /// The positions' resolution: the extent over 65535. Metres.
  const Eigen::Vector3d& step_m() const { return step_m_; }
  /// The confidences of the bytes 0 and 255: that of the lowest and of the highest percent.
  float lowConfidence() const { return low_confidence_; }
  float highConfidence() const { return high_confidence_; }
  std::uint64_t keyframeStep() const { return keyframe_step_; }

 private:
  double countCells(double cell_m) const;
  bool thin(double cell_m);
  void findConfidences();

  const MapCloud& cloud_;
  std::size_t limit_;
  std::vector<std::uint32_t> kept_;  // indices, where points were thinned
  double thinned_m_ = 0;
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
  std::string events;  ///< Empty where none are known.

  std::size_t bytes() const { return depth.size() + events.size(); }
};

/// Small pictures of the keyframes' depth maps and events, for the page. Memory is bounded: where
/// all pictures together exceed `max_bytes`, those of every second keyframe are removed, and from
/// then on only keyframes of the doubled stride get some. One thread at a time.
class KeyframePictures {
 public:
  static constexpr int kMaxWidth = 360;  ///< Pixels: sensors up to this width keep their size.
  static constexpr std::size_t kDefaultMaxBytes = 5'000'000;

  /// @param limits the colours run between its depths.
  explicit KeyframePictures(const DepthPlanesOptions& limits,
                            std::size_t max_bytes = kDefaultMaxBytes)
      : limits_(limits), max_bytes_(max_bytes) {}

  /// Adds the next keyframe. Keyframes are numbered from 0.
  /// @param events `KeyframeDepthMap::view_events`: of the depth map's size, or empty.
  void add(const cv::Mat1f& depth_m, const cv::Mat_<cv::Vec2i>& events);

  /// The pictures by the numbers of their keyframes.
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
  std::string name;        ///< Of the map, for the title.
  const MapCloud& points;  ///< Of the map, with their first keyframes.
  double voxel_size_m;     ///< Of the map.
  /// T_world_ref of the keyframes at t_ref; a point's first keyframe is an index of it.
  const std::vector<StampedPose>& trajectory;
  const KeyframePictures& pictures;
  std::optional<ReferenceView> view;  ///< Of the keyframes. Nothing: no frusta are drawn.
  std::string report_json;            ///< As in report.json.
  std::size_t max_points = PagePoints::kDefaultLimit;
};

/// Writes the map as one HTML page that needs no other file and no network: the points, the
/// keyframes and the report as data, and the program that shows them (`page/`). About 13.4 bytes
/// per point. The page says how many points and pictures were left out.
/// Bytes that are not UTF-8 become U+FFFD. Errors of the stream stay in its state.
void writeMapPage(std::ostream& stream, const MapPage& page);

}  // namespace efm
