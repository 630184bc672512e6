// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/bags/bag_source.h"
#include "plugin/recordings/calibration/calibration_file.h"

namespace efm {

/// Decodes messages from their bytes, the same for both serialisations: ROS 1 (little-endian,
/// packed) and ROS 2 (CDR: a header of 4 bytes with the byte order; values at multiples of their
/// size from its end). Times are exact: seconds and nanoseconds of the message, not those of the
/// bag. Errors are a std::runtime_error without the file's name: the caller knows the position.

enum class RosType {
  kOther,
  kEventArray,   ///< dvs_msgs/EventArray, prophesee_event_msgs/EventArray
  kEventPacket,  ///< event_camera_msgs/EventPacket and its former name event_array_msgs/EventArray
  kPose,         ///< geometry_msgs/PoseStamped
  kPoseWithCovariance,  ///< geometry_msgs/PoseWithCovarianceStamped
  kTransform,           ///< geometry_msgs/TransformStamped
  kOdometry,            ///< nav_msgs/Odometry
  kCameraInfo,          ///< sensor_msgs/CameraInfo
};

/// @param type as in BagTopic.
RosType rosTypeOf(std::string_view type);
bool hasEvents(RosType type);
bool hasPoses(RosType type);

/// Appends the events of an EventArray. If the message is damaged, those before the damage.
/// @return the sensor's size; 0x0 where the message does not say it.
CameraSize decodeEventArray(const BagMessage& message, std::vector<Event>& events);

struct EventPacketMessage {
  std::int64_t stamp_ns = 0;  ///< When the host received the first bytes.
  CameraSize size;
  std::uint64_t sequence = 0;   ///< A gap is a loss.
  std::uint64_t time_base = 0;  ///< ns; not of the EVT encodings.
  std::string_view encoding;    ///< "evt3", "mono", …; refers to the message's bytes.
  const std::uint8_t* data = nullptr;
  std::size_t data_size = 0;  ///< bytes
};
EventPacketMessage decodeEventPacket(const BagMessage& message);

/// These append the events of a packet in an encoding of little-endian words. Nothing is kept from
/// one packet to the next.
/// @throws std::runtime_error at an incomplete or wrong word, after the events before it; and where
/// time_base is not a time.

/// Encoding `mono`: 8 bytes an event; bit 63 the polarity, 62 to 48 the row, 47 to 32 the column,
/// 31 to 0 the time after time_base (ns).
void decodeMonoEvents(const EventPacketMessage& packet, std::vector<Event>& events);

/// Encoding `libcaer`: 8 bytes an event; bits 63 to 32 the time after time_base (µs, 0 to 2^31 -
/// 1), 31 to 17 the column, 16 to 2 the row, 1 the polarity. Where the time falls by more than half
/// of its range it has wrapped: 2^31 µs are added from there on. A smaller fall is an event that
/// comes late.
void decodeLibcaerEvents(const EventPacketMessage& packet, std::vector<Event>& events);

/// Encoding `libcaer_cmp`: words of 16 bits, the code in the upper 4. The words change the time
/// after time_base (µs; 12 upper and 12 lower bits), the column, and the row and polarity where a
/// vector begins. An event is a row with its polarity, or a bit of a vector: 8 rows of a column,
/// after which the next vector begins. All values are 0 at the beginning of a packet.
void decodeLibcaerCmpEvents(const EventPacketMessage& packet, std::vector<Event>& events);

/// T_world_body of any type that `hasPoses`: the pose itself, or that of the child frame.
/// @throws std::runtime_error also for values that are not finite and for a quaternion that is not
/// of length 1 within 1 %.
StampedPose decodePose(const BagMessage& message, RosType type);

/// Distortion models: plumb_bob (radtan), equidistant or fisheye (the same); none without
/// coefficients. fx = 0 if the camera is not calibrated.
/// @throws std::runtime_error also for another model, unless its coefficients are zero.
CameraModel decodeCameraInfo(const BagMessage& message);

}  // namespace efm
