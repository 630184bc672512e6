// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/writers/folder_writer.h"

#include <stdexcept>
#include <string>

#include "tracking_stub/poses/tum_trajectory.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {
namespace {

void closeOrThrow(std::ofstream& stream, const std::filesystem::path& path) {
  stream.close();
  if (!stream) throw std::runtime_error(path.string() + ": cannot be written");
}

}  // namespace

FolderWriter::FolderWriter(const std::filesystem::path& folder, const Rig& rig) : folder_(folder) {
  for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    const std::filesystem::path cam = "cam" + std::to_string(camera);
    std::filesystem::create_directory(folder_.temporary() / cam);
    events_.push_back(open(cam / "events.txt"));
  }
  poses_ = open("poses.txt");
  File camchain = open("camchain.yaml");
  camchain.stream << formatCamchain(rig);
  closeOrThrow(camchain.stream, camchain.path);
}

FolderWriter::File FolderWriter::open(const std::filesystem::path& path) const {
  const std::filesystem::path whole = folder_.temporary() / path;
  File file = {whole, std::ofstream(whole, std::ios::binary)};
  if (!file.stream) throw std::runtime_error(whole.string() + ": cannot be made");
  return file;
}

void FolderWriter::addEvents(std::size_t camera, const std::vector<Event>& events) {
  std::string text;
  appendEvents(text, events);
  events_.at(camera).stream << text;
}

void FolderWriter::addPose(const StampedPose& pose) { writeTumTrajectory(poses_.stream, {pose}); }

void FolderWriter::close() {
  for (File& file : events_) closeOrThrow(file.stream, file.path);
  closeOrThrow(poses_.stream, poses_.path);
  folder_.finish();
}

}  // namespace efm
