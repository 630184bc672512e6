// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/recording_formats.h"
#include "test/studies/frames/posed_frames.h"

#include <algorithm>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/geometry/trajectory.h"
#include "plugin/evaluation/depth_file.h"
#include "plugin/recordings/text/dataset_folder.h"

namespace efm::studies {
namespace {

namespace fs = std::filesystem;

cv::Mat1f readImage(const fs::path& file, const CameraModel& camera) {
  const cv::Mat image = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
  if (image.cols != camera.width || image.rows != camera.height) {
    throw std::runtime_error(file.string() + ": expected an image of " +
                             std::to_string(camera.width) + "x" + std::to_string(camera.height) +
                             " pixels");
  }
  cv::Mat1f grey;
  image.convertTo(grey, CV_32F);
  return grey;
}

}  // namespace

std::size_t PosedFrames::nearestTo(std::int64_t t_ns) const {
  const auto nearer = [&](const PosedFrame& a, const PosedFrame& b) {
    return std::abs(a.t_ns - t_ns) < std::abs(b.t_ns - t_ns);
  };
  return static_cast<std::size_t>(std::min_element(frames.begin(), frames.end(), nearer) -
                                  frames.begin());
}

FrameUndistortion::FrameUndistortion(const CameraModel& camera)
    : source_(camera.height, camera.width) {
  const ReferenceView view = ReferenceView::of(camera);
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const Eigen::Vector2d pixel = camera.project(view.pointAt(x, y, 1));
      source_(y, x) = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
    }
  }
}

PosedFrame FrameUndistortion::operator()(const cv::Mat1f& raw) const {
  PosedFrame frame;
  cv::remap(raw, frame.image, source_, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  cv::remap(cv::Mat1b(raw.size(), 255), frame.seen, source_, cv::noArray(), cv::INTER_NEAREST,
            cv::BORDER_CONSTANT, 0);
  return frame;
}

CameraModel uzhCamera(const fs::path& folder) {
  const RecordingParts parts = openUzhFolder({folder}, {});
  const CameraSize size = parts.cameras[0]->size().value_or(*parts.default_size);
  return parts.calibration.value().camera(0, size).model;
}

PosedFrames readUzhFrames(const fs::path& folder) {
  const CameraModel camera = uzhCamera(folder);
  Trajectory trajectory;
  for (const StampedPose& pose : readPoses(folder / "groundtruth.txt")) trajectory.add(pose);

  const fs::path list = folder / "images.txt";
  const FrameUndistortion undistort(camera);
  PosedFrames sequence{ReferenceView::of(camera), {}};
  for (const TimedFile& image : timedFilesIn(list)) {
    const auto T_world_cam = trajectory.poseAt(image.t_ns);
    if (!T_world_cam) continue;
    PosedFrame frame = undistort(readImage(image.file, camera));
    frame.t_ns = image.t_ns;
    frame.T_world_cam = *T_world_cam;
    sequence.frames.push_back(std::move(frame));
  }
  if (sequence.frames.empty()) throw std::runtime_error(list.string() + ": no image has a pose");
  return sequence;
}

}  // namespace efm::studies
