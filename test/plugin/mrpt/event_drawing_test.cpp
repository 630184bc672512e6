// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/event_drawing.h"

#include <gtest/gtest.h>
#include <mrpt/img/CImage.h>
#include <mrpt/opengl/CFBORender.h>
#include <mrpt/opengl/COpenGLScene.h>
#include <mrpt/opengl/CPointCloudColoured.h>
#include <mrpt/opengl/CSetOfObjects.h>

#include <cstdlib>
#include <optional>

#include "plugin/mrpt/CObservationEvents.h"

namespace efm {
namespace {

using mrpt::opengl::CPointCloudColoured;
using mrpt::opengl::CSetOfObjects;

/// 240 x 180 pixels, f = 200: a line of brighter events on the left, of darker ones on the right.
CObservationEvents twoLines() {
  CObservationEvents packet;
  packet.camera = {240, 180, 200, 200, 119.5, 89.5, DistortionModel::kNone, {}};
  for (std::uint16_t y = 20; y < 160; ++y) {
    packet.events.push_back({1000 * y, 40, y, true});
    packet.events.push_back({1000 * y, 200, y, false});
  }
  return packet;
}

CPointCloudColoured::Ptr pointsOf(const CObservationEvents& packet) {
  const auto camera = packet.getVisualization()->getByClass<CSetOfObjects>();
  return camera->getByClass<CPointCloudColoured>();
}

TEST(EventDrawing, AnEventIsAPointOnTheImagePlaneInTheColourOfItsPolarity) {
  const CObservationEvents packet = twoLines();
  const auto points = pointsOf(packet);
  ASSERT_EQ(points->size(), packet.events.size());
  EXPECT_NEAR(points->getPoint3Df(0).x, (40 - 119.5) / 200 * kDrawnPlaneM, 1e-6);
  EXPECT_NEAR(points->getPoint3Df(0).y, (20 - 89.5) / 200 * kDrawnPlaneM, 1e-6);
  EXPECT_EQ(points->getPoint3Df(0).z, kDrawnPlaneM);
  EXPECT_GT(points->getPointColor(0).R, 200);
  EXPECT_EQ(points->getPointColor(0).B, 0);
  EXPECT_GT(points->getPointColor(1).B, 200);
}

TEST(EventDrawing, ACameraWithoutACalibrationIsDrawnWithTheFocalLengthOfItsWidth) {
  CObservationEvents packet = twoLines();
  packet.camera = {240, 180, 0, 0, 0, 0, DistortionModel::kNone, {}};
  const auto points = pointsOf(packet);
  EXPECT_NEAR(points->getPoint3Df(0).x, (40 - 119.5) / 240 * kDrawnPlaneM, 1e-6);
  EXPECT_NEAR(points->getPoint3Df(0).y, (20 - 89.5) / 240 * kDrawnPlaneM, 1e-6);
}

TEST(EventDrawing, IsDrawnAtTheCamerasPoseOnTheRig) {
  CObservationEvents packet = twoLines();
  packet.camera_pose = mrpt::poses::CPose3D(1, 2, 3, 0.1, 0.2, 0.3);
  const auto camera = packet.getVisualization()->getByClass<CSetOfObjects>();
  EXPECT_LT(mrpt::poses::CPose3D(camera->getPose()).distanceTo(packet.camera_pose), 1e-6);
  EXPECT_NEAR(camera->getPose().yaw, 0.1, 1e-6);
}

TEST(EventDrawing, OfALargePacketAnEvenSelectionOfEventsIsDrawn) {
  CObservationEvents packet = twoLines();
  packet.events.assign(3 * kMaxDrawnEvents, {0, 10, 10, true});
  packet.events.back() = packet.events[packet.events.size() - 3] = {0, 20, 20, false};
  const auto points = pointsOf(packet);
  EXPECT_EQ(points->size(), kMaxDrawnEvents);
  EXPECT_GT(points->getPointColor(points->size() - 1).B, 200) << "reaches to its end";
}

TEST(EventDrawing, OfAnEmptyPacketTheCameraIsDrawn) {
  CObservationEvents packet = twoLines();
  packet.events.clear();
  EXPECT_EQ(pointsOf(packet)->size(), 0U);
  EXPECT_GE(packet.getVisualization()->getByClass<CSetOfObjects>()->size(), 3U);
}

/// The scene as the camera sees it.
mrpt::img::CImage rendered(const CObservationEvents& packet) {
  mrpt::opengl::COpenGLScene scene;
  scene.insert(packet.getVisualization());
  mrpt::opengl::CFBORender renderer(480, 360);
  mrpt::opengl::CCamera camera;
  camera.set6DOFMode(true);
  camera.setPose(mrpt::poses::CPose3D(0, 0, -0.2, 0, 0, 0));
  camera.setProjectiveFOVdeg(60);
  renderer.setCamera(scene, camera);
  mrpt::img::CImage image(480, 360, mrpt::img::CH_RGB);
  renderer.render_RGB(scene, image);
  return image;
}

TEST(EventDrawing, OnEventsAreRedOnTheLeftAndOffEventsBlueOnTheRight) {
  std::optional<mrpt::img::CImage> image;
  try {
    image = rendered(twoLines());
  } catch (const std::exception& error) {
    GTEST_SKIP() << "cannot render off-screen here: " << error.what();
  }
  if (const char* file = std::getenv("EFM_SAVE_DRAWING")) image->saveToFile(file);
  int red_left = 0;
  int blue_right = 0;
  int elsewhere = 0;
  for (int y = 0; y < 360; ++y) {
    for (int x = 0; x < 480; ++x) {
      const int blue = image->at<std::uint8_t>(x, y, 0);
      const int green = image->at<std::uint8_t>(x, y, 1);
      const int red = image->at<std::uint8_t>(x, y, 2);
      if (std::abs(x - 240) < 60 || std::abs(y - 180) < 20) continue;  // the axes
      if (red > 150 && green < 60 && blue < 60) ++(x < 240 ? red_left : elsewhere);
      if (blue > 150 && green < 60 && red < 60) ++(x > 240 ? blue_right : elsewhere);
    }
  }
  EXPECT_GT(red_left, 100);
  EXPECT_GT(blue_right, 100);
  EXPECT_EQ(elsewhere, 0);
}

}  // namespace
}  // namespace efm
