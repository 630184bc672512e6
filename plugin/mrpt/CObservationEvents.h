// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>
#include <mrpt/opengl/Visualizable.h>
#include <mrpt/poses/CPose3D.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/rig.h"
#include "plugin/mrpt/event_encoding.h"

// Visualizable's destructor is not virtual. Nobody deletes an observation through it.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wnon-virtual-dtor"

namespace efm {

/// A packet of events of one camera of the rig. The packet has the camera's calibration and pose,
/// so a rawlog needs no calibration file. By convention `sensorLabel` is "cam0", "cam1", …
///
/// Event times are exact, in integer nanoseconds of the recording's own clock. `timestamp` is the
/// packet's first time, rounded to MRPT's tick. A stored packet has about 3 bytes per event and a
/// checksum: reading a damaged packet is an error.
///
/// A recording declares its rig if it begins with one empty packet per camera, complete until
/// exactly the camera's first event. Then the mapping does not wait for further cameras.
class CObservationEvents : public mrpt::obs::CObservation, public mrpt::opengl::Visualizable {
  DEFINE_SERIALIZABLE(CObservationEvents, efm)

 public:
  int camera_index = 0;              ///< Index in the rig, 0 to 65,535.
  CameraModel camera;                ///< Calibration, the same in all packets of a camera.
  mrpt::poses::CPose3D camera_pose;  ///< T_rig_cam (MRPT's robot is the rig).
  std::int64_t time_offset_ns = 0;   ///< Offset to add to the stamps: t = t_event + offset.
  std::vector<Event> events;         ///< Events in time order.
  /// The time until which the camera's events are complete: all events before this time are in this
  /// packet or in earlier packets. An empty packet with this time says that there was no event.
  std::optional<std::int64_t> covered_until_ns;
  /// Compression of the stored events. Zstandard is for rawlogs without their own compression.
  EventCompression compression = EventCompression::kNone;

  void getSensorPose(mrpt::poses::CPose3D& out_pose) const override { out_pose = camera_pose; }
  void setSensorPose(const mrpt::poses::CPose3D& pose) override { camera_pose = pose; }
  void getDescriptionAsText(std::ostream& stream) const override;
  /// Draws the packet at its camera's pose on the rig, as RawLogViewer shows it: the axes of the
  /// camera, its view frustum up to the image plane at z = kDrawnPlaneM, and a point on this plane
  /// for each event: ON red, OFF blue. The image is not undistorted.
  void getVisualizationInto(mrpt::opengl::CSetOfObjects& out) const override;

  /// Functions for `rawlog-edit --export-txt`. Its line per packet has the number of events, then
  /// four columns per event: time in seconds of the recording's clock, x, y, polarity (0 or 1).
  bool exportTxtSupported() const override { return true; }
  std::string exportTxtHeader() const override;
  std::string exportTxtDataRow() const override;

 private:
  void writeContent(mrpt::serialization::CArchive& out) const;
  void readContent(mrpt::serialization::CArchive& in, std::uint8_t version);
};

#pragma GCC diagnostic pop

RigCamera calibrationOf(const CObservationEvents& packet);

/// During the lifetime of this object, its thread reads the events of one camera only; packets of
/// other cameras get no events. Decoding the events takes most of the reading time.
class ReadEventsOf {
 public:
  /// @param camera index of the camera; below 0: no events of any camera.
  explicit ReadEventsOf(int camera);
  ~ReadEventsOf();
  ReadEventsOf(const ReadEventsOf&) = delete;
  ReadEventsOf& operator=(const ReadEventsOf&) = delete;
};

/// The maximum number of drawn events of a packet. More events are subsampled evenly.
inline constexpr std::size_t kMaxDrawnEvents = 50'000;
/// Distance of the drawn image plane, chosen for a viewer whose first view is about 20 m wide.
inline constexpr double kDrawnPlaneM = 3;

}  // namespace efm
