// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/error_words.h"

#include <algorithm>
#include <filesystem>
#include <opencv2/core.hpp>
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

/// MRPT's exceptions hold their place, too: "==== MRPT exception ====\nMessage:  TEXT\nLocation:
/// …".
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

/// Blanks and ends of lines become one blank each.
std::string onOneLine(const std::string& text) {
  std::string line;
  for (const std::string_view word : splitWords(text, " \t\r\v\f\n")) {
    line += (line.empty() ? "" : " ") + std::string(word);
  }
  return line;
}

/// The standard library's exceptions, also within the text of another one.
bool isOutOfMemory(std::string_view text) {
  for (const std::string_view sign : {"std::bad_alloc", "std::bad_array_new_length",
                                      "cannot create std::", "vector::", "basic_string::_M"}) {
    if (text.find(sign) != std::string_view::npos) return true;
  }
  return false;
}

}  // namespace

std::string inWords(const std::exception& error) {
  if (const auto* file = dynamic_cast<const std::filesystem::filesystem_error*>(&error)) {
    const std::string to = file->path2().empty() ? "" : " to " + file->path2().string();
    const std::string why = reasonNotWritten(file->code().value());
    return file->path1().string() + to + ": " + (why.empty() ? file->code().message() : why);
  }
  const auto* opencv = dynamic_cast<const cv::Exception*>(&error);
  if (opencv != nullptr && opencv->code != cv::Error::StsNoMem) return onOneLine(opencv->err);
  if (opencv != nullptr || isOutOfMemory(error.what())) return kOutOfMemory;
  if (const auto* system = dynamic_cast<const std::system_error*>(&error)) {
    return "the system refuses: " + system->code().message();  // a thread, for instance
  }
  const std::string text = withoutPlace(error.what());
  return text == error.what() ? text : onOneLine(text);
}

}  // namespace efm
