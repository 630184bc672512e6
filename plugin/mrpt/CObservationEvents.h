// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>
#include <mrpt/opengl/Visualizable.h>
#include <mrpt/poses/CPose3D.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/camera.h"

// Visualizable's destructor is not virtual; nobody deletes an observation as one.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wnon-virtual-dtor"

namespace efm {

/// A packet of events of one camera of the rig, with that camera's calibration and pose, so that a
/// rawlog needs nothing beside it. By convention `sensorLabel` is "cam0", "cam1", …
///
/// Event times are integer nanoseconds of the recording's own clock, exact; `timestamp` is the
/// packet's first time rounded to MRPT's tick. Stored at about 3 bytes per event, under a checksum:
/// a packet that was damaged is an error when it is read, not other events.
class CObservationEvents : public mrpt::obs::CObservation, public mrpt::opengl::Visualizable {
  DEFINE_SERIALIZABLE(CObservationEvents, efm)

 public:
  int camera_index = 0;              ///< In the rig, 0 to 65,535.
  CameraModel camera;                ///< Calibration: the same in all packets of a camera.
  mrpt::poses::CPose3D camera_pose;  ///< T_rig_cam (MRPT's robot is the rig).
  std::vector<Event> events;         ///< In time order.
  /// Where given, everything that the camera saw before this time is in this packet or was in one
  /// before it: so an empty packet says that there was nothing.
  std::optional<std::int64_t> covered_until_ns;

  void getSensorPose(mrpt::poses::CPose3D& out_pose) const override { out_pose = camera_pose; }
  void setSensorPose(const mrpt::poses::CPose3D& pose) override { camera_pose = pose; }
  void getDescriptionAsText(std::ostream& stream) const override;
  /// As plugin/event_drawing.h says; what RawLogViewer shows in its 3D tab.
  void getVisualizationInto(mrpt::opengl::CSetOfObjects& out) const override;

  /// For `rawlog-edit --export-txt`, which writes a line per packet: the number of events, then
  /// four columns per event: its time in seconds of the recording's clock, x, y and polarity (0 or
  /// 1).
  bool exportTxtSupported() const override { return true; }
  std::string exportTxtHeader() const override;
  std::string exportTxtDataRow() const override;

 private:
  void writeContent(mrpt::serialization::CArchive& out) const;
  void readContent(mrpt::serialization::CArchive& in);
};

}  // namespace efm

#pragma GCC diagnostic pop
