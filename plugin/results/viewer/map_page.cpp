// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/viewer/map_page.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>
#include <unordered_set>
#include <utility>

#include "mapping/base/picture_file.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/results/pictures/depth_picture.h"
#include "plugin/results/pictures/picture.h"

namespace efm {

std::string base64(std::string_view bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = i; k < i + 3; ++k) {
      bits = bits << 8U | (k < bytes.size() ? static_cast<std::uint8_t>(bytes[k]) : 0U);
    }
    text += kDigits[bits >> 18U];
    text += kDigits[bits >> 12U & 63U];
    text += i + 1 < bytes.size() ? kDigits[bits >> 6U & 63U] : '=';
    text += i + 2 < bytes.size() ? kDigits[bits & 63U] : '=';
  }
  return text;
}

namespace {

constexpr double kMaxCell = 65535;
constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();

using GridCell = Eigen::Matrix<std::int64_t, 3, 1>;

GridCell gridCellOf(const Eigen::Vector3d& p_world, const Eigen::Vector3d& origin_m,
                    double cell_m) {
  return ((p_world - origin_m) / cell_m).array().floor().cast<std::int64_t>();
}

/// Mixes the bits of the three indices (the constants are odd and random).
std::uint64_t hashOf(const GridCell& cell) {
  std::uint64_t hash = 0;
  for (const std::int64_t index : {cell.x(), cell.y(), cell.z()}) {
    hash = (hash ^ static_cast<std::uint64_t>(index)) * 0x9E3779B97F4A7C15U;
    hash ^= hash >> 29U;
  }
  return hash;
}

bool isBetter(const MapPoint& a, const MapPoint& b) {
  return std::tie(a.support, a.intensity) > std::tie(b.support, b.intensity);
}

/// Returns a stride near the golden section with which each of n points is visited once.
std::size_t longStride(std::size_t n) {
  auto stride = static_cast<std::size_t>(0.6180339887 * static_cast<double>(n)) | 1U;
  while (std::gcd(stride, n) > 1) ++stride;
  return stride;
}

std::uint16_t cellOf(double offset_m, double step_m) {
  if (!(step_m > 0)) return 0;
  return static_cast<std::uint16_t>(std::clamp(std::round(offset_m / step_m), 0.0, kMaxCell));
}

}  // namespace

void PagePoint::appendTo(std::string& bytes) const {
  for (const int value :
       {int{cell[0]}, int{cell[1]}, int{cell[2]}, confidence | support << 8, int{keyframe}}) {
    bytes.push_back(static_cast<char>(value & 0xFF));
    bytes.push_back(static_cast<char>(value >> 8));
  }
}

PagePoints::PagePoints(const MapCloud& cloud, double voxel_size_m, std::size_t limit)
    : cloud_(cloud), limit_(limit) {
  if (cloud.empty()) return;
  Eigen::Vector3d max_m = positionIn(cloud, cloud.front());
  std::uint32_t last_keyframe = 0;
  origin_m_ = max_m;
  for (const MapPoint& point : cloud) {
    const Eigen::Vector3d p_world = positionIn(cloud, point);
    origin_m_ = origin_m_.cwiseMin(p_world);
    max_m = max_m.cwiseMax(p_world);
    last_keyframe = std::max(last_keyframe, point.first_keyframe);
  }
  step_m_ = (max_m - origin_m_) / kMaxCell;
  keyframe_step_ = last_keyframe / 65536 + 1;
  findConfidences();
  if (cloud.size() > limit) {
    double cell_m = voxel_size_m;
    const auto wanted = 0.97 * static_cast<double>(limit);
    constexpr int kMaxTrials = 20;  // 4 to 10 trials are enough
    for (int trial = 0; trial < kMaxTrials; ++trial) {
      const double ratio = countCells(cell_m) / wanted;
      if (ratio > 0.95 && ratio < 1.01) break;
      // A map consists of surfaces: the number of cells falls with the square of the cell's edge.
      cell_m *= std::sqrt(ratio);
    }
    while (!thin(cell_m)) cell_m *= 1.03;
    subsampled_m_ = cell_m;
  }
  stride_ = longStride(size());
}

/// Estimates the number of cells that have points, from a fraction of all cells that a hash
/// selects. About 20,000 of the wanted cells are in the fraction.
double PagePoints::countCells(double cell_m) const {
  const std::uint64_t divisor = limit_ / 20'000 + 1;
  std::unordered_set<std::uint64_t> cells;
  for (const MapPoint& point : cloud_) {
    const std::uint64_t hash = hashOf(gridCellOf(positionIn(cloud_, point), origin_m_, cell_m));
    if ((hash >> 32U) % divisor == 0) cells.insert(hash);
  }
  return static_cast<double>(divisor) * static_cast<double>(cells.size());
}

/// Subsamples the points. @return false as soon as there are too many cells.
bool PagePoints::thin(double cell_m) {
  std::size_t slots = 16;
  while (slots < 2 * limit_) slots *= 2;
  std::vector<std::uint32_t> table(slots, kFree);  // open addressing
  std::size_t used = 0;
  const auto cellAt = [&](std::uint32_t i) {
    return gridCellOf(positionIn(cloud_, cloud_[i]), origin_m_, cell_m);
  };
  for (std::uint32_t i = 0; i < cloud_.size(); ++i) {
    const GridCell cell = cellAt(i);
    std::size_t slot = hashOf(cell) & (slots - 1);
    while (table[slot] != kFree && cellAt(table[slot]) != cell) {
      slot = (slot + 1) & (slots - 1);
    }
    if (table[slot] == kFree) {
      if (++used > limit_) return false;
      table[slot] = i;
    } else if (isBetter(cloud_[i], cloud_[table[slot]])) {
      table[slot] = i;
    }
  }
  table.erase(std::remove(table.begin(), table.end(), kFree), table.end());
  std::sort(table.begin(), table.end());
  kept_ = std::move(table);
  return true;
}

void PagePoints::findConfidences() {
  std::vector<float> confidences(cloud_.size());
  std::transform(cloud_.begin(), cloud_.end(), confidences.begin(),
                 [](const MapPoint& point) { return point.intensity; });
  const auto percentile = [&](std::size_t percent) {
    const auto at =
        confidences.begin() + static_cast<std::ptrdiff_t>((confidences.size() - 1) * percent / 100);
    std::nth_element(confidences.begin(), at, confidences.end());
    return *at;
  };
  low_confidence_ = percentile(1);
  high_confidence_ = percentile(99);
}

PagePoint PagePoints::at(std::size_t i) const {
  const std::size_t walked = (i * stride_) % size();
  const MapPoint& point = cloud_[kept_.empty() ? walked : kept_[walked]];
  const Eigen::Vector3d p_world = positionIn(cloud_, point);
  PagePoint out;
  for (int axis = 0; axis < 3; ++axis) {
    out.cell[axis] = cellOf(p_world[axis] - origin_m_[axis], step_m_[axis]);
  }
  const float range = std::log(high_confidence_ / low_confidence_);
  const float level = range > 0 ? std::log(point.intensity / low_confidence_) / range : 1.0F;
  out.confidence = static_cast<std::uint8_t>(std::lround(255 * std::clamp(level, 0.0F, 1.0F)));
  out.support = static_cast<std::uint8_t>(std::min<std::uint32_t>(point.support, 255));
  out.keyframe = static_cast<std::uint16_t>(point.first_keyframe / keyframe_step_);
  return out;
}

namespace {

/// Joins blocks of factor x factor pixels to one pixel with the sum of their events.
cv::Mat_<cv::Vec2i> reduced(const cv::Mat_<cv::Vec2i>& events, int factor) {
  if (factor == 1) return events;
  cv::Mat_<cv::Vec2i> small =
      cv::Mat_<cv::Vec2i>::zeros(events.rows / factor, events.cols / factor);
  for (int y = 0; y < small.rows * factor; ++y) {
    for (int x = 0; x < small.cols * factor; ++x) small(y / factor, x / factor) += events(y, x);
  }
  return small;
}

}  // namespace

void KeyframePictures::add(const cv::Mat1f& depth_m, const cv::Mat_<cv::Vec2i>& events) {
  const std::size_t keyframe = keyframes_++;
  if (keyframe % stride_ != 0) return;
  const int factor = (depth_m.cols + kMaxWidth - 1) / kMaxWidth;
  KeyframePicture added;
  const cv::Mat1f reduced_m = reducedDepth(depth_m, kMaxWidth);
  added.depth = encodePng(depthPicture(reduced_m, limits_, Palette::kBrightToDark));
  if (!events.empty()) added.events = encodePng(eventPicture(reduced(events, factor)));
  bytes_ += added.bytes();
  pictures_.emplace(keyframe, std::move(added));
  while (bytes_ > max_bytes_ && pictures_.size() > 1) {
    stride_ *= 2;
    for (auto picture = pictures_.begin(); picture != pictures_.end();) {
      if (picture->first % stride_ == 0) {
        ++picture;
        continue;
      }
      bytes_ -= picture->second.bytes();
      picture = pictures_.erase(picture);
    }
  }
}

namespace {

using Json = nlohmann::ordered_json;

/// The place of the data in the page's source.
constexpr std::string_view kDataMark = "<!-- data -->";

/// Escapes JSON for a script element: "</script>" or "<!--" in a text would end the element.
std::string inScript(std::string json) {
  constexpr std::string_view kEscaped = "\\u003c";
  for (std::size_t at = json.find('<'); at != std::string::npos; at = json.find('<', at)) {
    json.replace(at, 1, kEscaped);
    at += kEscaped.size();
  }
  return json;
}

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
      {"thinned_m", points.subsampled_m()},
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
  std::string bytes;
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
  const auto begin_data = [&](const char* id, const char* type) {
    stream << "<script id=\"" << id << "\" type=\"" << type << "\">";
  };
  const auto add_json = [&](const char* id, const std::string& json) {
    begin_data(id, "application/json");
    stream << json << "</script>\n";
  };
  add_json("map-data",
           inScript(describe(page, points).dump(-1, ' ', false, Json::error_handler_t::replace)));
  add_json("report-data", inScript(page.report_json));
  add_json("picture-data", asJson(page.pictures).dump());
  begin_data("point-data", "text/plain");
  writePoints(stream, points);
  stream << "</script>\n" << source.substr(mark + kDataMark.size());
}

}  // namespace efm
