// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/session_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>

#include "event_fusion/engine.h"
#include "mapping/base/atomic_file.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/options/option_file.h"
#include "plugin/results/output/simple_map.h"
#include "plugin/results/pictures/map_picture.h"
#include "plugin/session/map_quality.h"
#include "plugin/session_file/session_file.h"

namespace efm {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Returns the options of a session as they were used.
OptionReader optionsOf(const SessionFile& session) {
  OptionReader reader;
  const std::string file = session.path().string();
  for (const auto& [section, keys] : session.run().at("options").items()) {
    for (const auto& [key, value] : keys.items()) {
      reader.set(section, key, value.is_string() ? value.get<std::string>() : value.dump(),
                 OptionOrigin{file});
    }
  }
  return reader;
}

/// @throws std::invalid_argument if an option has no effect on stored keyframes.
void requireUsable(const std::string& assignment) {
  if (assignment.rfind("map.", 0) == 0 || assignment.rfind("depth.min_probability=", 0) == 0)
    return;
  throw std::invalid_argument("--set " + assignment +
                              ": expected an option of [map], or depth.min_probability: the "
                              "keyframes were made with the others (map RECORDING)");
}

/// Removes the depths that are not more probable.
void raiseProbability(double min_probability, DepthMap& map) {
  if (map.probability.empty()) return;
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (map.probability(y, x) <= min_probability) map.depth(y, x) = 0;
    }
  }
}

/// Adds the keyframes of sessions to a map, as a run does.
class MapAgain {
 public:
  explicit MapAgain(const EventFusionOptions& options)
      : options_(options), cloud_(options.cloud, 0) {}

  /// @param T_world_ref the pose to use.
  void add(KeyframeDepthMap keyframe, const Rigid3& T_world_ref) {
    const std::int64_t t_ns = keyframe.window.t_ref_ns;
    if (options_.checks && quality_.keyframes() > 0) leaveOutBad(quality_.keyframes() - 1);
    keyframe.T_world_ref = keyframe.T_odom_ref;  // a run judges it before the refinement
    if (options_.checks) quality_.add(quality_.judge(keyframe, {}));
    std::vector<ViewPoint> points =
        options_.late_fusion ? lateFusionPoints(keyframe) : viewPoints(keyframe);
    map_.keyframes.push_back(
        {t_ns, T_world_ref, std::make_shared<const std::vector<ViewPoint>>(points)});
    map_.trajectory.push_back({t_ns, T_world_ref});
    map_.tracker_trajectory.push_back({t_ns, keyframe.T_odom_ref});
    cloud_.insert(std::move(points), T_world_ref);
  }

  MapSnapshot finish(const std::optional<Box>& box) {
    leaveOutBad(quality_.keyframes());
    map_.points = cloud_.cloud().points();
    if (box) map_.points = pointsIn(*box, *map_.points);
    return std::move(map_);
  }

 private:
  void leaveOutBad(std::size_t end) {
    if (options_.min_keyframe_quality <= 0) return;
    for (; judged_ < end; ++judged_) {
      if (quality_.rightShareOf(judged_) >= options_.min_keyframe_quality) continue;
      cloud_.removePoints(judged_);
      map_.keyframes[judged_].points = std::make_shared<const std::vector<ViewPoint>>();
    }
  }

  static MapCloud::ConstPtr pointsIn(const Box& box, const MapCloud& all) {
    auto inside = pcl::make_shared<MapCloud>();
    inside->sensor_origin_ = all.sensor_origin_;
    for (const MapPoint& point : all) {
      const Eigen::Array3d p_world = positionIn(all, point).array();
      if ((p_world >= box.min_m.array()).all() && (p_world <= box.max_m.array()).all()) {
        inside->push_back(point);
      }
    }
    return inside;
  }

  const EventFusionOptions& options_;
  RefinedCloud cloud_;
  QualityStatistics quality_;
  std::size_t judged_ = 0;
  MapSnapshot map_;
};

}  // namespace

std::optional<fs::path> sessionAt(const fs::path& path) {
  std::error_code error;
  const fs::path file = fs::is_directory(path, error) ? path / "session.mcap" : path;
  if (file.extension() != ".mcap" || !fs::is_regular_file(file, error)) return std::nullopt;
  return SessionFile::is(file) ? std::optional(file) : std::nullopt;
}

MapSnapshot mapOf(const SessionExport& what) {
  std::vector<std::unique_ptr<const SessionFile>> sessions;
  for (const fs::path& path : what.sessions) {
    const auto file = sessionAt(path);
    sessions.push_back(std::make_unique<const SessionFile>(file.value_or(path)));
    if (sessions.back()->keyframes() == 0) {
      throw std::runtime_error(sessions.back()->path().string() + ": there is no keyframe");
    }
  }
  OptionReader reader = optionsOf(*sessions.front());
  const double made_with = reader.options().mapper.keyframe.extraction.min_probability;
  for (const std::string& assignment : what.sets) {
    requireUsable(assignment);
    reader.set(assignment);
  }
  const EventFusionOptions options = reader.options();
  const double min_probability = options.mapper.keyframe.extraction.min_probability;
  if (min_probability < made_with) {
    throw std::invalid_argument(
        fmt::format("--set depth.min_probability={}: expected at least {}, with which the "
                    "keyframes were made",
                    min_probability, made_with));
  }
  MapAgain map(options);
  for (const auto& session : sessions) {
    const std::vector<StampedPose> T_world_ref = session->poses(what.refined);
    for (std::size_t i = 0; i < session->keyframes(); ++i) {
      if (!what.limits.contain(T_world_ref[i].t_ns)) continue;
      KeyframeDepthMap keyframe = session->keyframe(i);
      if (min_probability > made_with) {
        raiseProbability(min_probability, keyframe.map);
        for (CameraDepthMap& of_one : keyframe.camera_maps) {
          raiseProbability(min_probability, of_one.map);
        }
      }
      map.add(std::move(keyframe), T_world_ref[i].T_world_rig);
    }
  }
  return map.finish(what.box);
}

MapSnapshot exportSession(const SessionExport& what, const fs::path& out) {
  const std::string ending = out.extension().string();
  if (ending != ".pcd" && ending != ".ply" && ending != ".simplemap") {
    throw std::runtime_error(out.string() +
                             ": expected a name that ends with .pcd, .ply or .simplemap");
  }
  MapSnapshot map = mapOf(what);
  if (ending == ".pcd") writePcd(out, *map.points);
  if (ending == ".ply") writePly(out, *map.points, map.trajectory, upwardOf(map.trajectory));
  if (ending == ".simplemap") {
    writeAtomically(out, [&](const fs::path& file) { writeSimpleMap(file, map.keyframes); });
  }
  return map;
}

}  // namespace efm
