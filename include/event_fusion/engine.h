// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/cloud/map_point.h"
#include "plugin/session/sample.h"
#include "plugin/session/session_status.h"

/// The engine: events of calibrated cameras and poses of a tracker in, keyframe depth maps and one
/// point cloud out. A program needs this header alone. Times are nanoseconds, lengths metres;
/// `T_a_b` maps coordinates of frame b to frame a: p_a = T_a_b * p_b. Frames: `world`, `rig` (the
/// tracked body), `cam` (x right, y down, z forward), `ref` (a keyframe's view, as `cam`).
namespace efm {

class DsiSink;
class MapperCore;
class OptionReader;
struct EventFusionOptions;

/// Options, with the keys of option files (config/default.ini lists all with their ranges). By
/// default depth limits, planes and windows are chosen from the data.
class Options {
 public:
  Options();
  /// Takes the values as they are, checked by the caller.
  Options(const EventFusionOptions& values);  // NOLINT(google-explicit-constructor)

  /// Sets an option: set("dsi.max_depth_m", "8"). Ranges are checked when the options are used: a
  /// Mapper or `mapRecording` throws std::invalid_argument with key, value and allowed range.
  /// @throws std::invalid_argument if the key is unknown, or the value is of another kind.
  void set(std::string_view key, std::string_view value);
  /// Sets the options of an .ini file; other options keep their values.
  /// @throws std::runtime_error if the file cannot be read; std::invalid_argument as `set`, naming
  /// file and line.
  void read(const std::filesystem::path& ini);

  /// Returns all values. @throws std::invalid_argument if a value is out of range.
  EventFusionOptions values() const;

 private:
  template <typename Change>
  void change(const Change& change);

  std::shared_ptr<const OptionReader> reader_;  // never changed: copies share it
  bool as_they_are_ = false;
};

/// Files that replace parts of a recording, and limits.
struct Overrides {
  std::filesystem::path poses;        ///< Poses of the rig: text, NumPy, or another recording.
  std::filesystem::path calibration;  ///< Kalibr, DSEC, TUM-VIE, camera_info, nine numbers, …
  std::filesystem::path hand_eye;     ///< T_body_rig; the poses are then poses of the body.
  TimeLimits limits;                  ///< Other events are not read. On the clock of the poses.
};

/// Opens a recording of any format that `event-fusion map` reads. It has all cameras and all poses.
/// @param files files and folders of one recording.
/// @throws std::runtime_error naming file, place, value and what was expected; so does
/// Recording::next at damage, after the samples before the damage.
std::unique_ptr<Recording> openRecording(const std::vector<std::filesystem::path>& files,
                                         const Overrides& overrides = {});

using Keyframe = KeyframeDepthMap;

/// Points of a keyframe in its reference view, and the pose of the view. 20 bytes per point.
/// Transformed to the world, they are again the points of the map, bit for bit.
struct StoredKeyframe {
  std::int64_t t_ref_ns = 0;
  Rigid3 T_world_ref;
  std::shared_ptr<const std::vector<ViewPoint>> points;  ///< Never null; shared, never changed.
};

/// The map at one moment.
struct MapSnapshot {
  /// T_world_ref of all keyframes at t_ref. The keyframes of the initial map come first.
  std::vector<StampedPose> trajectory;
  /// The poses of the same keyframes by the tracker. They differ if keyframes are refined.
  std::vector<StampedPose> tracker_trajectory;
  std::vector<StoredKeyframe> keyframes;  ///< All in playback, the newest in live operation.
  MapCloud::ConstPtr points;              ///< The exported points.
};

/// Turns the samples of a recording or of a sensor into keyframes and one map. Thread-safe.
///
/// In playback the caller's thread maps. `add` returns when all windows that became complete are
/// mapped, so the same samples give the same map, bit for bit, on any number of threads. The caller
/// gets the first error. If a window cannot be mapped (no memory, a sink that throws), the next
/// call tries it again. If its keyframe cannot be stored, the window is dropped. A query waits
/// while a keyframe is made, but not while it is delivered. If several threads add samples,
/// keyframes may be delivered at the same time. Within a callback `add` and `finish` only take the
/// input: the caller of the callback maps it. Automatic options are chosen at `finish`, or when
/// `live.max_queue_mb` of events wait: nothing is mapped before.
///
/// In live operation (`live.enabled`) a thread of the mapper maps. `add` never waits, and queries
/// return the newest published state. If more input waits than the queue may hold, the oldest
/// windows are dropped. Errors of the mapping, the refinement and the callbacks are counted and
/// logged (LiveStatus); the window is dropped and the next one is tried. The snapshot of the map is
/// renewed after each keyframe, as long as this takes at most a twentieth of the time.
class Mapper {
 public:
  /// The callbacks run in the thread that maps, and may use the mapper. In live operation they may
  /// drop the last reference to it.
  struct Callbacks {
    std::function<void(const Keyframe&)> on_keyframe;  ///< In the order of their windows.
    /// Live operation: receives each new snapshot of the map.
    std::function<void(const std::shared_ptr<const MapSnapshot>&)> on_map;
    std::function<void(const std::string&)> warn;
    std::function<void(const std::string&)> info;
  };

  /// @param earlier keyframes of an initial map.
  /// @throws std::invalid_argument if an option is out of range; std::runtime_error if a file that
  /// the options name cannot be read.
  explicit Mapper(const Options& options = {}, Callbacks callbacks = {},
                  const std::vector<StoredKeyframe>& earlier = {});
  /// Ends without mapping the rest.
  ~Mapper();
  Mapper(const Mapper&) = delete;
  Mapper& operator=(const Mapper&) = delete;

  // Own data. Poses may come before or after the events of their time.

  /// Adds a camera. @return its index, from 0.
  /// @throws std::invalid_argument if a value is not valid; std::logic_error after `addEvents`.
  int addCamera(const RigCamera& camera);
  /// Adds the next events of a camera; events up to 10 ms out of order are sorted.
  /// @throws std::invalid_argument as `add`, or if there is no such camera.
  void addEvents(int camera, std::vector<Event> events);
  /// Adds a pose, rounded as in recordings: time to 100 ns, rotation in its last digits.
  /// @param noise standard deviations that the tracker states, for the refinement.
  void addPose(const StampedPose& pose, const std::optional<PoseNoise>& noise = std::nullopt);

  // Samples of a recording.

  /// Adds a packet of events or a pose; an OtherSample is ignored.
  /// @throws std::invalid_argument if the sample contradicts its sensor or earlier samples;
  /// std::logic_error after `finish` in playback (in live operation it is counted).
  void add(Sample sample);
  /// Counts a packet that is not to be mapped. The windows that need its events are dropped.
  void skip(const EventPacket& packet);

  /// Ends the input, and maps the rest; in live operation it waits for the rest. In playback it may
  /// be called again after an error.
  /// @throws std::logic_error in live operation within a callback; the error of the rig if an
  /// option or a camera does not fit.
  void finish();
  /// Ends without mapping the rest. Later input is lost. It waits for the current keyframe, and no
  /// callback begins after that. Within a callback of live operation it does not wait: the mapper's
  /// thread ends after the callback returns.
  void stop();
  /// Returns whether the caller is in a callback of live operation.
  bool runsHere() const;

  /// Returns the map so far; in live operation its newest snapshot. Never null.
  std::shared_ptr<const MapSnapshot> snapshot() const;
  MapCloud::ConstPtr points() const { return snapshot()->points; }
  /// Returns the snapshot. In playback it has no points, because they cost an export of the map.
  std::shared_ptr<const MapSnapshot> keyframes() const;
  std::size_t numKeyframes() const;
  std::vector<StampedPose> trajectory() const { return keyframes()->trajectory; }
  SessionStatus status() const;
  /// Returns the warnings so far: wrong or missing poses, unused data, why there is no keyframe.
  /// `mapRecording` has more: it looks at the whole recording first.
  std::vector<Warning> warnings() const;
  /// Returns the newest keyframe's depth map (empty before the first one), and its depth planes.
  std::pair<cv::Mat1f, DepthPlanesOptions> newestDepth() const;
  /// Returns the pose of the rig on the tracked body, from the options.
  const std::optional<Rigid3>& T_body_rig() const;

  /// @param sink receives every fused plane; may be null. Not owned, and must not use the mapper.
  /// The current keyframe may still use the former sink.
  void setSink(DsiSink* sink);
  /// @param clock measures the stages of the mapping; must not use the mapper. Default: the
  /// processor time of the process.
  void setClock(ProcessorClock clock);

 private:
  std::shared_ptr<MapperCore> core_;
};

/// Writes a binary PCD file with the fields of MapPoint. The file appears when it is complete.
/// @throws std::runtime_error naming the file.
void writePcd(const std::filesystem::path& file, const MapCloud& cloud);
/// Writes a binary PLY file, coloured by height along the world's z axis.
void writePly(const std::filesystem::path& file, const MapCloud& cloud);

}  // namespace efm
