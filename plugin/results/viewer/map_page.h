// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/trajectory.h"
#include "maps/cloud/map_point.h"
#include "plugin/results/viewer/keyframe_pictures.h"
#include "plugin/results/viewer/page_points.h"

namespace efm {

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
