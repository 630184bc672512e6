// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/error_text.h"

#include <opencv2/core.hpp>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "mapping/base/atomic_file.h"
#include "mapping/base/text.h"

namespace efm {
namespace {

constexpr const char* kOutOfMemory =
    "out of memory: try fewer planes ([dsi] num_planes), a smaller view ([dsi] width and height), "
    "or a "
    "shorter interval (--duration)";

/// Removes the place from the text of MRPT's exceptions: "==== MRPT exception ====\nMessage:
/// TEXT\nLocation: …".
std::string withoutPlace(std::string text) {
  constexpr std::string_view kBegin = "==== MRPT exception ====";
  constexpr std::string_view kMessage = "Message:";
  text.erase(std::min(text.find("Call stack backtrace:"), text.size()));
  const std::size_t begin = text.find(kBegin);
  if (begin == std::string::npos) return text;
  text.erase(std::min(text.find("Location:", begin), text.size()));
  const std::size_t message = text.find(kMessage, begin);
  const std::size_t end =
      message == std::string::npos ? begin + kBegin.size() : message + kMessage.size();
  return text.erase(begin, end - begin);
}

/// Returns the text with one blank for each sequence of blanks and line ends.
std::string onOneLine(const std::string& text) {
  std::string line;
  for (const std::string_view word : splitWords(text, " \t\r\v\f\n")) {
    line += (line.empty() ? "" : " ") + std::string(word);
  }
  return line;
}

/// Returns whether an exception of the standard library is the cause, also within another text.
bool isOutOfMemory(std::string_view text) {
  for (const std::string_view sign : {"std::bad_alloc", "std::bad_array_new_length",
                                      "cannot create std::", "vector::", "basic_string::_M"}) {
    if (text.find(sign) != std::string_view::npos) return true;
  }
  return false;
}

}  // namespace

UserError userError(const std::exception& error) {
  if (const auto* file = dynamic_cast<const std::filesystem::filesystem_error*>(&error)) {
    const std::string to = file->path2().empty() ? "" : " to " + file->path2().string();
    const std::string why = reasonNotWritten(file->code().value());
    return {file->path1().string() + to + ": " + (why.empty() ? file->code().message() : why)};
  }
  const auto* opencv = dynamic_cast<const cv::Exception*>(&error);
  if (opencv != nullptr && opencv->code != cv::Error::StsNoMem) return {onOneLine(opencv->err)};
  if (opencv != nullptr || isOutOfMemory(error.what())) {
    return {kOutOfMemory, {{"dsi", "num_planes"}, {"dsi", "width"}}};
  }
  if (const auto* system = dynamic_cast<const std::system_error*>(&error)) {
    return {"an error of the system: " + system->code().message()};  // for example, a thread
  }
  const std::string text = withoutPlace(error.what());
  UserError result{text == error.what() ? text : onOneLine(text)};
  if (const auto* hint = dynamic_cast<const OptionHint*>(&error)) result.options = hint->options;
  if (const auto* wrong = dynamic_cast<const OptionError*>(&error)) result.wrong = *wrong;
  return result;
}

bool isTemporary(std::string_view text) {
  if (text.find("cannot be created or the disk is full") != std::string_view::npos) return false;
  for (const std::string& sign :
       {std::string("out of memory"), reasonNotWritten(ENOSPC), reasonNotWritten(EDQUOT),
        std::string(std::strerror(ENOSPC)), std::string(std::strerror(EDQUOT)),
        std::string("another program writes"), std::string("is writing its result there")}) {
    if (text.find(sign) != std::string_view::npos) return true;
  }
  return false;
}

std::string userMessage(const std::exception& error) { return userError(error).text; }

}  // namespace efm
