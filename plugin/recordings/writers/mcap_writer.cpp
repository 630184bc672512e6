// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/writers/mcap_file.h"
#include "plugin/recordings/writers/recording_writer.h"

namespace efm {
namespace {

constexpr std::size_t kMcapChunkBytes = 1 << 20;
constexpr std::uint16_t kPoseChannel = 1;

/// Returns a camera's channel of events; its camera info is the next one. Poses have channel 1.
std::uint16_t eventsChannel(std::size_t camera) {
  return static_cast<std::uint16_t>(kPoseChannel + 1 + 2 * camera);
}

std::string frameOf(std::size_t camera) { return fmt::format("cam{}", camera); }

void addSize(CdrWriter& message, const CameraModel& model) {
  message.add(static_cast<std::uint32_t>(model.height), static_cast<std::uint32_t>(model.width));
}

void addCamera(CdrWriter& message, const CameraModel& model) {
  addSize(message, model);
  message.add(model.distortion == DistortionModel::kEquidistant ? "equidistant" : "plumb_bob");
  message.add(model.coefficients);
  const double fx = model.fx, fy = model.fy, cx = model.cx, cy = model.cy;
  message.add(fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0);                 // K
  message.add(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);             // R
  message.add(fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0);  // P
  message.add(0U, 0U, 0U, 0U, 0U, 0U, std::uint8_t{0});  // binning, region of interest
}

class McapWriter : public RecordingWriter {
 public:
  McapWriter(const std::filesystem::path& file, const Rig& rig)
      : file_(file),
        output_(file_.temporary(), file_.path()),
        mcap_(topicsOf(rig), [this](std::uint64_t, const std::string& bytes) { write(bytes); }),
        rig_(rig),
        next_sequence_(rig.cameras.size()) {
    mcap_.begin();
  }

  void addEvents(std::size_t camera, const std::vector<Event>& events) override {
    constexpr std::ptrdiff_t kMaxEvents = 100'000;  // 800 kB
    constexpr std::int64_t kMaxSpanNs = std::numeric_limits<std::uint32_t>::max();
    const Event* begin = events.data();
    const Event* const end = begin + events.size();
    while (begin != end) {
      const Event* const most = end - begin > kMaxEvents ? begin + kMaxEvents : end;
      const Event* const last = std::find_if(
          begin, most, [&](const Event& event) { return event.t_ns - begin->t_ns > kMaxSpanNs; });
      addPacket(camera, begin, last);
      begin = last;
    }
  }

  void addPose(const StampedPose& pose) override {
    CdrWriter message = messageAt(pose.t_ns, "world");
    for (const double value : pose.T_world_rig.translation) message.add(value);
    for (const double value : pose.T_world_rig.rotation.coeffs()) message.add(value);  // x y z w
    addMessage(kPoseChannel, pose.t_ns, message.bytes());
  }

  void close() override {
    mcap_.end();
    output_.close();
    file_.replace();
  }

 private:
  static std::vector<McapTopic> topicsOf(const Rig& rig) {
    std::vector<McapTopic> topics = {
        {"geometry_msgs/msg/PoseStamped", ros_schema::kPoseStamped, "/pose"}};
    for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
      const std::string name = "/" + frameOf(camera);
      topics.push_back(
          {"event_camera_msgs/msg/EventPacket", ros_schema::kEventPacket, name + "/events"});
      topics.push_back(
          {"sensor_msgs/msg/CameraInfo", ros_schema::kCameraInfo, name + "/camera_info"});
    }
    return topics;
  }

  /// Returns a message that has only its header.
  CdrWriter messageAt(std::int64_t t_ns, std::string_view frame) const {
    const std::int64_t seconds = t_ns / kNanosecondsPerSecond;
    if (t_ns < 0 || seconds > std::numeric_limits<std::int32_t>::max()) {
      throw std::runtime_error(
          fmt::format("{}: a time of {} s: expected 0 to 2147483647, as ROS has it",
                      file_.path().string(), formatSeconds(t_ns)));
    }
    return CdrWriter().add(static_cast<std::uint32_t>(seconds),
                           static_cast<std::uint32_t>(t_ns % kNanosecondsPerSecond), frame);
  }

  void addPacket(std::size_t camera, const Event* begin, const Event* end) {
    const CameraModel& model = rig_.cameras.at(camera).model;
    const std::int64_t t_ns = begin->t_ns;
    CdrWriter packet = messageAt(t_ns, frameOf(camera));
    std::uint64_t& sequence = next_sequence_[camera];
    if (sequence == 0 && model.fx > 0) {  // calibrated
      CdrWriter info = packet;
      addCamera(info, model);
      addMessage(eventsChannel(camera) + 1, t_ns, info.bytes());
    }
    addSize(packet, model);
    packet.add(sequence++, static_cast<std::uint64_t>(t_ns), "mono", std::uint8_t{0},
               static_cast<std::uint32_t>((end - begin) * 8));
    for (const Event* event = begin; event != end; ++event) {
      constexpr std::uint16_t kMaxRow = 0x7fff;
      if (event->y > kMaxRow) {
        throw std::runtime_error(fmt::format("{}: y = {}: expected at most {} in encoding mono",
                                             file_.path().string(), event->y, kMaxRow));
      }
      appendLittleEndian(packet.bytes(), static_cast<std::uint64_t>(event->t_ns - t_ns) |
                                             std::uint64_t{event->x} << 32 |
                                             std::uint64_t{event->y} << 48 |
                                             static_cast<std::uint64_t>(event->polarity) << 63);
    }
    addMessage(eventsChannel(camera), t_ns, packet.bytes());
  }

  void addMessage(int channel, std::int64_t t_ns, const std::string& data) {
    mcap_.add(channel, static_cast<std::uint64_t>(t_ns), data);
    if (mcap_.pendingBytes() >= kMcapChunkBytes) mcap_.finishChunk();
  }

  void write(const std::string& bytes) {
    output_.stream().write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    output_.requireWritten();
  }

  AtomicFile file_;
  OutputFile output_;
  McapFile mcap_;
  Rig rig_;
  std::vector<std::uint64_t> next_sequence_;  // per camera
};

}  // namespace

std::unique_ptr<RecordingWriter> openMcapWriter(const std::filesystem::path& file, const Rig& rig) {
  return std::make_unique<McapWriter>(file, rig);
}

}  // namespace efm
