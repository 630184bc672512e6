// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/writers/text_file.h"

#include <algorithm>
#include <cerrno>
#include <stdexcept>
#include <utility>

#include "mapping/base/atomic_file.h"
#include "mapping/geometry/trajectory.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {

TextFile::TextFile(std::filesystem::path path)
    : path_(std::move(path)), stream_(path_, std::ios::binary) {
  if (!stream_) throw std::runtime_error(path_.string() + ": cannot be made");
}

void TextFile::close() {
  stream_.close();
  requireWritten();
}

void PoseTextFile::add(const StampedPose& pose) {
  if (!file_) {
    file_ = std::make_unique<TextFile>(path_);
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
  TextFile camchain(folder / "camchain.yaml");
  camchain.stream() << formatCamchain(rig);
  camchain.close();
}

void TextFile::requireWritten() const {
  if (stream_) return;
  const std::string why = reasonNotWritten(errno);
  throw std::runtime_error(path_.string() + ": " + (why.empty() ? "cannot be written" : why));
}

}  // namespace efm
