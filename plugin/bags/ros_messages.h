// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/camera.h"
#include "mapping/geometry/trajectory.h"
#include "plugin/bags/bag_source.h"
#include "plugin/calibration/calibration_file.h"

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
  std::uint64_t time_base = 0;  ///< ns; of the encoding `mono` only.
  std::string_view encoding;    ///< "evt3", "mono", …; refers to the message's bytes.
  const std::uint8_t* data = nullptr;
  std::size_t data_size = 0;  ///< bytes
};
EventPacketMessage decodeEventPacket(const BagMessage& message);

/// Appends the events of encoding `mono`: 8 bytes an event, little-endian; bit 63 the polarity, 62
/// to 48 the row, 47 to 32 the column, 31 to 0 the time after time_base (ns).
/// @throws std::runtime_error where the size is no multiple of 8, or a time has no place in 64
/// bits.
void decodeMonoEvents(const EventPacketMessage& packet, std::vector<Event>& events);

/// T_world_body of any type that `hasPoses`: the pose itself, or that of the child frame.
/// @throws std::runtime_error also for values that are not finite and for a quaternion that is not
/// of length 1 within 1 %.
StampedPose decodePose(const BagMessage& message, RosType type);

/// Distortion models: plumb_bob (radtan), equidistant or fisheye (the same); none without
/// coefficients. fx = 0 if the camera is not calibrated.
/// @throws std::runtime_error also for another model, unless its coefficients are zero.
CameraModel decodeCameraInfo(const BagMessage& message);

}  // namespace efm
