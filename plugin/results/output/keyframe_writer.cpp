// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/keyframe_writer.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <sys/stat.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "plugin/session/session_status.h"

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
    : target_(std::make_unique<AtomicFile>(path)),
      plane_bytes_(static_cast<std::streamoff>(view.pixels() * sizeof(float))),
      file_(target_->temporary(), std::ios::binary | std::ios::trunc) {
  const std::string header = npyHeader(planes, view);
  header_bytes_ = static_cast<std::streamoff>(header.size());
  file_.write(header.data(), header_bytes_);
  if (!file_) throw std::runtime_error("cannot write " + target_->path().string());
}

void NpyDsiFile::addPlane(int plane, const float* values) {
  const std::lock_guard<std::mutex> lock(mutex_);
  file_.seekp(header_bytes_ + plane * plane_bytes_);
  file_.write(reinterpret_cast<const char*>(values), plane_bytes_);
}

std::unique_ptr<AtomicFile> NpyDsiFile::finish() {
  file_.close();
  if (!file_) {
    throw std::runtime_error("cannot write " + target_->path().string() + ": the disk may be full");
  }
  return std::move(target_);
}

namespace {

/// Returns a lock of the whole file. The lock belongs to the open file, not to the process, so it
/// also excludes another run in the same process.
flock wholeFile() {
  flock lock{};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return lock;
}

std::runtime_error atWork(const std::filesystem::path& folder) {
  return std::runtime_error(folder.string() +
                            ": another run is writing its result there: expected another folder");
}

}  // namespace

RunMark::RunMark(const std::filesystem::path& folder, const std::vector<std::string>& recording) {
  const std::filesystem::path path = folder / kName;
  const auto fail = [&] {
    const std::string why = reasonNotWritten(errno);
    const std::string text = why.empty() ? std::strerror(errno) : why;
    if (file_ >= 0) ::close(file_);
    return std::runtime_error("cannot write '" + path.string() + "': " + text);
  };
  struct stat status {};
  do {  // repeat until the locked file still exists: a run that ended meanwhile removed it
    if (file_ >= 0) ::close(file_);
    file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (file_ < 0) throw fail();
    flock lock = wholeFile();
    if (::fcntl(file_, F_OFD_SETLK, &lock) != 0 && (errno == EAGAIN || errno == EACCES)) {
      ::close(file_);
      throw atWork(folder);
    }  // on a file system without locks, another run is not detected
  } while (::fstat(file_, &status) == 0 && status.st_nlink == 0);
  const std::string text = nlohmann::json{{"recording", recording}, {"process", getpid()}}.dump(
                               2, ' ', false, nlohmann::json::error_handler_t::replace) +
                           "\n";
  if (::ftruncate(file_, 0) != 0 ||
      ::write(file_, text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    throw fail();
  }
}

RunMark::~RunMark() { ::close(file_); }

std::optional<UnfinishedRun> RunMark::ofKilledRun(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / kName;
  if (!std::filesystem::is_regular_file(path)) return std::nullopt;
  std::ifstream stream(path);
  const nlohmann::json mark = nlohmann::json::parse(stream, nullptr, false);
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  flock lock = wholeFile();
  const bool asked = ::fcntl(file, F_OFD_GETLK, &lock) == 0;
  ::close(file);
  if (asked && lock.l_type != F_UNLCK) throw atWork(folder);
  try {
    return UnfinishedRun{mark.at("recording").get<std::vector<std::string>>(),
                         mark.at("process").get<pid_t>()};
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
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

double KeyframeWriter::cpuSeconds() const {
  clockid_t clock{};
  // The thread runs until the destructor joins it.
  pthread_getcpuclockid(const_cast<std::thread&>(thread_).native_handle(), &clock);  // NOLINT
  return secondsOf(clock);
}

void KeyframeWriter::run() {
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
