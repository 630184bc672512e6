// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/session_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>

#include "event_fusion/engine.h"
#include "mapping/base/atomic_file.h"
#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/options/option_file.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/results/output/simple_map.h"
#include "plugin/results/pictures/map_picture.h"
#include "plugin/session/map_quality.h"
#include "plugin/session_file/session_file.h"

namespace efm {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Adds the options of a session that its map depends on, as they were used. Others may be of
/// another machine or version.
void readOptions(const SessionFile& session, OptionReader& reader) {
  for (const auto& [section, keys] : session.run().at("options").items()) {
    for (const auto& [key, value] : keys.items()) {
      const std::string name = section + "." + key;
      if (section != "map" && name != "fusion.late" && name != "checks.enabled" &&
          name != "depth.min_probability") {
        continue;
      }
      reader.set(section, key, value.is_string() ? value.get<std::string>() : value.dump(),
                 OptionOrigin{session.path().string(), {}});
    }
  }
}

double minProbability(const EventFusionOptions& options) {
  return options.mapper.keyframe.extraction.min_probability;
}

using Sessions = std::vector<std::unique_ptr<const SessionFile>>;

Sessions open(const SessionExport& what) {
  Sessions sessions;
  std::set<fs::path> known;
  for (const fs::path& path : what.sessions) {
    const fs::path file = sessionAt(path).value_or(path);
    sessions.push_back(std::make_unique<const SessionFile>(file));
    const SessionFile& session = *sessions.back();
    if (session.keyframes() == 0)
      throw std::runtime_error(file.string() + ": no keyframe is stored");
    if (!known.insert(fs::canonical(file)).second) {
      throw std::runtime_error(file.string() + ": given twice: expected each session once");
    }
    const Json& options = session.run().at("options");
    const bool refines =
        options.contains("refinement") && options["refinement"].value("enabled", false);
    if (refines && what.refined && what.poses.empty() && session.generations() == 0) {
      throw std::runtime_error(
          file.string() +
          ": its run did not end, and its poses are not refined yet: expected a "
          "run that ended (map --resume), or --poses tracker");
    }
  }
  return sessions;
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

/// Returns T_world_ref of a session's keyframes from a file: see SessionExport::poses.
/// @throws std::runtime_error naming a keyframe without a pose.
std::vector<StampedPose> correctedPoses(const SessionFile& session, const fs::path& file,
                                        const TrajectoryOptions& options) {
  constexpr std::int64_t kSameNs = 1'000;
  const std::vector<StampedPose> given = readPoses(file);
  std::vector<StampedPose> T_world_ref = session.poses(false);
  const auto isAt = [](const StampedPose& a, const StampedPose& b) {
    return std::abs(a.t_ns - b.t_ns) <= kSameNs;
  };
  if (std::equal(given.begin(), given.end(), T_world_ref.begin(), T_world_ref.end(), isAt)) {
    for (std::size_t i = 0; i < given.size(); ++i) {
      T_world_ref[i].T_world_rig = given[i].T_world_rig;
    }
    return T_world_ref;
  }
  Trajectory trajectory(options);
  for (const StampedPose& pose : given) trajectory.add(pose);
  for (std::size_t i = 0; i < T_world_ref.size(); ++i) {
    const std::optional<Rigid3> T_world_rig = trajectory.poseAt(T_world_ref[i].t_ns);
    if (!T_world_rig) {
      throw std::runtime_error(fmt::format(
          "{}: no pose at {} s, the time of keyframe {}: it has {} poses from {} s to {} s",
          file.string(), formatSeconds(T_world_ref[i].t_ns), i, given.size(),
          formatSeconds(given.front().t_ns), formatSeconds(given.back().t_ns)));
    }
    T_world_ref[i].T_world_rig = *T_world_rig * session.keyframe(i).T_rig_ref;
  }
  return T_world_ref;
}

/// Adds the keyframes of sessions to a map, as a run does.
class MapAgain {
 public:
  /// @param keeps whether the snapshot has the points of each keyframe.
  MapAgain(const EventFusionOptions& options, bool keeps)
      : options_(options), keeps_(keeps), cloud_(options.cloud, 0) {}

  /// @param T_world_ref the pose to use.
  void add(KeyframeDepthMap keyframe, const Rigid3& T_world_ref) {
    const std::int64_t t_ns = keyframe.window.t_ref_ns;
    if (options_.checks && quality_.keyframes() > 0) leaveOutBad(quality_.keyframes() - 1);
    keyframe.T_world_ref = keyframe.T_odom_ref;  // a run judges it before the refinement
    if (options_.checks) quality_.add(quality_.judge(keyframe, {}));
    std::vector<ViewPoint> points =
        options_.late_fusion ? lateFusionPoints(keyframe) : viewPoints(keyframe);
    if (keeps_) {
      map_.keyframes.push_back(
          {t_ns, T_world_ref, std::make_shared<const std::vector<ViewPoint>>(points)});
    }
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
    for (const std::size_t bad : quality_.takeBad(end, options_.min_keyframe_quality)) {
      cloud_.removePoints(bad);
      if (keeps_) map_.keyframes[bad].points = std::make_shared<const std::vector<ViewPoint>>();
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
  bool keeps_;
  RefinedCloud cloud_;
  QualityStatistics quality_;
  MapSnapshot map_;
};

}  // namespace

std::optional<fs::path> sessionAt(const fs::path& path) {
  std::error_code error;
  const fs::path file = fs::is_directory(path, error) ? path / "session.mcap" : path;
  if (file.extension() != ".mcap" || !fs::is_regular_file(file, error)) return std::nullopt;
  return SessionFile::is(file) ? std::optional(file) : std::nullopt;
}

namespace {

EventFusionOptions optionsOf(const SessionExport& what, const Sessions& sessions) {
  OptionReader reader;
  double least = 0;
  for (auto session = sessions.rbegin(); session != sessions.rend(); ++session) {  // the first wins
    readOptions(**session, reader);
    least = std::max(least, minProbability(reader.unchecked()));
  }
  reader.set(fmt::format("depth.min_probability={}", least));
  for (const std::string& assignment : what.sets) {
    const std::string name(trimmed(std::string_view(assignment).substr(0, assignment.find('='))));
    if (name.rfind("map.", 0) != 0 && name != "depth.min_probability") {
      throw std::invalid_argument("--set " + assignment +
                                  ": expected an option of [map], or depth.min_probability: the "
                                  "keyframes were made with the others (map RECORDING)");
    }
    reader.set(assignment);
    if (reader.unchecked().automatic.voxel_size_m) {
      throw std::invalid_argument("--set " + assignment + ": expected a number of metres");
    }
  }
  EventFusionOptions options = reader.options();
  if (minProbability(options) < least) {
    throw std::invalid_argument(
        fmt::format("--set depth.min_probability={}: expected at least {}, with which the "
                    "keyframes were made",
                    minProbability(options), least));
  }
  what.limits.validate();
  if (sessions.size() > 1 && !what.poses.empty()) {
    throw std::invalid_argument(
        "--poses FILE: is for one session: correct each by itself (--store)");
  }
  return options;
}

}  // namespace

EventFusionOptions optionsOf(const SessionExport& what) { return optionsOf(what, open(what)); }

MapSnapshot mapOf(const SessionExport& what, bool keeps_keyframes) {
  const Sessions sessions = open(what);
  const EventFusionOptions options = optionsOf(what, sessions);
  MapAgain map(options, keeps_keyframes);
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const SessionFile& session = *sessions[s];
    std::vector<StampedPose> T_world_ref =
        what.poses.empty() ? session.poses(what.refined)
                           : correctedPoses(session, what.poses, options.mapper.trajectory);
    if (what.store) SessionWriter::addGeneration(session, T_world_ref);
    if (s > 0 && s <= what.T_first_this.size()) {
      for (StampedPose& pose : T_world_ref) {
        pose.T_world_rig = what.T_first_this[s - 1] * pose.T_world_rig;
      }
    }
    for (std::size_t i = 0; i < session.keyframes(); ++i) {
      if (!what.limits.contain(T_world_ref[i].t_ns)) continue;
      KeyframeDepthMap keyframe = session.keyframe(i);
      if (options.late_fusion && keyframe.camera_maps.empty()) {
        throw std::runtime_error(session.path().string() +
                                 ": has no maps of single cameras, which fusion.late needs");
      }
      raiseProbability(minProbability(options), keyframe.map);
      for (CameraDepthMap& of_one : keyframe.camera_maps) {
        raiseProbability(minProbability(options), of_one.map);
      }
      map.add(std::move(keyframe), T_world_ref[i].T_world_rig);
    }
  }
  MapSnapshot made = map.finish(what.box);
  if (made.points->empty()) {
    throw std::runtime_error(
        fmt::format("there is no point: {} keyframes are chosen", made.trajectory.size()));
  }
  return made;
}

bool isMapFile(const fs::path& out) {
  const std::string ending = out.extension().string();
  return ending == ".pcd" || ending == ".ply" || ending == ".simplemap";
}

void requireEnding(const fs::path& out, const SessionExport& what) {
  if (!isMapFile(out)) {
    throw std::invalid_argument("--out " + out.string() +
                                ": expected a name that ends with .pcd, .ply or .simplemap");
  }
  if (out.extension() == ".simplemap" && what.box) {
    throw std::invalid_argument(
        "--box with .simplemap, which has whole keyframes: expected .pcd or "
        ".ply");
  }
}

MapSnapshot exportSession(const SessionExport& what, const fs::path& out) {
  requireEnding(out, what);
  const std::string ending = out.extension().string();
  MapSnapshot map = mapOf(what, ending == ".simplemap");
  if (ending == ".pcd") writePcd(out, *map.points);
  if (ending == ".ply") writePly(out, *map.points, map.trajectory, upwardOf(map.trajectory));
  if (ending == ".simplemap") {
    writeAtomically(out, [&](const fs::path& file) { writeSimpleMap(file, map.keyframes); });
  }
  return map;
}

}  // namespace efm
