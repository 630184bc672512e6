// SPDX-License-Identifier: BSD-3-Clause
// Writes the truth of slider_depth for studies/slider.py: images of the reference view, float32,
// row after row.
//   slider_truth FOLDER OUT [--quick]
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>

#include "test/studies/frames/slider_keyframe.h"
#include "test/studies/frames/slider_truth.h"

namespace {

namespace fs = std::filesystem;
using namespace efm;           // NOLINT(google-build-using-namespace)
using namespace efm::studies;  // NOLINT(google-build-using-namespace)

void write(const fs::path& file, const cv::Mat1f& image) {
  std::ofstream stream(file, std::ios::binary);
  for (int y = 0; y < image.rows; ++y) {
    stream.write(reinterpret_cast<const char*>(image.ptr(y)),
                 static_cast<std::streamsize>(image.cols * sizeof(float)));
  }
  stream.close();
  if (!stream) throw std::runtime_error(file.string() + ": cannot be written");
}

/// The kind of the strongest edge within a pixel: see EdgeKind.
cv::Mat1f kindsOf(const EdgeKinds& edges) {
  cv::Mat1f kinds(edges.kinds.size());
  for (int y = 0; y < kinds.rows; ++y) {
    for (int x = 0; x < kinds.cols; ++x) kinds(y, x) = static_cast<float>(edges.kindNear(x, y));
  }
  return kinds;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: slider_truth FOLDER OUT [--quick]\n";
    return 2;
  }
  try {
    const fs::path folder = argv[1];
    const fs::path out = argv[2];
    FrameDepthOptions options;
    if (argc > 3 && std::string(argv[3]) == "--quick") {
      options.planes.num_planes = 24;
      options.max_frames = 4;
    }
    const KeyframeDepthMap keyframe = sliderKeyframe(readSlider(folder), {});
    const SliderTruth truth = sliderTruth(folder, keyframe.view, keyframe.T_world_ref,
                                          keyframe.window.t_ref_ns, options);
    fs::create_directories(out);
    write(out / "depth.f32", truth.frames.depth);
    write(out / "grey.f32", truth.frames.grey);
    write(out / "kinds.f32", kindsOf(truth.edges));
    write(out / "vertical_lines.f32", truth.edges.vertical_lines);
    write(out / "horizontal_lines.f32", truth.edges.horizontal_lines);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "slider_truth: " << error.what() << '\n';
    return 1;
  }
}
