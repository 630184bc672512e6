// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/writers/recording_writer.h"

#include <algorithm>
#include <cerrno>
#include <stdexcept>
#include <string>

#include "mapping/geometry/timestamp.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {

OutputFile::OutputFile(const std::filesystem::path& path, std::filesystem::path name)
    : name_(std::move(name)), stream_(path, std::ios::binary) {
  if (!stream_) throw std::runtime_error(name_.string() + ": cannot be made");
}

void OutputFile::close() {
  stream_.close();
  requireWritten();
}

void PoseTextFile::add(const StampedPose& pose) {
  if (!file_) {
    file_ = std::make_unique<OutputFile>(path_);
    writeTumTrajectory(file_->stream(), {});  // the header
  }
  writeTumPose(file_->stream(), pose);
}

void PoseTextFile::close() {
  if (file_) file_->close();
}

void writeCamchain(const std::filesystem::path& folder, const Rig& rig) {
  const auto has_lens = [](const RigCamera& camera) { return camera.model.fx > 0; };
  if (!std::all_of(rig.cameras.begin(), rig.cameras.end(), has_lens)) return;
  OutputFile camchain(folder / "camchain.yaml");
  camchain.stream() << formatCamchain(rig);
  camchain.close();
}

void OutputFile::requireWritten() const {
  if (stream_) return;
  const std::string why = reasonNotWritten(errno);
  throw std::runtime_error(name_.string() + ": " + (why.empty() ? "cannot be written" : why));
}

namespace {

class FolderWriter : public RecordingWriter {
 public:
  FolderWriter(const std::filesystem::path& folder, const Rig& rig)
      : folder_(folder), poses_(folder_.temporary() / "poses.txt") {
    for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
      const std::filesystem::path cam = folder_.temporary() / ("cam" + std::to_string(camera));
      std::filesystem::create_directory(cam);
      events_.emplace_back(cam / "events.txt");
    }
    writeCamchain(folder_.temporary(), rig);
  }

  void addEvents(std::size_t camera, const std::vector<Event>& events) override {
    std::string text;
    appendEvents(text, events);
    events_.at(camera).stream() << text;
    events_.at(camera).requireWritten();
  }

  void addPose(const StampedPose& pose) override { poses_.add(pose); }

  void addTruth(std::int64_t t_ns, const std::filesystem::path& file) override {
    const std::filesystem::path depth = folder_.temporary() / "depth";
    if (!truth_) {
      std::filesystem::create_directory(depth);
      truth_ = std::make_unique<OutputFile>(depth / "index.txt");
    }
    const std::string name = "cam0_" + formatSeconds(t_ns) + ".tiff";
    std::filesystem::copy_file(file, depth / name);
    truth_->stream() << formatSeconds(t_ns) << " " << name << "\n";
  }

  void close() override {
    if (truth_) truth_->close();
    for (OutputFile& file : events_) file.close();
    poses_.close();
    folder_.finish();
  }

 private:
  NewFolder folder_;
  std::vector<OutputFile> events_;  // per camera
  PoseTextFile poses_;
  std::unique_ptr<OutputFile> truth_;  // index of the depth maps, if there are any
};

}  // namespace

std::unique_ptr<RecordingWriter> openFolderWriter(const std::filesystem::path& folder,
                                                  const Rig& rig) {
  return std::make_unique<FolderWriter>(folder, rig);
}

}  // namespace efm
