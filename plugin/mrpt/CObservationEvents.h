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

/// A packet of events of one camera of the rig, with the camera's calibration and pose: a rawlog
/// needs no calibration file. By convention `sensorLabel` is "cam0", "cam1", …
///
/// Event times are exact, in integer nanoseconds of the recording's own clock. `timestamp` is the
/// packet's first time, rounded to MRPT's tick. A stored packet has about 3 bytes per event and a
/// checksum: reading a damaged packet is an error.
///
/// A recording announces its rig if it begins with an empty packet of each camera, which covers the
/// camera until exactly its first event. Then nobody waits for further cameras.
class CObservationEvents : public mrpt::obs::CObservation, public mrpt::opengl::Visualizable {
  DEFINE_SERIALIZABLE(CObservationEvents, efm)

 public:
  int camera_index = 0;              ///< In the rig, 0 to 65,535.
  CameraModel camera;                ///< Calibration, the same in all packets of a camera.
  mrpt::poses::CPose3D camera_pose;  ///< T_rig_cam (MRPT's robot is the rig).
  std::int64_t time_offset_ns = 0;   ///< Added to the stamps: t = t_event + offset.
  std::vector<Event> events;         ///< In time order.
  /// All events of the camera before this time are in this packet or in earlier ones. So an empty
  /// packet with this time says that there was no event.
  std::optional<std::int64_t> covered_until_ns;
  /// How the events are stored. Zstandard is for rawlogs that are not compressed themselves.
  EventCompression compression = EventCompression::kNone;

  void getSensorPose(mrpt::poses::CPose3D& out_pose) const override { out_pose = camera_pose; }
  void setSensorPose(const mrpt::poses::CPose3D& pose) override { camera_pose = pose; }
  void getDescriptionAsText(std::ostream& stream) const override;
  /// Draws the packet at its camera's pose on the rig, as RawLogViewer shows it: the axes of the
  /// camera, its view frustum up to the image plane at z = kDrawnPlaneM, and a point on this plane
  /// for each event: ON red, OFF blue. The image is not undistorted.
  void getVisualizationInto(mrpt::opengl::CSetOfObjects& out) const override;

  /// For `rawlog-edit --export-txt`, which writes a line per packet: the number of events, then
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

/// While it lives, this thread reads the events of one camera's packets alone: other packets have
/// none. To decode the events takes most of the time of reading.
class ReadEventsOf {
 public:
  /// @param camera its index; below 0: no camera's.
  explicit ReadEventsOf(int camera);
  ~ReadEventsOf();
  ReadEventsOf(const ReadEventsOf&) = delete;
  ReadEventsOf& operator=(const ReadEventsOf&) = delete;
};

/// The maximum number of drawn events of a packet. Of more events, an even selection is drawn.
inline constexpr std::size_t kMaxDrawnEvents = 50'000;
/// The distance of the drawn image plane, for a viewer whose first view spans some twenty metres.
inline constexpr double kDrawnPlaneM = 3;

}  // namespace efm
