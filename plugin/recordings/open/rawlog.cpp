// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/rawlog.h"

#include <fmt/format.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "mapping/base/text.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/recordings/streams/file_content.h"

namespace efm {
namespace {

constexpr std::size_t kBufferSize = std::size_t{1} << 18;

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

GzInputStream::GzInputStream(const std::filesystem::path& file) : file_(nullptr, gzclose_r) {
  const std::filesystem::file_status status = std::filesystem::status(file);
  if (!std::filesystem::is_regular_file(status)) {
    const char* const what = std::filesystem::is_directory(status) ? "a folder: expected a file"
                             : std::filesystem::exists(status)     ? "not a regular file"
                                                                   : "no such file";
    throw std::runtime_error(file.string() + ": " + what);
  }
  file_size_ = std::filesystem::file_size(file);
  file_.reset(gzopen(file.c_str(), "rb"));
  if (!file_) {
    throw std::runtime_error(file.string() + ": cannot be opened: " + std::strerror(errno));
  }
  gzbuffer(file_.get(), static_cast<unsigned>(kBufferSize));
}

void GzInputStream::fill() {
  if (at_ < buffer_.size()) return;
  buffer_.resize(kBufferSize);
  at_ = 0;
  const int count = gzread(file_.get(), buffer_.data(), static_cast<unsigned>(kBufferSize));
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

namespace {

bool isNameCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == ':' || c == '<' || c == '>' || c == ',';
}

/// Whether these are the first bytes of an object: the length of its class's name, the name, the
/// content. The length is a byte with the top bit set, or (before MRPT 0.5.5) four bytes, the
/// lowest first. A truncated file may have fewer bytes.
bool beginsAnObject(std::string_view bytes) {
  constexpr std::size_t kShortestName = 3;
  constexpr std::size_t kLongestName = 120;
  constexpr unsigned kTopBit = 0x80;
  const unsigned first = static_cast<unsigned char>(bytes.front());
  const bool short_form = (first & kTopBit) != 0;
  const std::size_t length = first & ~kTopBit;
  if (length < kShortestName || length > kLongestName) return false;
  bytes.remove_prefix(1);
  if (!short_form) {
    const std::string_view zeros = bytes.substr(0, 3);
    if (!std::all_of(zeros.begin(), zeros.end(), [](char c) { return c == '\0'; })) return false;
    bytes.remove_prefix(zeros.size());
  }
  const std::string_view name = bytes.substr(0, length);
  return std::all_of(name.begin(), name.end(), isNameCharacter);
}

}  // namespace

std::optional<std::string> whyNoRawlog(const std::filesystem::path& file) {
  constexpr std::size_t kBytes = 128;
  constexpr std::size_t kShown = 24;
  GzInputStream stream(file);
  std::string bytes(kBytes, '\0');
  try {
    bytes.resize(stream.Read(bytes.data(), bytes.size()));
  } catch (const std::exception&) {
    return std::nullopt;  // damaged: the reader reports it
  }
  if (bytes.empty()) return "it is empty";
  if (beginsAnObject(bytes)) return std::nullopt;
  return "it begins with " + inQuotes(bytes.substr(0, kShown));
}

void requireRawlog(const std::filesystem::path& file) {
  std::optional<std::string> why = whyNoRawlog(file);
  if (!why) return;
#ifndef EFM_WITH_ARCHIVES
  if (isCompressed(file)) {
    *why += "; this build does not read other compressed files, EFM_READ_ARCHIVES";
  }
#endif
  throw std::runtime_error(
      file.string() + ": not a rawlog (" + *why +
      "): expected a rawlog, or a recording in another format (docs/recordings.md)");
}

namespace {

/// Removes the text up to the end of the last occurrence of a word.
void dropThrough(std::string_view& text, std::string_view last) {
  const auto at = text.rfind(last);
  if (at != std::string_view::npos) text.remove_prefix(at + last.size());
}

/// The reason of an error without MRPT's decoration. Each object around the damaged one adds
///
///     ==== MRPT exception ====
///     Message:  Exception while parsing typed object '…' from …
///     Original exception:
///     <the same of the inner object, or the reason>
///     Location: <source file, line, function>
///     Call stack backtrace: …
std::string reasonOf(const std::exception& error) {
  constexpr std::size_t kMaxCharacters = 400;
  constexpr std::string_view kHeading = "==== MRPT exception ====";
  std::string_view text = error.what();
  dropThrough(text, "Original exception:");
  text = text.substr(0, text.find("\nLocation:"));

  std::string reason;  // the message of an inner error may come before MRPT's heading
  const auto heading = text.find(kHeading);
  if (heading != std::string_view::npos) {
    reason = text.substr(0, heading);
    text.remove_prefix(heading + kHeading.size());
  }
  dropThrough(text, "Message:");
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  text = text.substr(0, text.find_first_of("\r\n"));
  // "[/path/file.cpp, line 12, function] message"
  if (!text.empty() && text.front() == '[') dropThrough(text, "] ");
  reason += text;
  reason.erase(0, reason.find_first_not_of(" \t\r\n"));
  return reason.empty() ? "unreadable" : printable(reason, kMaxCharacters);
}

}  // namespace

RawlogRecording::RawlogRecording(std::filesystem::path file)
    : file_(std::move(file)), stream_(file_) {}

void RawlogRecording::readEntry() {
  auto archive = mrpt::serialization::archiveFrom<mrpt::io::CStream>(stream_);
  const mrpt::serialization::CSerializable::Ptr entry = archive.ReadObject();
  if (!entry) throw std::runtime_error("an empty object");
  if (auto action = std::dynamic_pointer_cast<mrpt::obs::CActionCollection>(entry)) {
    actions_.push_back(action);
    return;
  }
  if (auto observation = std::dynamic_pointer_cast<mrpt::obs::CObservation>(entry)) {
    takeActions({});
    if (!IS_CLASS(*observation, mrpt::obs::CObservationComment)) pending_.push_back(observation);
    return;
  }
  if (auto frame = std::dynamic_pointer_cast<mrpt::obs::CSensoryFrame>(entry)) {
    takeActions(*frame);
    for (const auto& observation : *frame) pending_.push_back(observation);
    return;
  }
  throw std::runtime_error(std::string("an object of class '") +
                           entry->GetRuntimeClass()->className +
                           "': expected observations, sensory frames and actions");
}

/// Composes the actions so far to poses, with the frame's time if they have none. Of several poses
/// of one time, only the last has all movements before the frame.
void RawlogRecording::takeActions(const mrpt::obs::CSensoryFrame& frame) {
  mrpt::obs::CObservation::Ptr newest;
  while (!actions_.empty()) {
    const auto action = actions_.front();
    actions_.pop_front();
    const auto pose = reckoning_.poseAfter(*action, frame);
    if (!pose) continue;
    if (newest && newest->timestamp == pose->timestamp) pending_.pop_back();
    pending_.push_back(pose);
    newest = pose;
  }
}

/// MRPT treats every exception of a stream before an object's name as the end of the file.
std::string RawlogRecording::whyStopped(const std::exception& error) {
  std::string reason = reasonOf(error);
  if (reason.find("Assert condition failed") != std::string::npos) {
    return "the data are damaged: they are no object that MRPT wrote";
  }
  if (reason.find("EOF") == std::string::npos) return reason;
  try {
    stream_.atEnd();  // throws the same exception again
  } catch (const std::exception& cause) {
    return reasonOf(cause);
  }
  return "the file ends in the middle of its data";
}

mrpt::obs::CObservation::Ptr RawlogRecording::next() {
  while (pending_.empty()) {
    try {
      if (stream_.atEnd()) {
        if (entries_ == 0) throw std::runtime_error("the file is empty");
        takeActions({});
        if (pending_.empty()) return nullptr;
        break;
      }
      readEntry();
    } catch (const std::exception& error) {
      throw std::runtime_error(fmt::format("stopped at entry {} of {}: {}", entries_,
                                           file_.string(), whyStopped(error)));
    }
    ++entries_;
  }
  auto observation = pending_.front();
  pending_.pop_front();
  return observation;
}

std::string RawlogRecording::position() const {
  return "entry " + std::to_string(entries_ == 0 ? 0 : entries_ - 1) + " of " + file_.string();
}

RawlogWriter::RawlogWriter(const std::filesystem::path& file, RawlogCompression compression)
    : file_(file),
      compression_(compression),
      stream_(std::make_unique<GzOutputStream>(file_.temporary(),
                                               compression == RawlogCompression::kGzip)) {}

RawlogWriter::~RawlogWriter() = default;

void RawlogWriter::write(mrpt::obs::CObservation& observation) {
  if (auto* packet = dynamic_cast<CObservationEvents*>(&observation)) {
    packet->compression = compression_ == RawlogCompression::kZstd ? EventCompression::kZstd
                                                                   : EventCompression::kNone;
  }
  try {
    auto archive = mrpt::serialization::archiveFrom<mrpt::io::CStream>(*stream_);
    archive << observation;
  } catch (const std::exception& error) {
    throw std::runtime_error(file_.path().string() + ": cannot be written: " + error.what());
  }
}

void RawlogWriter::close() {
  try {
    stream_->close();
    file_.replace();
    stream_.reset();
  } catch (const std::exception& error) {
    throw std::runtime_error(file_.path().string() + ": " + error.what());
  }
}

}  // namespace efm
