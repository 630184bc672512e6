// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/bags/bag_source.h"
#include "plugin/recordings/calibration/calibration_file.h"

namespace efm {

/// These functions decode messages in both serialisations: ROS 1 (little-endian, packed) and ROS 2
/// (CDR: a header of 4 bytes with the byte order; after it, values at multiples of their size).
/// Times are exact: they are the seconds and nanoseconds of the message, not of the bag. Errors are
/// a std::runtime_error without the file's name: the caller knows the position.

enum class RosType {
  kOther,
  kEventArray,   ///< dvs_msgs/EventArray, prophesee_event_msgs/EventArray
  kEventPacket,  ///< event_camera_msgs/EventPacket and its former name event_array_msgs/EventArray
  kPose,         ///< geometry_msgs/PoseStamped
  kPoseWithCovariance,  ///< geometry_msgs/PoseWithCovarianceStamped
  kTransform,           ///< geometry_msgs/TransformStamped
  kOdometry,            ///< nav_msgs/Odometry
  kPath,                ///< nav_msgs/Path
  kTransforms,          ///< tf2_msgs/TFMessage and its former name tf/tfMessage
  kCameraInfo,          ///< sensor_msgs/CameraInfo
};

/// @param type name of the type, as in BagTopic.
RosType rosTypeOf(std::string_view type);
bool hasEvents(RosType type);
/// Transforms between any frames are no poses of a body.
bool hasPoses(RosType type);

/// Appends the events of an EventArray: if it is damaged, the events before the damage.
/// @return the sensor's size; 0x0 if the message does not have it.
CameraSize decodeEventArray(const BagMessage& message, std::vector<Event>& events);

struct EventPacketMessage {
  std::int64_t stamp_ns = 0;  ///< Time at which the host received the first bytes.
  CameraSize size;
  std::uint64_t sequence = 0;   ///< Number of the packet; a gap is a loss.
  std::uint64_t time_base = 0;  ///< ns; unused by the EVT encodings.
  std::string_view encoding;    ///< "evt3", "mono", …; refers to the message's bytes.
  const std::uint8_t* data = nullptr;
  std::size_t data_size = 0;  ///< bytes
};
EventPacketMessage decodeEventPacket(const BagMessage& message);

/// The next functions append the events of a packet in little-endian words. They keep no state
/// between packets.
/// @throws std::runtime_error at an incomplete or wrong word, after appending the events before it;
/// and if time_base is not a time.

/// Encoding `mono`: 8 bytes per event. Bit 63 is the polarity, bits 62 to 48 the row, 47 to 32 the
/// column, 31 to 0 the time after time_base (ns).
void decodeMonoEvents(const EventPacketMessage& packet, std::vector<Event>& events);

/// Encoding `libcaer`: 8 bytes per event. Bits 63 to 32 are the time after time_base (µs, 0 to 2^31
/// - 1), 31 to 17 the column, 16 to 2 the row, 1 the polarity. If the time falls by more than half
/// of its range, it has wrapped: 2^31 µs are added from there on. A smaller fall is a late event.
void decodeLibcaerEvents(const EventPacketMessage& packet, std::vector<Event>& events);

/// Encoding `libcaer_cmp`: words of 16 bits with a code in the upper 4 bits. Words change the time
/// after time_base (µs; 12 upper and 12 lower bits), the column, and the first row and polarity of
/// a vector. An event is a row with its polarity, or a bit of a vector. A vector has 8 rows of a
/// column; the next vector begins after it. All values are 0 at the beginning of a packet.
void decodeLibcaerCmpEvents(const EventPacketMessage& packet, std::vector<Event>& events);

/// The frames that a message names, without a slash at their beginning; empty: none.
struct MessageFrames {
  std::string frame;  ///< Frame of the header. Some programs write a counter.
  std::string child;  ///< Frame whose pose a transform or odometry gives.
};
/// @param type any type whose messages begin with a header.
MessageFrames framesOf(const BagMessage& message, RosType type);

/// Decodes T_world_body from any type that `hasPoses`: the pose itself, the child frame's pose, or
/// all poses of a path.
/// @throws std::runtime_error also for values that are not finite and for a quaternion that is not
/// of length 1 within 1 %.
std::vector<StampedPose> decodePoses(const BagMessage& message, RosType type);

struct PathPose {
  std::int64_t t_ns;
  PoseNumbers numbers;  ///< May be wrong.
};
/// Decodes the poses of a nav_msgs/Path. @param stamp_ns receives the time of its header.
std::vector<PathPose> decodePath(const BagMessage& message, std::int64_t& stamp_ns);

/// A transform T_parent_child between two frames, whose names have no slash at their beginning. Its
/// numbers may be wrong.
struct FrameTransform {
  std::string parent, child;
  std::int64_t t_ns;
  PoseNumbers numbers;
};
std::vector<FrameTransform> decodeTransforms(const BagMessage& message);

/// Decodes a camera. Distortion models: plumb_bob (radtan), equidistant or fisheye (the same
/// model); none if there are no coefficients. fx = 0 if the camera is not calibrated.
/// @throws std::runtime_error also for another model, unless its coefficients are zero.
CameraModel decodeCameraInfo(const BagMessage& message);

}  // namespace efm
