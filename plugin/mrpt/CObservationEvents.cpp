// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/CObservationEvents.h"

#include <fmt/format.h>
#include <mrpt/opengl/CPointCloudColoured.h>
#include <mrpt/opengl/CSetOfLines.h>
#include <mrpt/opengl/CSetOfObjects.h>
#include <mrpt/opengl/stock_objects.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/archiveFrom_std_vector.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <ostream>
#include <stdexcept>

#include "mapping/geometry/timestamp.h"
#include "plugin/mrpt/pose_observation.h"

IMPLEMENTS_SERIALIZABLE(CObservationEvents, CObservation, efm)

namespace efm {
namespace {

using mrpt::serialization::CArchive;

/// The camera that `ReadEventsOf` selects.
thread_local std::optional<int> read_camera;

/// The maximum size of a packet. MRPT's archives in memory count bytes with an int.
constexpr std::size_t kMaxContentBytes = std::size_t{1} << 30;

std::uint32_t checksumOf(const std::vector<std::uint8_t>& bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, bytes.data(), bytes.size()));
}

void writeCamera(CArchive& out, const CameraModel& camera) {
  out.WriteAs<std::int32_t>(camera.width);
  out.WriteAs<std::int32_t>(camera.height);
  out << camera.fx << camera.fy << camera.cx << camera.cy;
  out << std::string(nameOf(camera.distortion)) << camera.coefficients;
}

CameraModel readCamera(CArchive& in) {
  CameraModel camera;
  camera.width = in.ReadAs<std::int32_t>();
  camera.height = in.ReadAs<std::int32_t>();
  in >> camera.fx >> camera.fy >> camera.cx >> camera.cy;
  camera.distortion = fromName<DistortionModel>(in.ReadAs<std::string>());
  in >> camera.coefficients;
  return camera;
}

/// Reads `size` bytes in pieces: a wrong size must not reserve all memory.
std::vector<std::uint8_t> readBytes(CArchive& in, std::size_t size) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  std::vector<std::uint8_t> bytes;
  while (bytes.size() < size) {
    const std::size_t piece = std::min(kPiece, size - bytes.size());
    bytes.resize(bytes.size() + piece);
    // MRPT does not treat a short read as an error.
    if (in.ReadBuffer(bytes.data() + bytes.size() - piece, piece) != piece) {
      throw std::runtime_error("it ends too early");
    }
  }
  return bytes;
}

}  // namespace

std::uint8_t CObservationEvents::serializeGetVersion() const { return 1; }

void CObservationEvents::serializeTo(CArchive& out) const {
  std::vector<std::uint8_t> content;
  auto archive = mrpt::serialization::archiveFrom(content);
  writeContent(archive);
  if (content.size() > kMaxContentBytes) {
    throw std::length_error(
        fmt::format("a packet of {} events is too large: expected at most 1 GiB", events.size()));
  }
  out.WriteAs<std::uint32_t>(content.size());
  out << checksumOf(content);
  out.WriteBuffer(content.data(), content.size());
}

void CObservationEvents::serializeFrom(CArchive& in, std::uint8_t version) {
  if (version > 1) {
    throw std::runtime_error(
        fmt::format("events of version {}: this program reads versions 0 and 1", version));
  }
  try {
    const auto size = in.ReadAs<std::uint32_t>();
    const auto checksum = in.ReadAs<std::uint32_t>();
    if (size > kMaxContentBytes) throw std::runtime_error("a size that cannot be");
    const std::vector<std::uint8_t> content = readBytes(in, size);
    if (checksumOf(content) != checksum) throw std::runtime_error("its checksum is wrong");
    auto archive = mrpt::serialization::archiveFrom(content);
    readContent(archive, version);
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string("a packet of events is damaged: ") + error.what());
  }
}

void CObservationEvents::writeContent(CArchive& out) const {
  out << sensorLabel << timestamp;
  out.WriteAs<std::int32_t>(camera_index);
  writeCamera(out, camera);
  out << camera_pose << time_offset_ns << covered_until_ns.has_value()
      << covered_until_ns.value_or(0);
  const std::vector<std::uint8_t> bytes = encodeEvents(events, compression);
  out.WriteAs<std::uint32_t>(events.size());
  out << bytes;
}

void CObservationEvents::readContent(CArchive& in, std::uint8_t version) {
  in >> sensorLabel >> timestamp;
  camera_index = in.ReadAs<std::int32_t>();
  camera = readCamera(in);
  bool covers = false;
  std::int64_t until_ns = 0;
  in >> camera_pose;
  time_offset_ns = version == 0 ? 0 : in.ReadAs<std::int64_t>();
  in >> covers >> until_ns;
  covered_until_ns = covers ? std::optional(until_ns) : std::nullopt;
  const auto count = in.ReadAs<std::uint32_t>();
  std::vector<std::uint8_t> bytes;
  in >> bytes;
  if (read_camera.value_or(camera_index) == camera_index) events = decodeEvents(bytes, count);
}

ReadEventsOf::ReadEventsOf(int camera) { read_camera = camera; }
ReadEventsOf::~ReadEventsOf() { read_camera.reset(); }

void CObservationEvents::getDescriptionAsText(std::ostream& stream) const {
  mrpt::obs::CObservation::getDescriptionAsText(stream);
  stream << "Events of camera " << camera_index << ": " << events.size() << "\n";
  if (!events.empty()) {
    std::size_t brighter = 0;
    for (const Event& event : events) brighter += event.polarity ? 1 : 0;
    stream << "From " << formatSeconds(events.front().t_ns) << " s to "
           << formatSeconds(events.back().t_ns) << " s, " << brighter << " of them brighter\n";
  }
  if (covered_until_ns && *covered_until_ns < kEndOfTimeNs) {
    stream << "Everything before " << formatSeconds(*covered_until_ns) << " s is here by now\n";
  } else if (covered_until_ns) {
    stream << "The last packet of its camera\n";
  }
  stream << "Sensor: " << camera.width << "x" << camera.height << " pixels, fx " << camera.fx
         << " fy " << camera.fy << " cx " << camera.cx << " cy " << camera.cy << ", distortion "
         << nameOf(camera.distortion);
  for (const double coefficient : camera.coefficients) stream << " " << coefficient;
  stream << "\nPose on the rig: " << camera_pose.asString() << "\n";
}

std::string CObservationEvents::exportTxtHeader() const {
  return "NUM_EVENTS [TIME_S X Y POLARITY] x NUM_EVENTS";
}

std::string CObservationEvents::exportTxtDataRow() const {
  std::string row = std::to_string(events.size());
  for (const Event& event : events) {
    row += fmt::format(" {} {} {} {}", formatSeconds(event.t_ns), event.x, event.y,
                       event.polarity ? 1 : 0);
  }
  return row;
}

namespace {

using mrpt::math::TPoint3D;

/// A camera without a calibration is drawn with a field of view of 53 degrees.
CameraModel drawnModel(CameraModel camera) {
  if (camera.fx > 0) return camera;
  camera.fx = camera.fy = camera.width;
  camera.cx = 0.5 * (camera.width - 1);
  camera.cy = 0.5 * (camera.height - 1);
  return camera;
}

/// Returns the position of a pixel on the drawn image plane, in the camera's frame.
TPoint3D onImagePlane(const CameraModel& camera, double x, double y) {
  return {(x - camera.cx) / camera.fx * kDrawnPlaneM, (y - camera.cy) / camera.fy * kDrawnPlaneM,
          kDrawnPlaneM};
}

mrpt::opengl::CRenderizable::Ptr frustumOf(const CameraModel& camera) {
  const double right = camera.width - 0.5;  // integer coordinates are pixel centres
  const double bottom = camera.height - 0.5;
  const std::array<TPoint3D, 4> corners = {
      onImagePlane(camera, -0.5, -0.5), onImagePlane(camera, right, -0.5),
      onImagePlane(camera, right, bottom), onImagePlane(camera, -0.5, bottom)};
  auto lines = mrpt::opengl::CSetOfLines::Create();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    lines->appendLine(TPoint3D(0, 0, 0), corners[i]);
    lines->appendLine(corners[i], corners[(i + 1) % corners.size()]);
  }
  lines->setColor_u8(200, 200, 200);
  return lines;
}

mrpt::opengl::CRenderizable::Ptr pointsOf(const CObservationEvents& packet,
                                          const CameraModel& model) {
  const std::size_t count = packet.events.size();
  const std::size_t drawn = std::min(count, kMaxDrawnEvents);
  auto points = mrpt::opengl::CPointCloudColoured::Create();
  points->setPointSize(2);
  points->reserve(drawn);
  for (std::size_t i = 0; i < drawn; ++i) {
    const Event& event = packet.events[i * count / drawn];
    const TPoint3D p_cam = onImagePlane(model, event.x, event.y);
    const std::uint8_t red = event.polarity ? 220 : 0;
    const std::uint8_t blue = event.polarity ? 0 : 220;
    points->insertPoint({static_cast<float>(p_cam.x), static_cast<float>(p_cam.y),
                         static_cast<float>(p_cam.z), red, 0, blue});
  }
  return points;
}

}  // namespace

RigCamera calibrationOf(const CObservationEvents& packet) {
  return {packet.camera, roundedPose(rigidFrom(packet.camera_pose)), packet.time_offset_ns};
}

void CObservationEvents::getVisualizationInto(mrpt::opengl::CSetOfObjects& out) const {
  auto drawn = mrpt::opengl::CSetOfObjects::Create();
  drawn->setPose(camera_pose);
  drawn->insert(mrpt::opengl::stock_objects::CornerXYZSimple(0.5F, 2.0F));
  const CameraModel model = drawnModel(camera);
  drawn->insert(frustumOf(model));
  drawn->insert(pointsOf(*this, model));
  out.insert(drawn);
}

}  // namespace efm
