// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/rawlog_recording.h"

#include <fmt/format.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "mapping/base/text.h"

namespace efm {
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

RawlogRecording::RawlogRecording(std::filesystem::path file, GzSource source)
    : file_(std::move(file)), stream_(file_, source) {}

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

}  // namespace efm
