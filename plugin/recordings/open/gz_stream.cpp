// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/gz_stream.h"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "mapping/base/atomic_file.h"

namespace efm {
namespace {

constexpr std::size_t kBufferSize = std::size_t{1} << 18;
constexpr std::size_t kPipeBufferSize = std::size_t{1} << 13;

[[noreturn]] void refuse(const char* what) { throw std::logic_error(what); }

std::string systemReason() {
  const int number = errno;
  const std::string why = reasonNotWritten(number);
  return why.empty() ? std::strerror(number) : why;
}

std::string reasonOf(gzFile file) {
  int code = Z_OK;
  const char* message = gzerror(file, &code);
  if (code == Z_BUF_ERROR) return "the file ends in the middle of its data";
  if (code == Z_ERRNO) return systemReason();
  if (message == nullptr || *message == '\0') return "unknown error";
  const std::string text = message;  // "<path>: <reason>"; the caller names the file
  const auto colon = text.rfind(": ");
  return colon == std::string::npos ? text : text.substr(colon + 2);
}

}  // namespace

GzInputStream::GzInputStream(const std::filesystem::path& file, GzSource source)
    : file_(nullptr, gzclose_r),
      buffer_size_(source == GzSource::kPipe ? kPipeBufferSize : kBufferSize) {
  const std::filesystem::file_status status = std::filesystem::status(file);
  const bool is_pipe = source == GzSource::kPipe && std::filesystem::is_fifo(status);
  if (!is_pipe && !std::filesystem::is_regular_file(status)) {
    const char* const what = std::filesystem::is_directory(status) ? "a folder: expected a file"
                             : std::filesystem::exists(status)     ? "not a regular file"
                                                                   : "no such file";
    throw std::runtime_error(file.string() + ": " + what);
  }
  if (!is_pipe) file_size_ = std::filesystem::file_size(file);
  file_.reset(gzopen(file.c_str(), "rb"));
  if (!file_) {
    throw std::runtime_error(file.string() + ": cannot be opened: " + std::strerror(errno));
  }
  gzbuffer(file_.get(), static_cast<unsigned>(buffer_size_));
}

void GzInputStream::fill() {
  if (at_ < buffer_.size()) return;
  buffer_.resize(buffer_size_);
  at_ = 0;
  const int count = gzread(file_.get(), buffer_.data(), static_cast<unsigned>(buffer_size_));
  if (count < 0) {
    buffer_.clear();
    throw std::runtime_error(reasonOf(file_.get()));
  }
  buffer_.resize(static_cast<std::size_t>(count));
  if (count > 0) return;
  int code = Z_OK;
  gzerror(file_.get(), &code);  // a truncated file ends with 0 bytes and this code
  if (code != Z_OK) throw std::runtime_error(reasonOf(file_.get()));
}

bool GzInputStream::atEnd() {
  fill();
  return buffer_.empty();
}

double GzInputStream::progress() const {
  const auto offset = static_cast<double>(gzoffset(file_.get()));
  return file_size_ == 0 ? 1.0 : std::clamp(offset / static_cast<double>(file_size_), 0.0, 1.0);
}

std::size_t GzInputStream::Read(void* buffer, std::size_t count) {
  auto* to = static_cast<std::uint8_t*>(buffer);
  std::size_t done = 0;
  while (done < count && !atEnd()) {
    const std::size_t piece = std::min(count - done, buffer_.size() - at_);
    std::memcpy(to + done, buffer_.data() + at_, piece);
    at_ += piece;
    done += piece;
  }
  position_ += done;
  return done;
}

std::size_t GzInputStream::Write(const void*, std::size_t) { refuse("a stream to read from"); }
std::uint64_t GzInputStream::Seek(std::int64_t, TSeekOrigin) { refuse("a stream goes forward"); }
std::uint64_t GzInputStream::getTotalBytesCount() const { refuse("a stream has no known size"); }

GzOutputStream::GzOutputStream(const std::filesystem::path& file, bool compressed)
    : file_(gzopen(file.c_str(), compressed ? "wb1" : "wbT"), gzclose_w) {
  if (!file_) {
    throw std::runtime_error(file.string() + ": cannot be made: " + std::strerror(errno));
  }
  gzbuffer(file_.get(), kBufferSize);
}

std::size_t GzOutputStream::Write(const void* buffer, std::size_t count) {
  const auto* from = static_cast<const std::uint8_t*>(buffer);
  constexpr std::size_t kMost = std::numeric_limits<int>::max();
  for (std::size_t done = 0; done < count;) {
    const std::size_t piece = std::min(kMost, count - done);
    const int written = gzwrite(file_.get(), from + done, static_cast<unsigned>(piece));
    if (written <= 0) throw std::runtime_error(reasonOf(file_.get()));
    done += static_cast<std::size_t>(written);
  }
  position_ += count;
  return count;
}

void GzOutputStream::close() {
  gzFile handle = file_.release();
  if (handle != nullptr && gzclose_w(handle) != Z_OK) {
    throw std::runtime_error("cannot be completed: " + systemReason());
  }
}

std::size_t GzOutputStream::Read(void*, std::size_t) { refuse("a stream to write to"); }
std::uint64_t GzOutputStream::Seek(std::int64_t, TSeekOrigin) { refuse("a stream goes forward"); }

}  // namespace efm
