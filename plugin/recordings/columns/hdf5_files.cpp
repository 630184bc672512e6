// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/hdf5_files.h"

#include <algorithm>
#include <string_view>
#include <system_error>
#include <utility>

namespace efm {
namespace {

namespace fs = std::filesystem;

bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

bool isHdf5File(const fs::path& file) { return beginsWith(file, "\x89HDF\r\n\x1a\n"); }

bool mayBeHdf5(const fs::path& file) {
  const std::string extension = file.extension().string();
  return (extension == ".h5" || extension == ".hdf5") &&
         !contains(file.filename().string(), "rectify_map") && isHdf5File(file);
}

bool isCamera(const std::string& name) {
  return name == "left" || name == "right" || name.rfind("cam", 0) == 0;
}

/// Returns the camera of a file, from its path in the recording's folder.
std::string cameraOf(const fs::path& path) {
  for (const char* side : {"left", "right"}) {
    if (contains(path.string(), side)) return side;
  }
  const std::string folder = path.parent_path().filename().string();
  return isCamera(folder) ? folder : "";
}

/// Adds the files of a folder and, down to `depth` levels, of its folders of events and cameras.
void addFiles(const fs::path& folder, int depth, std::vector<fs::path>& files) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& path = entry->path();
    const std::string name = path.filename().string();
    if (mayBeHdf5(path)) files.push_back(path);
    std::error_code ignored;
    if (depth > 0 && (isCamera(name) || contains(name, "event")) &&
        fs::is_directory(path, ignored)) {
      addFiles(path, depth - 1, files);
    }
  }
}

}  // namespace

std::vector<CameraFile> hdf5FilesIn(const fs::path& folder) {
  constexpr int kDepth = 2;
  std::vector<fs::path> paths;
  addFiles(folder, kDepth, paths);
  std::vector<CameraFile> files;
  for (const fs::path& path : paths) {
    files.push_back({cameraOf(path.lexically_relative(folder)), path});
  }
  const auto order = [](const CameraFile& file) {
    const int side = file.camera == "left" ? 0 : file.camera == "right" ? 1 : 2;
    return std::pair(side, file.file);
  };
  std::sort(files.begin(), files.end(),
            [&](const CameraFile& a, const CameraFile& b) { return order(a) < order(b); });
  return files;
}

bool looksLikeHdf5(const fs::path& source) {
  std::error_code ignored;
  if (fs::is_directory(source, ignored)) return !hdf5FilesIn(source).empty();
  return isHdf5File(source);
}

}  // namespace efm
