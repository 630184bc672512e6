// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/session_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
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

/// Returns the pose nearest to a time. @param poses sorted by time, at least one.
const StampedPose& nearestPose(const std::vector<StampedPose>& poses, std::int64_t t_ns) {
  const auto after = std::lower_bound(
      poses.begin(), poses.end(), t_ns,
      [](const StampedPose& pose, std::int64_t wanted) { return pose.t_ns < wanted; });
  if (after == poses.begin()) return *after;
  if (after == poses.end() || t_ns - std::prev(after)->t_ns < after->t_ns - t_ns) {
    return *std::prev(after);
  }
  return *after;
}

/// The poses of a session's keyframes by a file: see SessionExport::poses.
struct CorrectedPoses {
  std::vector<StampedPose> T_world_ref;
  bool are_of_keyframes = true;  ///< false: the file has poses of the rig.
};

/// @throws std::runtime_error naming a keyframe without a pose.
CorrectedPoses correctedPoses(const SessionFile& session, const fs::path& file,
                              const TrajectoryOptions& options) {
  constexpr std::int64_t kSameNs = 1'000'000;  // some write milliseconds
  const bool is_simplemap = file.extension() == ".simplemap";
  std::vector<StampedPose> given =
      is_simplemap ? mrptLibrary(file.string() + ": a simplemap").readSimpleMap(file)
                   : readPoses(file);
  if (given.empty()) throw std::runtime_error(file.string() + ": no pose");
  CorrectedPoses corrected{session.poses(false)};
  const auto is_same_time = [](const StampedPose& a, const StampedPose& b) {
    return std::abs(a.t_ns - b.t_ns) <= kSameNs;
  };
  // In a merged session, two keyframes may have one time.
  if (std::equal(given.begin(), given.end(), corrected.T_world_ref.begin(),
                 corrected.T_world_ref.end(), is_same_time)) {
    for (std::size_t i = 0; i < given.size(); ++i) {
      corrected.T_world_ref[i].T_world_rig = given[i].T_world_rig;
    }
    return corrected;
  }
  const auto is_earlier = [](const StampedPose& a, const StampedPose& b) {
    return a.t_ns < b.t_ns;
  };
  std::stable_sort(given.begin(), given.end(), is_earlier);
  std::vector<StampedPose> keyframes = corrected.T_world_ref;
  std::stable_sort(keyframes.begin(), keyframes.end(), is_earlier);
  // A trajectory of the rig has poses between the keyframes, too.
  std::size_t at_keyframes = 0, between = 0;
  for (const StampedPose& pose : given) {
    const bool is_within = pose.t_ns > keyframes.front().t_ns && pose.t_ns < keyframes.back().t_ns;
    const bool is_at_keyframe = is_same_time(nearestPose(keyframes, pose.t_ns), pose);
    if (is_at_keyframe) ++at_keyframes;
    if (!is_at_keyframe && (is_within || keyframes.size() == 1)) ++between;
  }
  corrected.are_of_keyframes = is_simplemap || at_keyframes > between;
  Trajectory trajectory(options);
  for (const StampedPose& pose : given) {
    if (!corrected.are_of_keyframes) trajectory.add(pose);
  }
  for (std::size_t i = 0; i < corrected.T_world_ref.size(); ++i) {
    StampedPose& pose = corrected.T_world_ref[i];
    std::optional<Rigid3> T_world_ref;
    if (corrected.are_of_keyframes) {
      const StampedPose& nearest = nearestPose(given, pose.t_ns);
      if (is_same_time(nearest, pose)) T_world_ref = nearest.T_world_rig;
    } else if (const auto T_world_rig = trajectory.poseAt(pose.t_ns)) {
      T_world_ref = *T_world_rig * session.keyframe(i).T_rig_ref;
    }
    if (!T_world_ref) {
      throw std::runtime_error(fmt::format(
          "{}: no pose at {} s, the time of keyframe {}: it has {} poses{} from {} s to {} s",
          file.string(), formatSeconds(pose.t_ns), i, given.size(),
          corrected.are_of_keyframes ? " of keyframes" : "", formatSeconds(given.front().t_ns),
          formatSeconds(given.back().t_ns)));
    }
    pose.T_world_rig = *T_world_ref;
  }
  return corrected;
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
          "run that ended (map --resume), or the tracker's poses (--poses tracker, refined=False)");
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
    std::vector<StampedPose> T_world_ref = session.poses(what_.refined);
    if (!what_.poses.empty()) {
      CorrectedPoses corrected = correctedPoses(session, what_.poses, options_.mapper.trajectory);
      poses_are_of_keyframes_ = corrected.are_of_keyframes;
      T_world_ref = std::move(corrected.T_world_ref);
    }
    if (options_.late_fusion && session.keyframe(0).camera_maps.empty()) {
      throw std::runtime_error(session.path().string() +
                               ": has no maps of single cameras, which fusion.late of the first "
                               "session needs: expected sessions with the same fusion.late");
    }
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

namespace {

/// Returns the square of the distance to the nearest keyframe that looks in a similar direction,
/// and its index. Infinity: there is none.
std::pair<double, std::size_t> nearestView(const Rigid3& T_world_ref,
                                           const std::vector<StampedPose>& others,
                                           std::size_t end) {
  constexpr double kMinCosine = 0.5;
  std::pair<double, std::size_t> nearest{std::numeric_limits<double>::infinity(), 0};
  const Eigen::Vector3d forward = T_world_ref.rotation * Eigen::Vector3d::UnitZ();
  for (std::size_t i = 0; i < end; ++i) {
    const Rigid3& other = others[i].T_world_rig;
    const double squared = (other.translation - T_world_ref.translation).squaredNorm();
    if (squared >= nearest.first) continue;
    if (forward.dot(other.rotation * Eigen::Vector3d::UnitZ()) >= kMinCosine)
      nearest = {squared, i};
  }
  return nearest;
}

/// Returns at most `most` of a list, evenly.
template <typename Value>
std::vector<Value> someOf(const std::vector<Value>& all, std::size_t most) {
  std::vector<Value> some;
  const std::size_t count = std::min(all.size(), most);
  for (std::size_t i = 0; i < count; ++i) some.push_back(all[i * all.size() / count]);
  return some;
}

}  // namespace

/// Registers the chosen keyframes of the last session with those before it: those of its
/// keyframes that are nearest to them, and their surroundings.
void SessionMap::registerSession(std::size_t s) {
  const auto before = static_cast<std::size_t>(
      std::find_if(chosen_.begin(), chosen_.end(),
                   [s](const Chosen& chosen) { return chosen.session == s; }) -
      chosen_.begin());
  if (before == 0 || before == chosen_.size()) {
    throw std::runtime_error(sessions_[s]->path().string() +
                             ": cannot be registered: --t0 and --t1 choose no keyframe of it, or "
                             "none before it");
  }
  constexpr std::size_t kMostMoved = 60, kMostFixed = 300;  // 0.6 MB each
  std::vector<std::pair<double, std::size_t>> by_distance;
  for (std::size_t i = before; i < chosen_.size(); ++i) {
    by_distance.emplace_back(nearestView(T_world_ref_[i].T_world_rig, T_world_ref_, before).first,
                             i);
  }
  std::sort(by_distance.begin(), by_distance.end());
  by_distance.resize(
      std::min(by_distance.size(), std::max(4 * kMostMoved, by_distance.size() / 4)));
  std::vector<PosedCloud> moved, fixed;
  const auto add = [&](std::size_t i, std::vector<PosedCloud>& clouds) {
    clouds.push_back({RegistrationCloud(keyframe(i), options_.refinement.refiner.points),
                      T_world_ref_[i].T_world_rig});
  };
  std::set<std::size_t> around;
  for (const auto& [distance, i] : someOf(by_distance, kMostMoved)) {
    add(i, moved);
    const std::size_t nearest =
        nearestView(T_world_ref_[i].T_world_rig, T_world_ref_, before).second;
    constexpr std::size_t kAround = 10;
    for (std::size_t k = nearest < kAround ? 0 : nearest - kAround;
         k < std::min(before, nearest + kAround + 1); ++k) {
      around.insert(k);
    }
  }
  for (const std::size_t i :
       someOf(std::vector<std::size_t>(around.begin(), around.end()), kMostFixed)) {
    add(i, fixed);
  }
  try {
    registrations_.push_back(registerMap(fixed, moved));
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
  SessionWriter::addGeneration(sessions_.front()->path(), corrected_);
}

KeyframeDepthMap SessionMap::keyframe(std::size_t at) const {
  const auto& [session, number] = chosen_[at];
  KeyframeDepthMap keyframe = sessions_[session]->keyframe(number);
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
    constexpr double kMaxIndex = 9e18;  // a point beyond it is an outlier, or rejected
    for (const ViewPoint& point : points) {
      const double x = (T_world_ref * point.p_ref.cast<double>()).x();
      const auto index = static_cast<std::int64_t>(
          std::clamp(std::floor(x / voxel_size_m), -kMaxIndex, kMaxIndex));
      first = std::min(first, index);
      last = std::max(last, index);
    }
  }
  double shareBelow(std::int64_t x) const {
    const auto begin = static_cast<double>(first);
    return (static_cast<double>(x) - begin) / (static_cast<double>(last) - begin + 1);
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
  /// Returns whether a keyframe has points in the slab, or checks points of one that has.
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
    // A guess of the slab's end: without it, points would be read that are cut off later.
    if (!is_first) {
      const double width = 1.2 * static_cast<double>(max_voxels) / voxels_per_x;
      if (width < static_cast<double>(all.last) - static_cast<double>(begin)) {
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

MapSnapshot SessionMap::snapshot(bool keeps_keyframes, const OnKeyframe& on_keyframe,
                                 std::set<std::size_t>* left_out) const {
  MapSnapshot map;
  map.trajectory = T_world_ref_;
  const auto keep = [&](std::size_t i, const KeyframeDepthMap& keyframe) {
    if (on_keyframe) on_keyframe(i, keyframe);
    if (!keeps_keyframes) return;
    map.keyframes.push_back({T_world_ref_[i].t_ns, T_world_ref_[i].T_world_rig,
                             std::make_shared<const std::vector<ViewPoint>>(pointsOf(keyframe))});
  };
  const std::set<std::size_t> all_bad =
      visitSlabs(kOneSlab, keep, [&](const std::vector<CloudPoint>& points) {
        CloudOrigin origin(options_.cloud.voxel_size_m);
        origin.add(points);
        map.points = cloudOf(origin.origin(), points);
      });
  for (const std::size_t bad : all_bad) {
    if (keeps_keyframes) {
      map.keyframes[bad].points = std::make_shared<const std::vector<ViewPoint>>();
    }
  }
  if (left_out != nullptr) *left_out = all_bad;
  requirePoints(map.points->size());
  return map;
}

}  // namespace efm
