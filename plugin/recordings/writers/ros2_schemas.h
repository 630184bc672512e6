// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace efm {

/// The definitions of the ROS 2 messages that are written, with those of the types inside them, as
/// MCAP has them (schema encoding ros2msg).

#define EFM_RULE \
  "================================================================================\n"
#define EFM_HEADER                                                                  \
  EFM_RULE                                                                          \
  "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" EFM_RULE \
  "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"

inline constexpr const char* kEventPacketSchema =
    "std_msgs/Header header\nuint32 height\nuint32 width\nuint64 seq\nuint64 time_base\n"
    "string encoding\nbool is_bigendian\nuint8[] events\n" EFM_HEADER;

inline constexpr const char* kPoseStampedSchema =
    "std_msgs/Header header\ngeometry_msgs/Pose pose\n" EFM_HEADER EFM_RULE
    "MSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion "
    "orientation\n" EFM_RULE "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n" EFM_RULE
    "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";

inline constexpr const char* kCameraInfoSchema =
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n"
    "float64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\n"
    "sensor_msgs/RegionOfInterest roi\n" EFM_HEADER EFM_RULE
    "MSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\n"
    "uint32 width\nbool do_rectify\n";

#undef EFM_HEADER
#undef EFM_RULE

}  // namespace efm
