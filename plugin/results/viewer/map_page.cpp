// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/viewer/map_page.h"

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>

#include "mapping/geometry/timestamp.h"
#include "plugin/results/pictures/upward.h"
#include "plugin/results/viewer/base64.h"
#include "plugin/results/viewer/page_source.h"

namespace efm {
namespace {

using Json = nlohmann::ordered_json;

/// Where the data stand in the page's source.
constexpr std::string_view kDataMark = "<!-- data -->";

/// JSON for the inside of a script element, which "</script>" or "<!--" in a text would end.
std::string inScript(std::string json) {
  constexpr std::string_view kEscaped = "\\u003c";
  for (std::size_t at = json.find('<'); at != std::string::npos; at = json.find('<', at)) {
    json.replace(at, 1, kEscaped);
    at += kEscaped.size();
  }
  return json;
}

void beginData(std::ostream& stream, const char* id, const char* type) {
  stream << "<script id=\"" << id << "\" type=\"" << type << "\">";
}
void endData(std::ostream& stream) { stream << "</script>\n"; }

Json asJson(const Eigen::Vector3d& p) { return Json::array({p.x(), p.y(), p.z()}); }

Json asJson(const std::vector<StampedPose>& trajectory) {
  Json poses = Json::array();
  for (const StampedPose& pose : trajectory) {
    const Eigen::Quaterniond& q = pose.T_world_rig.rotation;
    poses.push_back({{"t", formatSeconds(pose.t_ns)},
                     {"p", asJson(pose.T_world_rig.translation)},
                     {"q", {q.x(), q.y(), q.z(), q.w()}}});
  }
  return poses;
}

Json asJson(const KeyframePictures& pictures) {
  Json json = Json::object();
  for (const auto& [keyframe, picture] : pictures.pictures()) {
    json[std::to_string(keyframe)] = {{"depth", base64(picture.depth)},
                                      {"events", base64(picture.events)}};
  }
  return json;
}

Json describe(const MapPage& page, const PagePoints& points) {
  Json json = {
      {"name", page.name},
      {"points", points.size()},
      {"all_points", page.points.size()},
      {"thinned_m", points.thinned_m()},
      {"voxel_m", page.voxel_size_m},
      {"origin_m", asJson(points.origin_m())},
      {"step_m", asJson(points.step_m())},
      {"confidence", {points.lowConfidence(), points.highConfidence()}},
      {"keyframe_step", points.keyframeStep()},
      {"depths_m", {page.pictures.limits().min_depth_m, page.pictures.limits().max_depth_m}},
      {"up", asJson(upwardOf(page.trajectory))},
      {"keyframes", asJson(page.trajectory)}};
  if (page.view) {
    const ReferenceView& view = *page.view;
    json["view"] = {{"width", view.width}, {"height", view.height}, {"fx", view.fx},
                    {"fy", view.fy},       {"cx", view.cx},         {"cy", view.cy}};
  }
  return json;
}

void writePoints(std::ostream& stream, const PagePoints& points) {
  constexpr std::size_t kBlock = 3 * 4096;  // points: a multiple of 3 bytes
  std::vector<std::uint8_t> bytes;
  for (std::size_t begin = 0; begin < points.size(); begin += kBlock) {
    bytes.clear();
    for (std::size_t i = begin; i < std::min(begin + kBlock, points.size()); ++i) {
      points.at(i).appendTo(bytes);
    }
    stream << base64(bytes);
  }
}

}  // namespace

void writeMapPage(std::ostream& stream, const MapPage& page) {
  const PagePoints points(page.points, page.voxel_size_m, page.max_points);
  const std::string_view source = kPageSource;
  const std::size_t mark = source.find(kDataMark);
  stream << source.substr(0, mark);
  beginData(stream, "map-data", "application/json");
  stream << inScript(describe(page, points).dump(-1, ' ', false, Json::error_handler_t::replace));
  endData(stream);
  beginData(stream, "report-data", "application/json");
  stream << inScript(page.report_json);
  endData(stream);
  beginData(stream, "picture-data", "application/json");
  stream << asJson(page.pictures).dump();
  endData(stream);
  beginData(stream, "point-data", "text/plain");
  writePoints(stream, points);
  endData(stream);
  stream << source.substr(mark + kDataMark.size());
}

}  // namespace efm
