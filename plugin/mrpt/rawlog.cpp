// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/rawlog.h"

#include <fmt/format.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>
#include <zlib.h>

#include <algorithm>
#include <any>
#include <cerrno>
#include <cstring>
#include <deque>
#include <exception>
#include <limits>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "mapping/base/atomic_file.h"
#include "mapping/base/text.h"
#include "plugin/checks/health_checks.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/pose_observation.h"

namespace efm {
namespace {

std::string systemReason() {
  const int number = errno;
  const std::string why = reasonNotWritten(number);
  return why.empty() ? std::strerror(number) : why;
}

std::string reasonOf(gzFile file) {
  int code = Z_OK;
  const char* message = gzerror(file, &code);
  if (code == Z_BUF_ERROR) return "the file ends in the middle of its data";
  if (code == Z_ERRNO) return systemReason();
  if (message == nullptr || *message == '\0') return "unknown error";
  const std::string text = message;  // "<path>: <reason>"; the caller names the file
  const auto colon = text.rfind(": ");
  return colon == std::string::npos ? text : text.substr(colon + 2);
}

/// Removes the text up to the end of the last occurrence of a word.
void dropThrough(std::string_view& text, std::string_view last) {
  const auto at = text.rfind(last);
  if (at != std::string_view::npos) text.remove_prefix(at + last.size());
}

/// Returns the reason of an error without MRPT's decoration. Each object around the damage adds
///
///     ==== MRPT exception ====
///     Message:  Exception while parsing typed object '…' from …
///     Original exception:
///     <this text for the inner object, or the reason>
///     Location: <source file, line, function>
///     Call stack backtrace: …
std::string reasonOf(const std::exception& error) {
  constexpr std::size_t kMaxCharacters = 400;
  constexpr std::string_view kHeading = "==== MRPT exception ====";
  std::string_view text = error.what();
  dropThrough(text, "Original exception:");
  text = text.substr(0, text.find("\nLocation:"));

  std::string reason;  // the message of an inner error may come before MRPT's heading
  const auto heading = text.find(kHeading);
  if (heading != std::string_view::npos) {
    reason = text.substr(0, heading);
    text.remove_prefix(heading + kHeading.size());
  }
  dropThrough(text, "Message:");
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  text = text.substr(0, text.find_first_of("\r\n"));
  // "[/path/file.cpp, line 12, function] message"
  if (!text.empty() && text.front() == '[') dropThrough(text, "] ");
  reason += text;
  reason.erase(0, reason.find_first_not_of(" \t\r\n"));
  return reason.empty() ? "unreadable" : printable(reason, kMaxCharacters);
}

using mrpt::obs::CObservation;
using mrpt::obs::CObservationRobotPose;

/// Reads the observations of a rawlog one by one, including observations in sensory frames.
class RawlogReader {
 public:
  static constexpr int kAllCameras = std::numeric_limits<int>::max();
  /// @param camera whose events are read, see `ReadEventsOf`; or those of all cameras.
  explicit RawlogReader(std::filesystem::path file, int camera = -1)
      : file_(std::move(file)), camera_(camera), stream_(file_) {}

  /// @return null at the end.
  CObservation::Ptr next() {
    while (pending_.empty()) {
      try {
        if (stream_.atEnd()) {
          if (entries_ == 0) throw std::runtime_error("the file is empty");
          takeActions({});
          if (pending_.empty()) return nullptr;
          break;
        }
        readEntry();
      } catch (const std::exception& error) {
        throw std::runtime_error(fmt::format("stopped at entry {} of {}: {}", entries_,
                                             file_.string(), whyStopped(error)));
      }
      ++entries_;
    }
    CObservation::Ptr observation = std::move(pending_.front());
    pending_.pop_front();
    return observation;
  }

  /// Returns the entry of the last observation.
  std::string position() const {
    return fmt::format("entry {} of {}", entries_ == 0 ? 0 : entries_ - 1, file_.string());
  }
  double progress() const { return stream_.progress(); }
  const std::filesystem::path& file() const { return file_; }

 private:
  void readEntry() {
    std::optional<ReadEventsOf> events_of;
    if (camera_ != kAllCameras) events_of.emplace(camera_);
    auto archive = mrpt::serialization::archiveFrom<mrpt::io::CStream>(stream_);
    const mrpt::serialization::CSerializable::Ptr entry = archive.ReadObject();
    if (!entry) throw std::runtime_error("an empty object");
    if (auto action = std::dynamic_pointer_cast<mrpt::obs::CActionCollection>(entry)) {
      actions_.push_back(action);
    } else if (auto observation = std::dynamic_pointer_cast<CObservation>(entry)) {
      takeActions({});
      if (!IS_CLASS(*observation, mrpt::obs::CObservationComment)) pending_.push_back(observation);
    } else if (auto frame = std::dynamic_pointer_cast<mrpt::obs::CSensoryFrame>(entry)) {
      takeActions(*frame);
      for (const auto& seen : *frame) pending_.push_back(seen);
    } else {
      throw std::runtime_error(std::string("an object of class '") +
                               entry->GetRuntimeClass()->className +
                               "': expected observations, sensory frames and actions");
    }
  }

  /// Composes the actions so far to poses. An action without a time gets the frame's time. If poses
  /// have the same time, only the last pose is kept: it has all movements before the frame.
  void takeActions(const mrpt::obs::CSensoryFrame& frame) {
    CObservation::Ptr newest;
    while (!actions_.empty()) {
      const auto action = actions_.front();
      actions_.pop_front();
      const auto pose = reckoning_.poseAfter(*action, frame);
      if (!pose) continue;
      if (newest && newest->timestamp == pose->timestamp) pending_.pop_back();
      pending_.push_back(pose);
      newest = pose;
    }
  }

  /// Returns the reason. MRPT reports each error of a stream before an object's name as its end.
  std::string whyStopped(const std::exception& error) {
    std::string reason = reasonOf(error);
    if (reason.find("Assert condition failed") != std::string::npos) {
      return "the data are damaged: they are no object that MRPT wrote";
    }
    if (reason.find("EOF") == std::string::npos) return reason;
    try {
      stream_.atEnd();  // throws the same exception again
    } catch (const std::exception& cause) {
      return reasonOf(cause);
    }
    return "the file ends in the middle of its data";
  }

  std::filesystem::path file_;
  int camera_;
  GzStream stream_;
  std::uint64_t entries_ = 0;  // entries that were read so far
  std::deque<CObservation::Ptr> pending_;
  std::deque<mrpt::obs::CActionCollection::Ptr> actions_;  // before the next frame
  DeadReckoning reckoning_;
};

CObservationEvents::Ptr asPacket(const CObservation::Ptr& observation) {
  return std::dynamic_pointer_cast<CObservationEvents>(observation);
}

constexpr int kOthers = -1;

/// Returns the stream of an observation: a camera, or the observations that are neither events nor
/// poses; std::nullopt for a pose.
std::optional<int> streamOf(const CObservation::Ptr& observation) {
  if (const auto packet = asPacket(observation)) return packet->camera_index;
  return poseSourceOf(*observation) ? std::nullopt : std::optional(kOthers);
}

/// Reads a rawlog once for all of its streams. What belongs to another stream waits for it. A
/// stream for which too much waits is far behind the others: it reads the rest on its own.
class RawlogStreams {
 public:
  explicit RawlogStreams(const std::filesystem::path& file)
      : reader_(file, RawlogReader::kAllCameras) {}

  struct Read {
    CObservation::Ptr observation;
    std::string position;
  };

  void open(int stream) { streams_.try_emplace(stream); }
  void close(int stream) { streams_.erase(stream); }
  /// Returns the next observation of a stream, or null at the end.
  /// @throws std::runtime_error at damage, after what was read before it.
  Read next(int id) {
    Stream& stream = streams_.at(id);
    while (stream.waiting.empty() && !stream.is_behind && readOn()) {
    }
    if (!stream.waiting.empty()) {
      Read next = std::move(stream.waiting.front());
      stream.waiting.pop_front();
      stream.waiting_events -= eventsIn(next.observation);
      return next;
    }
    if (stream.is_behind) return nextOf(id, stream);
    if (!damage_.empty()) throw std::runtime_error(damage_);
    return {};
  }
  double progress() const { return reader_.progress(); }
  const std::filesystem::path& file() const { return reader_.file(); }

 private:
  struct Stream {
    std::deque<Read> waiting;
    std::size_t waiting_events = 0;
    std::size_t count = 0;  // observations of the stream that were read for all
    bool is_behind = false;
    std::unique_ptr<RawlogReader> own;
  };

  static std::size_t eventsIn(const CObservation::Ptr& observation) {
    const auto packet = asPacket(observation);
    return packet ? packet->events.size() : 1;
  }

  /// Reads one observation. @return false at the end, and at damage.
  bool readOn() {
    constexpr std::size_t kMaxWaiting = 1'000'000;  // events: 16 MB
    if (ended_) return false;
    CObservation::Ptr observation;
    try {
      observation = reader_.next();
    } catch (const std::runtime_error& error) {
      damage_ = error.what();
    }
    ended_ = !observation;
    if (ended_) return false;
    const std::optional<int> id = streamOf(observation);
    const auto found = id ? streams_.find(*id) : streams_.end();
    if (found == streams_.end() || found->second.is_behind) return true;
    Stream& stream = found->second;
    ++stream.count;
    stream.waiting_events += eventsIn(observation);
    stream.is_behind = stream.waiting_events > kMaxWaiting;
    stream.waiting.push_back({std::move(observation), reader_.position()});
    return true;
  }

  /// Returns the next observation of a stream that reads on its own.
  Read nextOf(int id, Stream& stream) {
    if (!stream.own) {
      stream.own = std::make_unique<RawlogReader>(file(), id);
      for (std::size_t i = 0; i < stream.count; ++i) nextOf(id, stream);
    }
    CObservation::Ptr observation = stream.own->next();
    while (observation && streamOf(observation) != id) observation = stream.own->next();
    return {observation, stream.own->position()};
  }

  RawlogReader reader_;
  std::map<int, Stream> streams_;
  bool ended_ = false;
  std::string damage_;
};

/// Reads the events of one camera.
class RawlogEvents : public EventStream {
 public:
  /// @param first the camera's first packet, without events.
  RawlogEvents(std::shared_ptr<RawlogStreams> streams, CObservationEvents::Ptr first)
      : streams_(std::move(streams)), first_(std::move(first)) {
    streams_->open(first_->camera_index);
  }

  bool sharesDamage() const override { return true; }
  std::string positionOf(std::size_t /*index*/) const override { return position_; }
  std::string name() const override { return streams_->file().string(); }
  double progress() const override { return streams_->progress(); }
  std::optional<CameraSize> size() const override {
    return CameraSize{first_->camera.width, first_->camera.height};
  }
  std::string label() const override { return first_->sensorLabel; }
  std::shared_ptr<const void> original() const override { return first_; }

 protected:
  bool decode(std::vector<Event>& events) override {
    events.clear();
    while (true) {
      auto [observation, position] = streams_->next(first_->camera_index);
      if (!observation) return false;
      position_ = std::move(position);
      const auto packet = asPacket(observation);
      if (!isSame(calibrationOf(*packet), calibrationOf(*first_))) {
        throw std::runtime_error(
            fmt::format("{}: camera {}: its calibration or its pose on the rig differs from that "
                        "of its first packet",
                        position_, packet->camera_index));
      }
      if (packet->events.empty()) continue;
      events = std::move(packet->events);
      return true;
    }
  }

 private:
  std::shared_ptr<RawlogStreams> streams_;
  CObservationEvents::Ptr first_;
  std::string position_;
};

/// Reads observations that are neither events nor poses. The streams of events report damage.
class RawlogOthers : public OtherStream {
 public:
  explicit RawlogOthers(std::shared_ptr<RawlogStreams> streams) : streams_(std::move(streams)) {
    streams_->open(kOthers);
  }
  ~RawlogOthers() override { streams_->close(kOthers); }
  RawlogOthers(const RawlogOthers&) = delete;
  RawlogOthers& operator=(const RawlogOthers&) = delete;

  std::optional<OtherSample> next() override {
    CObservation::Ptr observation;
    try {
      observation = streams_->next(kOthers).observation;
    } catch (const std::runtime_error&) {
    }
    if (!observation) return std::nullopt;
    return OtherSample{observation->GetRuntimeClass()->className,
                       nanosecondsIfKnown(observation->timestamp), std::move(observation)};
  }

 private:
  std::shared_ptr<RawlogStreams> streams_;
};

/// What a rawlog has beside its events.
struct RawlogScan {
  std::map<int, CObservationEvents::Ptr> cameras;  // the first packet of each, without events
  std::vector<PoseSample> poses;
  std::string poses_damage;
  bool has_others = false;
};

RawlogScan scanOf(const std::filesystem::path& file, bool keep_originals) {
  RawlogScan scan;
  RawlogReader reader(file);
  // A pose that cannot be used causes an error at the recording's end.
  const auto add_pose = [&](const CObservation::Ptr& observation) {
    try {
      PoseSample& pose = scan.poses.emplace_back(*poseIn(*observation));
      if (keep_originals) pose.original = observation;
    } catch (const std::invalid_argument& error) {
      if (scan.poses_damage.empty()) scan.poses_damage = reader.position() + ": " + error.what();
    }
  };
  try {
    while (const CObservation::Ptr observation = reader.next()) {
      if (const auto packet = asPacket(observation)) {
        scan.cameras.emplace(packet->camera_index, packet);
      } else if (poseSourceOf(*observation)) {
        add_pose(observation);
      } else {
        scan.has_others = true;
      }
    }
  } catch (const std::runtime_error& error) {
    if (scan.cameras.empty() && scan.poses.empty() && !scan.has_others) throw;
    if (scan.cameras.empty()) scan.poses_damage = error.what();
  }
  return scan;
}

CObservationEvents::Ptr emptyPacketOf(int index, const RigCamera& camera,
                                      const RecordedCamera& recorded) {
  const auto original = std::static_pointer_cast<const CObservationEvents>(recorded.original);
  auto observation = CObservationEvents::Create();
  observation->sensorLabel = recorded.label;
  observation->timestamp = INVALID_TIMESTAMP;
  observation->camera_index = index;
  observation->camera = camera.model;
  const bool is_original = original && isSame(calibrationOf(*original).T_rig_cam, camera.T_rig_cam);
  observation->camera_pose = is_original ? original->camera_pose : mrptPoseFrom(camera.T_rig_cam);
  observation->time_offset_ns = camera.time_offset_ns;
  return observation;
}

CObservation::Ptr observationOf(const PoseSample& pose) {
  if (!pose.original) return poseObservation(pose);
  const auto original = std::static_pointer_cast<const CObservation>(pose.original);
  auto observation = std::dynamic_pointer_cast<CObservation>(original->duplicateGetSmartPtr());
  const PoseSample before = *poseIn(*original);
  observation->timestamp = mrptTimeFrom(pose.t_ns);
  if (!isSame(before.T_body_rig, pose.T_body_rig)) {
    observation->setSensorPose(mrptPoseFrom(pose.T_body_rig.inverse()));
  }
  const auto robot = std::dynamic_pointer_cast<CObservationRobotPose>(observation);
  if (robot && !isSame(before.T_world_body, pose.T_world_body)) {
    robot->pose.mean = mrptPoseFrom(pose.T_world_body);
  }
  return observation;
}

class GzRawlogWriter : public RawlogWriter {
 public:
  GzRawlogWriter(const std::filesystem::path& file, RawlogCompression compression,
                 const Recording& recording)
      : recording_(recording),
        file_(file),
        compression_(compression == RawlogCompression::kZstd ? EventCompression::kZstd
                                                             : EventCompression::kNone),
        stream_(file_.temporary(), compression == RawlogCompression::kGzip
                                       ? GzStream::Mode::kWrite
                                       : GzStream::Mode::kWritePlain) {}

  void write(Sample sample) override {
    if (auto* packet = std::get_if<EventPacket>(&sample)) {
      if (cameras_.empty()) declareRig(packet->events.front().t_ns);
      const auto& camera = *cameras_[static_cast<std::size_t>(packet->camera)];
      auto observation = std::make_shared<CObservationEvents>(camera);
      observation->timestamp = mrptTimeFrom(packet->events.front().t_ns);
      observation->events = std::move(packet->events).take();
      observation->covered_until_ns = packet->complete_until_ns;
      write(observation);
    } else if (const auto* pose = std::get_if<PoseSample>(&sample)) {
      write(observationOf(*pose));
    } else {
      const auto& original = std::get<OtherSample>(sample).original;
      write(std::const_pointer_cast<CObservation>(
          std::static_pointer_cast<const CObservation>(original)));
    }
  }

  void close() override {
    try {
      stream_.close();
      file_.replace();
    } catch (const std::exception& error) {
      throw std::runtime_error(file_.path().string() + ": " + error.what());
    }
  }

 private:
  /// Writes one empty packet per camera: see CObservationEvents.
  void declareRig(std::int64_t first_ns) {
    const std::vector<RigCamera>& rig = recording_.rig().cameras;
    const std::vector<RecordedCamera> recorded = recording_.cameras();
    for (std::size_t i = 0; i < rig.size(); ++i) {
      auto& camera = cameras_.emplace_back(emptyPacketOf(static_cast<int>(i), rig[i], recorded[i]));
      camera->compression = compression_;
      auto declaration = std::make_shared<CObservationEvents>(*camera);
      declaration->timestamp = mrptTimeFrom(first_ns);
      declaration->covered_until_ns = recorded[i].first_ns;
      write(declaration);
    }
  }

  void write(const CObservation::Ptr& observation) {
    try {
      auto archive = mrpt::serialization::archiveFrom<mrpt::io::CStream>(stream_);
      archive << *observation;
    } catch (const std::exception& error) {
      throw std::runtime_error(file_.path().string() + ": cannot be written: " + error.what());
    }
  }

  const Recording& recording_;
  std::vector<CObservationEvents::Ptr> cameras_;  // packets without events
  AtomicFile file_;
  EventCompression compression_;
  GzStream stream_;
};

}  // namespace

GzStream::GzStream(const std::filesystem::path& file, Mode mode) : file_(nullptr, gzclose) {
  constexpr unsigned kBufferSize = 1U << 18U;
  const std::filesystem::file_status status = std::filesystem::status(file);
  if (mode == Mode::kRead && !std::filesystem::is_regular_file(status)) {
    const char* const what = std::filesystem::is_directory(status) ? "a folder: expected a file"
                             : std::filesystem::exists(status)     ? "not a regular file"
                                                                   : "no such file";
    throw std::runtime_error(file.string() + ": " + what);
  }
  if (mode == Mode::kRead) file_size_ = std::filesystem::file_size(file);
  file_.reset(gzopen(file.c_str(), mode == Mode::kRead    ? "rb"
                                   : mode == Mode::kWrite ? "wb1"
                                                          : "wbT"));
  if (!file_) throw std::runtime_error(file.string() + ": cannot be opened: " + systemReason());
  gzbuffer(file_.get(), kBufferSize);
}

bool GzStream::atEnd() {
  const int byte = gzgetc(file_.get());
  if (byte >= 0) {
    gzungetc(byte, file_.get());
    return false;
  }
  int code = Z_OK;
  gzerror(file_.get(), &code);  // it also reports a truncated file
  if (code != Z_OK) throw std::runtime_error(reasonOf(file_.get()));
  return true;
}

double GzStream::progress() const {
  const auto offset = static_cast<double>(gzoffset(file_.get()));
  return file_size_ == 0 ? 1.0 : std::clamp(offset / static_cast<double>(file_size_), 0.0, 1.0);
}

void GzStream::close() {
  if (file_ && gzclose(file_.release()) != Z_OK) {
    throw std::runtime_error("cannot be completed: " + systemReason());
  }
}

std::size_t GzStream::Read(void* buffer, std::size_t count) {
  const std::size_t done = gzfread(buffer, 1, count, file_.get());
  if (done < count) atEnd();
  return done;
}

std::size_t GzStream::Write(const void* buffer, std::size_t count) {
  if (gzfwrite(buffer, 1, count, file_.get()) != count) {
    throw std::runtime_error(reasonOf(file_.get()));
  }
  return count;
}

std::uint64_t GzStream::Seek(std::int64_t, TSeekOrigin) {
  throw std::logic_error("a stream goes forward");
}
std::uint64_t GzStream::getTotalBytesCount() const {
  throw std::logic_error("a stream has no known size");
}
std::uint64_t GzStream::getPosition() const {
  return static_cast<std::uint64_t>(gztell(file_.get()));
}

RecordingParts openRawlog(const std::filesystem::path& file, const ReaderOptions& options) {
  const bool is_scanned = options.scan && options.scan->has_value();
  RawlogScan scan =
      is_scanned ? std::any_cast<RawlogScan>(*options.scan) : scanOf(file, options.keep_originals);
  if (options.scan && !is_scanned) *options.scan = scan;
  RecordingParts parts;
  parts.pose_samples = std::move(scan.poses);
  parts.poses_damage = std::move(scan.poses_damage);
  Calibration calibration{file, {}};
  const auto streams = std::make_shared<RawlogStreams>(file);
  bool is_calibrated = false;  // at least one camera; the mapping reports uncalibrated cameras
  for (const auto& [index, first] : scan.cameras) {
    if (index != static_cast<int>(calibration.rig.cameras.size())) {
      throw std::runtime_error(
          fmt::format("{}: the recording has events of camera {} but none of camera {}",
                      file.string(), index, calibration.rig.cameras.size()));
    }
    calibration.rig.cameras.push_back(calibrationOf(*first));
    is_calibrated = is_calibrated || isCalibrated(first->camera);
    parts.cameras.push_back(std::make_unique<RawlogEvents>(streams, first));
  }
  if (is_calibrated) parts.calibration = std::move(calibration);
  if (scan.has_others) parts.others = std::make_unique<RawlogOthers>(streams);
  return parts;
}

std::unique_ptr<RawlogWriter> writeRawlog(const std::filesystem::path& file,
                                          RawlogCompression compression,
                                          const Recording& recording) {
  return std::make_unique<GzRawlogWriter>(file, compression, recording);
}

}  // namespace efm
