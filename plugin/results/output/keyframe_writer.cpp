// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/keyframe_writer.h"

#include <fmt/format.h>

#include <cstdint>
#include <stdexcept>
#include <utility>

#include "mapping/base/stage_times.h"

namespace efm {
namespace {

/// Returns magic bytes, version 1.0, length, and a dictionary that is padded so that the data
/// begins at a multiple of 64 bytes (NEP 1).
std::string npyHeader(int planes, const ReferenceView& view) {
  std::string dictionary =
      fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, {}), }}", planes,
                  view.height, view.width);
  constexpr std::size_t kPrefix = 10;
  const std::size_t padding = 63 - (kPrefix + dictionary.size()) % 64;
  dictionary += std::string(padding, ' ') + "\n";
  const auto length = static_cast<std::uint16_t>(dictionary.size());
  std::string header("\x93NUMPY\1\0", 8);
  header += static_cast<char>(length & 0xff);
  header += static_cast<char>(length >> 8);
  return header + dictionary;
}

}  // namespace

NpyDsiFile::NpyDsiFile(const std::filesystem::path& path, int planes, const ReferenceView& view)
    : path_(path),
      plane_bytes_(static_cast<std::streamoff>(view.pixels() * sizeof(float))),
      file_(path, std::ios::binary | std::ios::trunc) {
  const std::string header = npyHeader(planes, view);
  header_bytes_ = static_cast<std::streamoff>(header.size());
  file_.write(header.data(), header_bytes_);
  if (!file_) throw std::runtime_error("cannot write " + path_.string());
}

void NpyDsiFile::addPlane(int plane, const float* values) {
  const std::lock_guard<std::mutex> lock(mutex_);
  file_.seekp(header_bytes_ + plane * plane_bytes_);
  file_.write(reinterpret_cast<const char*>(values), plane_bytes_);
}

void NpyDsiFile::finish() {
  file_.close();
  if (!file_) throw std::runtime_error("cannot write " + path_.string() + ": the disk may be full");
}

KeyframeWriter::KeyframeWriter(Write write)
    : write_(std::move(write)), thread_([this] { run(); }) {}

KeyframeWriter::~KeyframeWriter() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void KeyframeWriter::add(const KeyframeDepthMap& keyframe) {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [this] { return error_ || !waiting_; });
  if (error_) std::rethrow_exception(error_);
  waiting_ = keyframe;
  changed_.notify_all();
}

void KeyframeWriter::finish() {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [this] { return error_ || (!waiting_ && !busy_); });
  if (error_) std::rethrow_exception(error_);
}

void KeyframeWriter::run() {
  const WorkAside aside;
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || waiting_; });
    if (!waiting_) return;
    const KeyframeDepthMap keyframe = *std::exchange(waiting_, std::nullopt);
    busy_ = true;
    changed_.notify_all();
    lock.unlock();
    std::exception_ptr error;
    try {
      write_(keyframe);
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    busy_ = false;
    if (error) {
      error_ = error;
      waiting_.reset();
    }
    changed_.notify_all();
  }
}

}  // namespace efm
