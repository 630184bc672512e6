// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/rendering/frame_renderer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

namespace efm {
namespace {

constexpr int kRowsPerTask = 8;
constexpr int kSamples = 16;

/// Hammersley's points. No two have the same row or column: an edge of any orientation covers a
/// pixel in steps of 1/16.
std::array<Eigen::Vector2d, kSamples> makeSampleOffsets() {
  std::array<Eigen::Vector2d, kSamples> offsets;
  for (int i = 0; i < kSamples; ++i) {
    const int reversed = ((i & 1) << 3) | ((i & 2) << 1) | ((i & 4) >> 1) | ((i & 8) >> 3);
    offsets[static_cast<std::size_t>(i)] = {(i + 0.5) / kSamples - 0.5,
                                            (reversed + 0.5) / kSamples - 0.5};
  }
  return offsets;
}

const std::array<Eigen::Vector2d, kSamples> kSampleOffsets = makeSampleOffsets();

bool isSilhouette(const cv::Mat1i& surface, int x, int y) {
  const int left = std::max(x - 1, 0);
  const int right = std::min(x + 1, surface.cols - 1);
  const int down = std::min(y + 1, surface.rows - 1);
  const int center = surface(y, x);
  for (int row = std::max(y - 1, 0); row <= down; ++row) {
    const int* pixels = surface.ptr<int>(row);
    for (int column = left; column <= right; ++column) {
      if (pixels[column] != center) return true;
    }
  }
  return false;
}

template <typename RowTask>
void forEachRow(int rows, const RowTask& task) {
  tbb::parallel_for(tbb::blocked_range<int>(0, rows, kRowsPerTask),
                    [&task](const tbb::blocked_range<int>& range) {
                      for (int y = range.begin(); y < range.end(); ++y) task(y);
                    });
}

}  // namespace

void FrameRenderer::render(const SceneView& view, Frame& frame) const {
  frame.log_intensity.create(rays_.height(), rays_.width());
  frame.surface.create(rays_.height(), rays_.width());
  forEachRow(rays_.height(), [&](int y) { castRow(view, y, frame); });
  forEachRow(rays_.height(), [&](int y) { averageSilhouettes(view, y, frame); });
}

void FrameRenderer::castRow(const SceneView& view, int y, Frame& frame) const {
  float* log_intensity = frame.log_intensity.ptr<float>(y);
  int* surface = frame.surface.ptr<int>(y);
  for (int x = 0; x < rays_.width(); ++x) {
    const PixelRay& pixel = rays_(x, y);
    const ViewHit hit = view.cast(pixel.ray);
    surface[x] = hit.surface;
    log_intensity[x] = view.logIntensity(hit, pixel.ray, pixel.pitch);
  }
}

void FrameRenderer::averageSilhouettes(const SceneView& view, int y, Frame& frame) const {
  float* log_intensity = frame.log_intensity.ptr<float>(y);
  for (int x = 0; x < rays_.width(); ++x) {
    if (!isSilhouette(frame.surface, x, y)) continue;
    const PixelRay& pixel = rays_(x, y);
    float sum = 0;
    for (const Eigen::Vector2d& offset : kSampleOffsets) {
      const Eigen::Vector2d ray = pixel.at(offset.x(), offset.y());
      sum += view.logIntensity(view.cast(ray), ray, pixel.pitch);
    }
    log_intensity[x] = sum / kSamples;
  }
}

SurfacePoint FrameRenderer::sourceOf(const SceneView& view, const Frame& frame, int x,
                                     int y) const {
  const PixelRay& pixel = rays_(x, y);
  Eigen::Vector2d nearest_ray = pixel.ray;
  ViewHit nearest = view.cast(nearest_ray);
  if (isSilhouette(frame.surface, x, y)) {
    for (const Eigen::Vector2d& offset : kSampleOffsets) {
      const Eigen::Vector2d ray = pixel.at(offset.x(), offset.y());
      const ViewHit hit = view.cast(ray);
      if (hit.inverse_depth <= nearest.inverse_depth) continue;
      nearest = hit;
      nearest_ray = ray;
    }
  }
  return view.surfacePointOf(nearest, nearest_ray);
}

}  // namespace efm
