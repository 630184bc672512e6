// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/window/map_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/base/atomic_file.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kWidth = 1280;
constexpr unsigned kHeight = 720;

/// Whether a file is named frame_000001.png, or has the temporary name of such a file, which a
/// killed run leaves.
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

}  // namespace

MapFrames::MapFrames(const fs::path& folder, bool force) : folder_(folder) {
  try {
    renderer_ = std::make_unique<mrpt::opengl::CFBORender>(kWidth, kHeight);
  } catch (const std::exception&) {
    throw std::runtime_error(
        "--record-frames: nothing can be rendered here: expected EGL and OpenGL, for instance the "
        "Debian packages libegl1 and libgl1-mesa-dri");
  }
  earlier_ = prepareFolder(folder, force);
}

void MapFrames::show(WatchedMap snapshot) {
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

}  // namespace efm
