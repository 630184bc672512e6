// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/writers/folder_writer.h"

#include <string>

#include "mapping/geometry/timestamp.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {

FolderWriter::FolderWriter(const std::filesystem::path& folder, const Rig& rig)
    : folder_(folder), poses_(folder_.temporary() / "poses.txt") {
  for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    const std::filesystem::path cam = folder_.temporary() / ("cam" + std::to_string(camera));
    std::filesystem::create_directory(cam);
    events_.emplace_back(cam / "events.txt");
  }
  writeCamchain(folder_.temporary(), rig);
}

void FolderWriter::addEvents(std::size_t camera, const std::vector<Event>& events) {
  std::string text;
  appendEvents(text, events);
  events_.at(camera).stream() << text;
  events_.at(camera).requireWritten();
}

void FolderWriter::addPose(const StampedPose& pose) { poses_.add(pose); }

void FolderWriter::addTruth(std::int64_t t_ns, const std::filesystem::path& file) {
  const std::filesystem::path depth = folder_.temporary() / "depth";
  if (!truth_) {
    std::filesystem::create_directory(depth);
    truth_ = std::make_unique<TextFile>(depth / "index.txt");
  }
  const std::string name = "cam0_" + formatSeconds(t_ns) + ".tiff";
  std::filesystem::copy_file(file, depth / name);
  truth_->stream() << formatSeconds(t_ns) << " " << name << "\n";
}

void FolderWriter::close() {
  if (truth_) truth_->close();
  for (TextFile& file : events_) file.close();
  poses_.close();
  folder_.finish();
}

}  // namespace efm
