// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/cloud/map_point.h"
#include "plugin/recordings/streams/sample.h"
#include "plugin/session/map_snapshot.h"
#include "plugin/session/session_status.h"

/// @mainpage
/// The engine of event-fusion-mapper: events of calibrated cameras and poses of a tracker in,
/// keyframe depth maps and one point cloud out. A program needs event_fusion/engine.h alone:
///
/// - efm::Mapper maps cameras, events and poses that a program has (`addCamera`, `addEvents`,
///   `addPose`), or the samples of a recording; while they come, or beside a sensor.
/// - efm::openRecording reads a recording of any format.
/// - efm::mapRecording maps a whole recording into a folder.
/// - efm::Options are the options of all. share/event-fusion-mapper/config/default.ini lists them,
///   share/event-fusion-mapper/examples has four programs.
///
/// Times are nanoseconds, lengths metres; `T_a_b` maps coordinates of frame b to frame a:
/// p_a = T_a_b * p_b. Frames: `world`; `rig` (the common frame of the cameras, often camera 0);
/// `body` (what the tracker tracks, if it is not the rig: option `rig.hand_eye`); `cam` (x right,
/// y down, z forward); `ref` (a keyframe's view, as `cam`).
namespace efm {

#ifdef EFM_EIGEN_ALIGN  // of the installed engine
static_assert(EIGEN_MAX_STATIC_ALIGN_BYTES == EFM_EIGEN_ALIGN,
              "the engine was compiled for another processor (-march), so that types of Eigen have "
              "another alignment: compile all files with -DEIGEN_MAX_STATIC_ALIGN_BYTES=16, or the "
              "engine with the same -march");
#endif

class MapperDriver;
class OptionReader;
struct EventFusionOptions;

/// Options with the keys of option files. By default depth limits, planes and windows are chosen
/// from the data.
class Options {
 public:
  Options();

  /// Sets an option: set("dsi.max_depth_m", "8"). Ranges are checked when the options are used: a
  /// Mapper or `mapRecording` throws std::invalid_argument with key, value and allowed range.
  /// @throws std::invalid_argument if the key is unknown, or the value is of another kind.
  void set(std::string_view key, std::string_view value);
  /// Sets the options of an .ini file; other options keep their values.
  /// @param ini a file, or the name of an installed one: "davis346_mvsec".
  /// @throws std::invalid_argument if there is no such file, or as `set`, naming file and line.
  void read(const std::filesystem::path& ini);

  // For code of this project: the headers of EventFusionOptions are not installed.
  Options(const EventFusionOptions& unchecked);  // NOLINT(google-explicit-constructor)
  EventFusionOptions values() const;  ///< @throws std::invalid_argument at a wrong value.

 private:
  template <typename Change>
  void change(const Change& change);

  std::shared_ptr<const OptionReader> reader_;  // never changed: copies share it
  bool as_they_are_ = false;
};

/// Files that replace parts of a recording, limits, and how to read the files.
struct Overrides {
  std::filesystem::path poses;        ///< Poses of the rig: text, NumPy, or another recording.
  std::filesystem::path calibration;  ///< Kalibr, DSEC, TUM-VIE, camera_info, nine numbers, …
  std::filesystem::path hand_eye;     ///< T_body_rig; the poses are then poses of the body.
  TimeLimits limits;                  ///< Other events are not read. On the clock of the poses.

  // What cannot be found in the files: the options of event-fusion map with these names.
  std::string format = "auto";
  std::vector<std::string> topics;
  std::string event_columns;
  std::string time_unit;  ///< Of events: s, ms, us or ns. Empty: found.
  std::string pose_time_unit;
  std::optional<std::pair<int, int>> sensor_size;  ///< Width and height of all sensors.
  std::uint64_t skip_bad_events = 0;               ///< Maximum number.
  /// The cameras of the calibration that the recording has, if the calibration has more.
  std::vector<int> cameras;
};

/// Opens a recording of any format that `event-fusion map` reads. It has all cameras and all poses.
/// @param files files and folders of one recording.
/// @throws std::runtime_error naming file, place, value and what was expected; so does
/// Recording::next at damage, after the samples before the damage.
std::unique_ptr<Recording> openRecording(const std::vector<std::filesystem::path>& files,
                                         const Overrides& overrides = {});

using Keyframe = KeyframeDepthMap;

/// Turns events and poses into keyframes and one map. Thread-safe.
///
/// In playback the caller's thread maps: a call returns when all windows that became complete are
/// mapped, or throws the first error. The same samples give the same map, bit for bit, on any
/// number of threads. Automatic options are chosen at `finish`, or when `live.max_queue_mb` of
/// events wait (then from these events): nothing is mapped before. If the input makes no keyframe,
/// nothing is thrown: `warnings` says why.
///
/// In live operation (`live.enabled`) a thread of the mapper maps. Adding never waits, and queries
/// return the newest published state. If too much input waits, the oldest windows are dropped.
/// Losses and errors are counted (LiveStatus) and logged.
class Mapper {
 public:
  /// The callbacks run in the thread that maps, and may use the mapper. They may drop the last
  /// reference to it: it ends after the callback.
  struct Callbacks {
    std::function<void(const Keyframe&)> on_keyframe;  ///< In the order of their windows.
    /// Live operation: receives each new snapshot of the map.
    std::function<void(const std::shared_ptr<const MapSnapshot>&)> on_map;
    std::function<void(const std::string&)> warn;  ///< Live losses and errors; wrong poses.
    std::function<void(const std::string&)> info;  ///< The chosen options, with their reasons.
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

  // Own data. Events and poses of the same time may come in any order. In playback all poses, and
  // the events of one camera after another, may also come at once: up to `live.max_queue_mb` of
  // events wait for a camera that has none yet.

  /// Adds a camera. @return its index, from 0.
  /// @param camera T_rig_cam has a unit quaternion.
  /// @throws std::invalid_argument if a value is not valid; std::logic_error after `addEvents`.
  int addCamera(const RigCamera& camera);
  /// Adds the next events of a camera, on the camera's clock. Events that are up to 10 ms out of
  /// order are sorted. In playback bursts of events with a time far ahead are left out, and
  /// `warnings` tells their number. After an error, no event of this call is added.
  /// @throws std::invalid_argument if an event is outside the sensor or older than that, or if
  /// there is no such camera.
  void addEvents(int camera, std::vector<Event> events);
  /// Adds the next pose, on the clock of the poses; the rotation is normalised. The pose is rounded
  /// as the poses of recordings are (time to 100 ns, rotation to 1e-12 rad), so that the same poses
  /// make the same map in every way. Of two poses of the same time the first one is used. A burst
  /// of poses that are over a second ahead is left out (warning `skipped-poses`; in live operation
  /// they count as rejected).
  /// @param noise standard deviations that the tracker states, for the refinement.
  /// @throws std::invalid_argument if the pose is not finite, or a second older than the newest
  /// one.
  void addPose(const StampedPose& pose, const std::optional<PoseNoise>& noise = std::nullopt);

  // Samples of a recording.

  /// Adds the cameras of a recording: `addCameras(recording->rig())`, before its samples. Further
  /// recordings must have the same cameras.
  /// @throws std::invalid_argument if the cameras do not fit the options, or differ from cameras
  /// that were added before.
  void addCameras(const Rig& rig);
  /// Adds a packet of events or a pose; an OtherSample is ignored.
  /// @throws std::invalid_argument if the sample contradicts its sensor or earlier samples;
  /// std::logic_error after `finish` in playback (in live operation it is counted).
  void add(Sample sample);

  /// Ends the input, and maps the rest; in live operation it waits for the rest. In playback it may
  /// be called again after an error.
  /// @throws std::logic_error in live operation within a callback; the error of the rig if an
  /// option or a camera does not fit.
  void finish();
  /// Ends without mapping the rest. Later input is lost. It waits for the current keyframe, and no
  /// callback begins after that. Within a callback of live operation it does not wait: the mapper's
  /// thread ends after the callback returns.
  void stop();

  /// Returns the map so far; in live operation its newest snapshot. Never null.
  std::shared_ptr<const MapSnapshot> snapshot() const;
  /// Returns the points. Their floats are relative to the cloud's `sensor_origin_`, which is not 0
  /// far from the world's origin: `positionIn(*cloud, point)` is a point in the world, in doubles.
  MapCloud::ConstPtr points() const { return snapshot()->points; }
  /// Returns the snapshot. In playback it has no points, because they cost an export of the map.
  std::shared_ptr<const MapSnapshot> keyframes() const;
  std::vector<StampedPose> trajectory() const { return keyframes()->trajectory; }
  SessionStatus status() const;
  /// Returns the warnings so far: poses and cameras that do not explain the events, implausible
  /// own data, unused data, and after `finish` why there is no keyframe, and coordinates that are
  /// too far for floats (`far-coordinates`: it exports the map). Some checks run only sometimes:
  /// own events only in playback, poses against events only with automatic options.
  /// `mapRecording` runs all.
  std::vector<Warning> warnings() const;

 protected:
  std::shared_ptr<MapperDriver> driver_;  ///< Not for hosts: its class is not installed.
};

/// Returns the SHA-256 of a map's points in hexadecimal digits: rows of x, y, z (metres, frame
/// `world`), intensity, sigma, probability (-1: not known) and support as little-endian doubles,
/// sorted. The same recording and options have the same hash on any number of threads, in the
/// program, C++, Python and MRPT in playback (docs/session.md names the exceptions).
std::string mapHash(const MapCloud& cloud);

/// What `mapRecording` made.
struct Report {
  std::uint64_t keyframes = 0;
  std::uint64_t points = 0;
  std::string map_hash;  ///< `mapHash` of the exported points.
  std::vector<Warning> warnings;
  MapQuality quality;
  std::string json;  ///< The content of report.json: counts, times, options, …
};

/// Maps a recording into a folder, as `event-fusion map` does: options that are chosen from the
/// data are chosen from the whole recording first. The folder gets map.pcd, map.html, keyframes/,
/// trajectory.txt, report.json and pictures; an earlier result there is replaced.
/// @param files, overrides see `openRecording`.
/// @param resume goes on with the keyframes that a run for this folder stored before it was stopped
/// or killed: the result is that of one undisturbed run. A complete result is not changed.
/// @throws std::invalid_argument if an option is out of range; std::runtime_error if the recording
/// cannot be read to its end, has no keyframe, or a file cannot be written; with `resume`, if
/// options or recording differ from those of the stored keyframes. The data before the damage are
/// mapped and written all the same.
Report mapRecording(const std::vector<std::filesystem::path>& files,
                    const std::filesystem::path& out, const Options& options = {},
                    const Overrides& overrides = {}, bool resume = false);

/// Writes a binary PCD file with the fields of MapPoint. The file appears when it is complete.
/// @throws std::runtime_error naming the file.
void writePcd(const std::filesystem::path& file, const MapCloud& cloud);
/// Writes a binary PLY file, coloured by height. (map.ply of a recording is coloured along the mean
/// upward axis of its cameras.)
/// @param views keyframes of the map, `Mapper::trajectory`: each point gets a normal towards the
/// first keyframe that saw it. Empty: no normals.
/// @param upward a unit vector, frame `world`.
void writePly(const std::filesystem::path& file, const MapCloud& cloud,
              const std::vector<StampedPose>& views = {},
              const Eigen::Vector3d& upward = Eigen::Vector3d::UnitZ());

}  // namespace efm
