// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/window/map_scene.h"

#include <fmt/format.h>
#include <mrpt/opengl/CFBORender.h>
#include <mrpt/opengl/CPointCloudColoured.h>
#include <mrpt/opengl/CSetOfLines.h>
#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "mapping/base/atomic_file.h"
#include "plugin/results/pictures/depth_picture.h"
#include "plugin/results/pictures/picture.h"

namespace efm {
namespace {

using mrpt::opengl::CPointCloudColoured;
using mrpt::opengl::CSetOfLines;

const mrpt::img::TColorf kBackground(0.07F, 0.08F, 0.10F, 1);
constexpr double kPicturesLeft = 0.76;  // fraction of the window's width
constexpr double kFieldOfViewDeg = 40;
constexpr double kElevationDeg = 15;
constexpr double kSwayDeg = 25;
constexpr double kSwayKeyframes = 48;  // keyframes in a period of the sway
constexpr double kFollow = 0.15;       // part of the way to the wanted view, per keyframe

Eigen::Vector3d axisOf(const StampedPose& pose, int axis) {
  return pose.T_world_rig.rotation * Eigen::Vector3d::Unit(axis);
}

/// Returns the value that has this fraction of all values below it.
double quantile(std::vector<double>& values, double fraction) {
  const auto at = values.begin() +
                  static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Returns 256 bright colours from blue to red.
cv::Mat3b heightColours() {
  cv::Mat1b levels(1, 256);
  for (int i = 0; i < 256; ++i) levels(i) = static_cast<uchar>(25 + i * 205 / 255);
  cv::Mat3b colours;
  cv::applyColorMap(levels, colours, cv::COLORMAP_TURBO);
  return colours;
}

template <typename Object>
Object& objectOf(mrpt::opengl::COpenGLScene& scene, const char* name) {
  return dynamic_cast<Object&>(*scene.getByName(name));
}

void addLine(CSetOfLines& lines, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  lines.appendLine(from.x(), from.y(), from.z(), to.x(), to.y(), to.z());
}

void addPicture(mrpt::opengl::COpenGLScene& scene, const char* name, double bottom) {
  auto viewport = scene.createViewport(name);
  viewport->setViewportPosition(kPicturesLeft, bottom, 1 - kPicturesLeft - 0.01, 0.4);
  viewport->setCustomBackgroundColor(kBackground);
}

void setPicture(mrpt::opengl::COpenGLScene& scene, const char* name, const cv::Mat& picture) {
  scene.getViewport(name)->setImageView(mrpt::img::CImage(picture, mrpt::img::DEEP_COPY));
}

namespace fs = std::filesystem;

constexpr unsigned kWidth = 1280;
constexpr unsigned kHeight = 720;

/// Returns whether a file is named frame_000001.png, or has the temporary name of such a file (a
/// killed run leaves such files).
bool isFrame(const fs::path& file) {
  const std::string name = file.filename().string();
  return name.size() >= 16 && name.compare(0, 6, "frame_") == 0 && file.extension() == ".png" &&
         std::all_of(name.begin() + 6, name.begin() + 12,
                     [](unsigned char c) { return std::isdigit(c) != 0; }) &&
         (name.size() == 16 || name.compare(12, 9, ".partial-") == 0);
}

/// @return the frames of an earlier run.
std::vector<fs::path> prepareFolder(const fs::path& folder, bool force) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw std::runtime_error(folder.string() + ": " + error.message());
  std::vector<fs::path> earlier;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (isFrame(entry.path())) {
      earlier.push_back(entry.path());
    } else if (!force) {
      throw std::runtime_error(folder.string() +
                               ": holds other files than frames: expected a new folder, an empty "
                               "one, one of earlier frames, or --force");
    }
  }
  return earlier;
}

class MapFrames : public MapWatcher {
 public:
  MapFrames(const std::filesystem::path& folder, bool force) : folder_(folder) {
    try {
      renderer_ = std::make_unique<mrpt::opengl::CFBORender>(kWidth, kHeight);
    } catch (const std::exception&) {
      throw std::runtime_error(
          "--record-frames: nothing can be rendered here: expected EGL and OpenGL, for instance "
          "the Debian packages libegl1 and libgl1-mesa-dri");
    }
    earlier_ = prepareFolder(folder, force);
  }

  bool due(bool is_last) override { return !is_last; }
  void show(WatchedMap snapshot) override {
    for (const fs::path& file : std::exchange(earlier_, {})) fs::remove(file);
    scene_.show(snapshot);
    const auto scene = scene_.scene();
    renderer_->setCamera(*scene, scene->getViewport()->getCamera());
    mrpt::img::CImage image;
    renderer_->render_RGB(*scene, image);
    writeAtomically(folder_ / fmt::format("frame_{:06}.png", ++frames_), [&](const fs::path& file) {
      if (!image.saveToFile(file.string())) throw std::runtime_error("it cannot be written");
    });
  }

 private:
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> earlier_;
  MapScene scene_;
  std::unique_ptr<mrpt::opengl::CFBORender> renderer_;
  int frames_ = 0;
};

}  // namespace

MapScene::MapScene() : scene_(mrpt::opengl::COpenGLScene::Create()) {
  auto main = scene_->getViewport();
  main->setCustomBackgroundColor(kBackground);
  main->setViewportPosition(0, 0, kPicturesLeft - 0.01, 1);
  auto cloud = CPointCloudColoured::Create();
  cloud->setName("cloud");
  cloud->setPointSize(2);
  scene_->insert(cloud);
  const auto add_lines = [&](const char* name, const mrpt::img::TColor& colour, float width) {
    auto lines = CSetOfLines::Create();
    lines->setName(name);
    lines->setColor_u8(colour);
    lines->setLineWidth(width);
    scene_->insert(lines);
  };
  add_lines("trajectory", {255, 255, 255, 255}, 2);
  add_lines("frustum", {255, 200, 60, 255}, 2);
  auto column = scene_->createViewport("column");  // behind the pictures: a window is grey there
  column->setViewportPosition(kPicturesLeft - 0.01, 0, 1.01 - kPicturesLeft, 1);
  column->setCustomBackgroundColor(kBackground);
  addPicture(*scene_, "depth", 0.52);
  addPicture(*scene_, "confidence", 0.06);
}

void MapScene::show(const WatchedMap& snapshot) {
  if (shown_ == 0) origin_world_ = snapshot.trajectory.front().T_world_rig.translation;
  R_scene_world_ =
      Eigen::Quaterniond::FromTwoVectors(upwardOf(snapshot.trajectory), Eigen::Vector3d::UnitZ())
          .toRotationMatrix();
  showPoints(snapshot);
  turnView(snapshot);
  showCameras(snapshot);
  showPictures(snapshot);
  ++shown_;
}

void MapScene::showPoints(const WatchedMap& snapshot) {
  static const cv::Mat3b kColours = heightColours();
  auto& cloud = objectOf<CPointCloudColoured>(*scene_, "cloud");
  const std::size_t step = 1 + (snapshot.points->size() / (kMaxPoints + 1));
  std::vector<Eigen::Vector3d> points;
  points.reserve(snapshot.points->size() / step + 1);
  for (std::size_t i = 0; i < snapshot.points->size(); i += step) {
    points.push_back(inScene(positionIn(*snapshot.points, (*snapshot.points)[i])));
  }
  Eigen::Vector3d low = inScene(snapshot.trajectory.back().T_world_rig.translation), high = low;
  for (int axis = 0; axis < 3 && !points.empty(); ++axis) {
    std::vector<double> values;
    values.reserve(points.size());
    for (const auto& point : points) values.push_back(point[axis]);
    low[axis] = quantile(values, 0.02);
    high[axis] = quantile(values, 0.98);
  }
  const double height_m = std::max(high.z() - low.z(), 1e-9);
  cloud.clear();
  cloud.reserve(points.size());
  for (const auto& point : points) {
    const double level = std::clamp((point.z() - low.z()) / height_m, 0.0, 1.0);
    const cv::Vec3b colour = kColours(static_cast<int>(255 * level));
    const Eigen::Vector3f p = point.cast<float>();
    cloud.insertPoint({p.x(), p.y(), p.z(), colour[2], colour[1], colour[0], 255});
  }
  for (const StampedPose& pose : snapshot.trajectory) {
    const Eigen::Vector3d p = inScene(pose.T_world_rig.translation);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double follow = shown_ == 0 ? 1 : kFollow;
  centre_ += follow * ((low + high) / 2 - centre_);
  radius_m_ += follow * ((high - low).norm() / 2 - radius_m_);
}

void MapScene::showCameras(const WatchedMap& snapshot) {
  auto& trajectory = objectOf<CSetOfLines>(*scene_, "trajectory");
  trajectory.clear();
  for (std::size_t i = 1; i < snapshot.trajectory.size(); ++i) {
    addLine(trajectory, inScene(snapshot.trajectory[i - 1].T_world_rig.translation),
            inScene(snapshot.trajectory[i].T_world_rig.translation));
  }
  auto& frustum = objectOf<CSetOfLines>(*scene_, "frustum");
  frustum.clear();
  const ReferenceView& view = snapshot.keyframe.view;
  const Rigid3& T_world_ref = snapshot.trajectory.back().T_world_rig;
  const Eigen::Vector3d eye = inScene(T_world_ref.translation);
  const double length_m = 0.25 * radius_m_;
  Eigen::Vector3d corners[4];
  for (int i = 0; i < 4; ++i) {
    const double x = i == 0 || i == 3 ? 0 : view.width;
    const double y = i < 2 ? 0 : view.height;
    const Eigen::Vector3d p_ref((x - view.cx) / view.fx, (y - view.cy) / view.fy, 1);
    corners[i] = inScene(T_world_ref * (length_m * p_ref));
  }
  for (int i = 0; i < 4; ++i) {
    addLine(frustum, eye, corners[i]);
    addLine(frustum, corners[i], corners[(i + 1) % 4]);
  }
}

void MapScene::showPictures(const WatchedMap& snapshot) {
  const DepthMap& map = snapshot.keyframe.map;
  setPicture(*scene_, "depth", depthPicture(map.depth, snapshot.planes));
  cv::Mat3b confidence;
  cv::cvtColor(confidencePicture(map.confidence), confidence, cv::COLOR_GRAY2BGR);
  setPicture(*scene_, "confidence", confidence);
  mrpt::opengl::TFontParams font;
  font.vfont_name = "sans";
  font.vfont_scale = 13;
  auto main = scene_->getViewport();
  std::size_t index = 0;
  for (const std::string& line : snapshot.lines) {
    main->addTextMessage(12, -22 - 22 * static_cast<double>(index), line, index, font);
    ++index;
  }
  font.vfont_scale = 11;
  scene_->getViewport("depth")->addTextMessage(8, -16, "depth", 0, font);
  scene_->getViewport("confidence")->addTextMessage(8, -16, "confidence", 0, font);
}

void MapScene::turnView(const WatchedMap& snapshot) {
  const Eigen::Vector3d forward = R_scene_world_ * axisOf(snapshot.trajectory.back(), 2);
  const double follow = shown_ == 0 ? 1 : kFollow;
  heading_ += follow * (forward.head<2>() - heading_);
  const double behind_deg = std::atan2(-heading_.y(), -heading_.x()) * 180 / M_PI;
  const double sway_deg = kSwayDeg * std::sin(2 * M_PI * shown_ / kSwayKeyframes);
  auto& camera = scene_->getViewport()->getCamera();
  camera.setProjectiveModel(true);
  camera.setProjectiveFOVdeg(kFieldOfViewDeg);
  camera.setPointingAt(static_cast<float>(centre_.x()), static_cast<float>(centre_.y()),
                       static_cast<float>(centre_.z()));
  camera.setAzimuthDegrees(static_cast<float>(behind_deg + sway_deg));
  camera.setElevationDegrees(kElevationDeg);
  // 1: a ball with the map's radius fills the view. A map fills less than this ball.
  constexpr double kNearer = 0.75;
  const double distance_m =
      kNearer * std::max(radius_m_, 1e-3) / std::sin(kFieldOfViewDeg / 2 * M_PI / 180);
  camera.setZoomDistance(static_cast<float>(distance_m));
  scene_->getViewport()->setViewportClipDistances(static_cast<float>(0.01 * distance_m),
                                                  static_cast<float>(20 * distance_m));
}

std::unique_ptr<MapWatcher> recordFrames(const std::filesystem::path& folder, bool force) {
  return std::make_unique<MapFrames>(folder, force);
}

}  // namespace efm
