// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/event_drawing.h"

#include <mrpt/opengl/CPointCloudColoured.h>
#include <mrpt/opengl/CSetOfLines.h>
#include <mrpt/opengl/CSetOfObjects.h>
#include <mrpt/opengl/stock_objects.h>

#include <algorithm>
#include <array>

#include "plugin/mrpt/CObservationEvents.h"

namespace efm {
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

/// The position of a pixel on the drawn image plane, in the camera's frame.
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

void drawEvents(const CObservationEvents& packet, mrpt::opengl::CSetOfObjects& out) {
  auto camera = mrpt::opengl::CSetOfObjects::Create();
  camera->setPose(packet.camera_pose);
  camera->insert(mrpt::opengl::stock_objects::CornerXYZSimple(0.5F, 2.0F));
  const CameraModel model = drawnModel(packet.camera);
  camera->insert(frustumOf(model));
  camera->insert(pointsOf(packet, model));
  out.insert(camera);
}

}  // namespace efm
