// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/session_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <utility>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/options/option_file.h"
#include "plugin/recordings/open/mrpt_library.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/session/map_quality.h"

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

void move(const std::optional<Rigid3>& T_first_this, Rigid3& T_this_ref) {
  if (T_first_this) T_this_ref = *T_first_this * T_this_ref;
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
  const bool is_simplemap = file.extension() == ".simplemap";
  const std::vector<StampedPose> given =
      is_simplemap ? mrptLibrary(file.string() + ": a simplemap").readSimpleMap(file)
                   : readPoses(file);
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
  if (is_simplemap) {
    throw std::runtime_error(
        fmt::format("{}: its {} keyframes are not the {} of {}: expected one at the time of each",
                    file.string(), given.size(), T_world_ref.size(), session.path().string()));
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

}  // namespace

std::optional<fs::path> sessionAt(const fs::path& path) {
  std::error_code error;
  const fs::path file = fs::is_directory(path, error) ? path / "session.mcap" : path;
  if (file.extension() != ".mcap" || !fs::is_regular_file(file, error)) return std::nullopt;
  return SessionFile::is(file) ? std::optional(file) : std::nullopt;
}

SessionMap::SessionMap(SessionExport what) : what_(std::move(what)) {
  openSessions();
  readOptions();
  chooseKeyframes();
}

void SessionMap::openSessions() {
  std::set<fs::path> known;
  for (const fs::path& path : what_.sessions) {
    const fs::path file = sessionAt(path).value_or(path);
    sessions_.push_back(std::make_unique<const SessionFile>(file));
    const SessionFile& session = *sessions_.back();
    if (session.keyframes() == 0)
      throw std::runtime_error(file.string() + ": no keyframe is stored");
    if (!known.insert(fs::canonical(file)).second) {
      throw std::runtime_error(file.string() + ": given twice: expected each session once");
    }
    const Json& options = session.run().at("options");
    const bool refines =
        options.contains("refinement") && options["refinement"].value("enabled", false);
    if (refines && what_.refined && what_.poses.empty() && session.generations() == 0) {
      throw std::runtime_error(
          file.string() +
          ": its run did not end, and its poses are not refined yet: expected a "
          "run that ended (map --resume), or the tracker's poses (--poses tracker)");
    }
  }
}

void SessionMap::readOptions() {
  OptionReader reader;
  double least = 0;
  for (auto session = sessions_.rbegin(); session != sessions_.rend(); ++session) {
    efm::readOptions(**session, reader);  // those of the first session win
    least = std::max(least, minProbability(reader.unchecked()));
  }
  reader.set(fmt::format("depth.min_probability={}", least));
  for (const std::string& assignment : what_.sets) {
    const std::string name(trimmed(std::string_view(assignment).substr(0, assignment.find('='))));
    if (name.rfind("map.", 0) != 0 && name != "depth.min_probability") {
      throw std::invalid_argument(assignment +
                                  ": expected an option of [map], or depth.min_probability: the "
                                  "keyframes were made with the others (map RECORDING)");
    }
    reader.set(assignment);
    if (reader.unchecked().automatic.voxel_size_m) {
      throw std::invalid_argument(assignment + ": expected a number of metres");
    }
  }
  options_ = reader.options();
  if (minProbability(options_) < least) {
    throw std::invalid_argument(
        fmt::format("depth.min_probability={}: expected at least {}, with which the "
                    "keyframes were made",
                    minProbability(options_), least));
  }
  what_.limits.validate();
  if (sessions_.size() > 1 && !what_.poses.empty()) {
    throw std::invalid_argument(
        "poses of a file are for one session: correct each by itself, and store it");
  }
}

void SessionMap::chooseKeyframes() {
  what_.T_first_this.resize(sessions_.size() - 1);
  for (std::size_t s = 0; s < sessions_.size(); ++s) {
    const SessionFile& session = *sessions_[s];
    std::vector<StampedPose> T_world_ref =
        what_.poses.empty() ? session.poses(what_.refined)
                            : correctedPoses(session, what_.poses, options_.mapper.trajectory);
    for (std::size_t i = 0; i < T_world_ref.size(); ++i) {
      if (!what_.limits.contain(T_world_ref[i].t_ns)) continue;
      chosen_.push_back({s, i});
      T_world_ref_.push_back(T_world_ref[i]);
      if (s > 0) move(what_.T_first_this[s - 1], T_world_ref_.back().T_world_rig);
    }
    if (s > 0 && what_.registers) registerSession(s);
    if (!what_.poses.empty()) corrected_ = std::move(T_world_ref);
  }
}

/// Registers the chosen keyframes of the last session with those before it.
void SessionMap::registerSession(std::size_t s) {
  const auto before = static_cast<std::size_t>(
      std::find_if(chosen_.begin(), chosen_.end(),
                   [s](const Chosen& chosen) { return chosen.session == s; }) -
      chosen_.begin());
  const auto clouds = [&](std::size_t begin, std::size_t end, std::size_t most) {
    std::vector<PosedCloud> some;
    for (std::size_t i = 0; i < std::min(end - begin, most); ++i) {
      const std::size_t at = begin + i * (end - begin) / std::min(end - begin, most);
      some.push_back({RegistrationCloud(keyframe(at), options_.refinement.refiner.points),
                      T_world_ref_[at].T_world_rig});
    }
    return some;
  };
  constexpr std::size_t kMostMoved = 60, kMostFixed = 300;  // 0.6 MB each
  try {
    registrations_.push_back(
        registerMap(clouds(0, before, kMostFixed), clouds(before, chosen_.size(), kMostMoved)));
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(sessions_[s]->path().string() + ": " + error.what());
  }
  const Rigid3& T_fixed_moved = registrations_.back().T_fixed_moved;
  std::optional<Rigid3>& T_first_this = what_.T_first_this[s - 1];
  T_first_this = T_first_this ? T_fixed_moved * *T_first_this : T_fixed_moved;
  for (std::size_t i = before; i < T_world_ref_.size(); ++i) {
    move(T_fixed_moved, T_world_ref_[i].T_world_rig);
  }
}

void SessionMap::storePoses() const {
  SessionWriter::addGeneration(*sessions_.front(), corrected_);
}

KeyframeDepthMap SessionMap::keyframe(std::size_t at) const {
  const auto& [session, number] = chosen_[at];
  KeyframeDepthMap keyframe = sessions_[session]->keyframe(number);
  if (options_.late_fusion && keyframe.camera_maps.empty()) {
    throw std::runtime_error(sessions_[session]->path().string() +
                             ": has no maps of single cameras, which fusion.late needs");
  }
  raiseProbability(minProbability(options_), keyframe.map);
  for (CameraDepthMap& of_one : keyframe.camera_maps) {
    raiseProbability(minProbability(options_), of_one.map);
  }
  if (session > 0) move(what_.T_first_this[session - 1], keyframe.T_odom_ref);
  keyframe.T_world_ref = T_world_ref_[at].T_world_rig;
  return keyframe;
}

std::vector<ViewPoint> SessionMap::pointsOf(const KeyframeDepthMap& keyframe) const {
  return options_.late_fusion ? lateFusionPoints(keyframe) : viewPoints(keyframe);
}

namespace {

/// Voxels along x.
struct Range {
  std::int64_t first = std::numeric_limits<std::int64_t>::max();
  std::int64_t last = std::numeric_limits<std::int64_t>::min();

  Range() = default;
  Range(const std::vector<ViewPoint>& points, const Rigid3& T_world_ref, double voxel_size_m) {
    for (const ViewPoint& point : points) {
      const double x = (T_world_ref * point.p_ref.cast<double>()).x();
      const auto index = static_cast<std::int64_t>(std::floor(x / voxel_size_m));
      first = std::min(first, index);
      last = std::max(last, index);
    }
  }
  double shareBelow(std::int64_t x) const {
    return static_cast<double>(x - first) / static_cast<double>(last - first + 1);
  }
};

}  // namespace

std::set<std::size_t> SessionMap::visitSlabs(
    std::size_t max_voxels, const OnKeyframe& on_keyframe,
    const std::function<void(std::vector<CloudPoint>)>& on_slab) const {
  constexpr std::int64_t kEnd = std::numeric_limits<std::int64_t>::max();
  std::set<std::size_t> left_out;
  std::vector<Range> ranges(chosen_.size());
  Range all;
  std::int64_t begin = std::numeric_limits<std::int64_t>::min(), end = begin;
  /// Returns whether a keyframe has points in the slab, or checks those of one that has.
  const auto reaches = [&](std::size_t i) {
    const bool checks = options_.cloud.consistency.consistency != Consistency::kNone;
    const std::size_t around = checks ? GlobalCloud::kMaxNumberDifference : 0;
    for (std::size_t k = i < around ? 0 : i - around; k <= i + around && k < ranges.size(); ++k) {
      if (ranges[k].first < end && ranges[k].last >= begin) return true;
    }
    return false;
  };
  double voxels_per_x = 0;  // of the last slab
  for (bool is_first = true; end != kEnd; is_first = false) {
    begin = std::exchange(end, kEnd);
    // A guess, so that few keyframes are read that the slab does not have at its end.
    if (!is_first) {
      const double width = 1.2 * static_cast<double>(max_voxels) / voxels_per_x;
      if (width < static_cast<double>(all.last - begin)) {
        end = begin + 1 + static_cast<std::int64_t>(width);
      }
    }
    RefinedCloud cloud(options_.cloud, 0);
    cloud.keepSlab(begin, end);
    QualityStatistics quality;
    const auto leaveOutBad = [&](std::size_t below) {
      for (const std::size_t bad : quality.takeBad(below, options_.min_keyframe_quality)) {
        cloud.removePoints(bad);
        left_out.insert(bad);
      }
    };
    const double slabs_done = is_first ? 0 : all.shareBelow(begin);
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      const double read = static_cast<double>(i) / static_cast<double>(chosen_.size());
      what_.on_progress(is_first ? 0.5 * read : 0.5 + 0.5 * slabs_done);
      const Rigid3& T_world_ref = T_world_ref_[i].T_world_rig;
      std::vector<ViewPoint> points;
      if (is_first) {
        KeyframeDepthMap made = keyframe(i);
        if (on_keyframe) on_keyframe(i, made);
        points = pointsOf(made);
        ranges[i] = Range(points, T_world_ref, options_.cloud.voxel_size_m);
        all.first = std::min(all.first, ranges[i].first);
        all.last = std::max(all.last, ranges[i].last);
        if (options_.checks) {
          if (i > 0) leaveOutBad(i - 1);
          made.T_world_ref = made.T_odom_ref;  // a run judges it before the refinement
          quality.add(quality.judge(made, {}));
        }
      } else if (left_out.count(i) == 0 && reaches(i)) {
        points = pointsOf(keyframe(i));
      }
      cloud.insert(std::move(points), T_world_ref);
      if (cloud.cloud().finalizedVoxels() <= max_voxels) continue;
      if (const auto middle = cloud.cloud().middleX()) cloud.keepSlab(begin, end = *middle);
    }
    if (is_first) leaveOutBad(quality.keyframes());
    voxels_per_x = static_cast<double>(std::max(cloud.cloud().finalizedVoxels(), max_voxels / 10)) /
                   (static_cast<double>(end) - static_cast<double>(std::max(begin, all.first)));
    on_slab(cloud.cloud().pointsInWorld(options_.cloud.min_keyframes));
  }
  return left_out;
}

void SessionMap::requirePoints(std::size_t points) const {
  if (points > 0) return;
  throw std::runtime_error(
      fmt::format("there is no point: {} keyframes are chosen", chosen_.size()));
}

Box Box::of(const std::vector<double>& m) {
  constexpr std::size_t kCorners = 6;
  Box box;
  if (m.size() == kCorners) box = {{m[0], m[1], m[2]}, {m[3], m[4], m[5]}};
  if (m.size() != kCorners || !(box.min_m.array() <= box.max_m.array()).all()) {
    throw std::invalid_argument(
        "box: expected two corners, the lower one first: x0,y0,z0,x1,y1,z1");
  }
  return box;
}

bool Box::contains(const Eigen::Vector3d& p_world) const {
  return (p_world.array() >= min_m.array()).all() && (p_world.array() <= max_m.array()).all();
}

MapCloud::Ptr SessionMap::cloudOf(const Eigen::Vector3f& origin,
                                  const std::vector<CloudPoint>& points) const {
  const MapCloud::Ptr all = mapCloudAt(origin, points);
  if (!what_.box) return all;
  auto inside = pcl::make_shared<MapCloud>();
  inside->sensor_origin_ = all->sensor_origin_;
  for (const MapPoint& point : *all) {
    if (what_.box->contains(positionIn(*all, point))) inside->push_back(point);
  }
  return inside;
}

MapSnapshot SessionMap::snapshot(bool keeps_keyframes, const OnKeyframe& on_keyframe) const {
  MapSnapshot map;
  map.trajectory = T_world_ref_;
  const auto keep = [&](std::size_t i, const KeyframeDepthMap& keyframe) {
    if (on_keyframe) on_keyframe(i, keyframe);
    if (!keeps_keyframes) return;
    map.keyframes.push_back({T_world_ref_[i].t_ns, T_world_ref_[i].T_world_rig,
                             std::make_shared<const std::vector<ViewPoint>>(pointsOf(keyframe))});
  };
  for (const std::size_t bad : visitSlabs(kOneSlab, keep, [&](std::vector<CloudPoint> points) {
         CloudOrigin origin(options_.cloud.voxel_size_m);
         origin.add(points);
         map.points = cloudOf(origin.origin(), points);
       })) {
    if (keeps_keyframes) {
      map.keyframes[bad].points = std::make_shared<const std::vector<ViewPoint>>();
    }
  }
  requirePoints(map.points->size());
  return map;
}

}  // namespace efm
