// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/text/event_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cctype>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/time_unit.h"
#include "plugin/recordings/text/pose_text.h"

namespace efm {
namespace {

constexpr std::size_t kBlockBytes = std::size_t{1} << 20;
constexpr std::size_t kFirstBytes = std::size_t{1} << 16;

bool isDigit(char c) { return c >= '0' && c <= '9'; }
bool isBlank(char c) { return c == ' ' || c == '\t'; }

struct Digits {
  std::uint64_t value;  // exact up to 19 digits, then it wraps
  std::ptrdiff_t count;
};

/// Reads digits and moves `text` past them.
Digits takeDigits(const char*& text) {
  const char* const begin = text;
  std::uint64_t value = 0;
  for (; isDigit(*text); ++text) value = value * 10 + static_cast<std::uint64_t>(*text - '0');
  return {value, text - begin};
}

/// Moves `text` past blanks. @return whether there were any.
bool takeBlanks(const char*& text) {
  const bool any = isBlank(*text);
  while (isBlank(*text)) ++text;
  return any;
}

/// Moves `text` past a separator and the blanks around it. @return whether there was one.
bool takeSeparator(const char*& text, char separator) {
  if (separator == '\t') {  // a field between two tabs may be empty
    while (*text == ' ') ++text;
    if (*text != separator) return false;
    do {
      ++text;
    } while (*text == ' ');
    return true;
  }
  const bool any = takeBlanks(text);
  if (separator == ' ') return any;
  if (*text != separator) return false;
  ++text;
  takeBlanks(text);
  return true;
}

/// @param decimals_of_ns decimals of a time to 1 ns: 9 for seconds, 0 for nanoseconds.
/// @return false if `parseLine` must parse the line.
inline bool takeTime(const char*& text, int decimals_of_ns, Event& event) {
  constexpr std::array<std::uint64_t, 10> kPowers = {
      1, 10, 100, 1'000, 10'000, 100'000, 1'000'000, 10'000'000, 100'000'000, 1'000'000'000};
  constexpr int kMaxDigits = 19;
  const Digits whole = takeDigits(text);
  if (whole.count < 1 || whole.count > kMaxDigits - decimals_of_ns) return false;
  std::uint64_t t_ns = whole.value * kPowers[static_cast<std::size_t>(decimals_of_ns)];
  if (*text == '.') {
    const Digits decimals = takeDigits(++text);
    if (decimals.count > decimals_of_ns) return false;
    t_ns += decimals.value * kPowers[static_cast<std::size_t>(decimals_of_ns - decimals.count)];
  }
  if (t_ns >= static_cast<std::uint64_t>(kEndOfTimeNs)) return false;
  event.t_ns = static_cast<std::int64_t>(t_ns);
  return true;
}

/// Moves `text` past a point and zeros: 96.0 is a pixel.
inline void takeZeroDecimals(const char*& text) {
  if (*text != '.') return;
  do {
    ++text;
  } while (*text == '0');
}

inline bool takePixel(const char*& text, std::uint16_t& pixel) {
  constexpr int kMaxPixelDigits = 5;
  const Digits digits = takeDigits(text);
  if (digits.count < 1 || digits.count > kMaxPixelDigits ||
      digits.value > std::numeric_limits<std::uint16_t>::max()) {
    return false;
  }
  pixel = static_cast<std::uint16_t>(digits.value);
  takeZeroDecimals(text);
  return true;
}

inline bool takePolarity(const char*& text, bool& polarity) {
  const bool negative = *text == '-';
  text += negative ? 1 : 0;
  polarity = *text == '1' && !negative;
  if (*text != '1' && (*text != '0' || negative)) return false;
  ++text;
  takeZeroDecimals(text);
  return true;
}

bool takeIgnored(const char*& text, char separator) {
  const char* const begin = text;
  while (*text != separator && !isBlank(*text) && *text != '\n' && *text != '\r' && *text != '#') {
    ++text;
  }
  return text != begin;
}

/// Returns the complete lines at the beginning of a text.
std::string_view wholeLines(std::string_view text, bool ended) {
  return ended ? text : text.substr(0, text.rfind('\n') + 1);
}

/// Returns the different values of the camera's column, in natural order. A value that a thousandth
/// of the lines do not have is a damaged one: its lines are bad.
std::vector<std::string> camerasIn(const std::filesystem::path& file, const EventColumns& columns) {
  constexpr std::size_t kMost = 64;
  constexpr std::size_t kMaxValues = 1000;
  const auto naturally = [](const std::string& a, const std::string& b) {
    return std::make_pair(a.size(), a) < std::make_pair(b.size(), b);  // 2 before 10
  };
  std::map<std::string, std::uint64_t, decltype(naturally)> counts(naturally);
  const std::size_t column = columns.order.find('c');
  FileContent content(file);
  std::vector<char> block(kBlockBytes);
  auto last = counts.end();
  std::uint64_t most = 0;
  std::size_t carried = 0;
  std::uint64_t line_number = 0;
  for (bool ended = false; !ended && counts.size() <= kMaxValues;) {
    const std::size_t wanted = block.size() - carried;
    const std::size_t count = content.read(block.data() + carried, wanted);
    ended = count < wanted;
    const std::string_view text(block.data(), carried + count);
    std::string_view lines = wholeLines(text, ended);
    columns.table.makePlain(block.data(), block.data() + lines.size());
    carried = text.size() - lines.size();
    if (lines.empty()) break;  // the reader of events rejects so long a line
    while (!lines.empty()) {
      const std::string_view line = trimmed(takeLine(lines));
      if (++line_number <= columns.table.lines_before) continue;
      const auto fields = columns.table.fieldsOf(line);
      if (fields.size() != columns.order.size()) continue;
      if (last == counts.end() || fields[column] != last->first) {
        last = counts.try_emplace(std::string(fields[column])).first;
      }
      most = std::max(most, ++last->second);
    }
    std::copy(text.end() - static_cast<std::ptrdiff_t>(carried), text.end(), block.begin());
  }
  std::vector<std::string> cameras;
  for (const auto& [camera, count] : counts) {
    if (1000 * count >= most) cameras.push_back(camera);
  }
  if (cameras.size() > kMost || counts.size() > kMaxValues) {
    throw std::runtime_error(
        fmt::format("{}: column {}: over {} cameras: expected a column with the event's camera "
                    "(another column: --event-columns, - for one to ignore)",
                    file.string(), column + 1, kMost));
  }
  return cameras;
}

}  // namespace

EventTextStream::EventTextStream(std::filesystem::path file, const ReaderOptions& options,
                                 std::vector<std::string> cameras, std::size_t camera)
    : content_(std::move(file)),
      cameras_(std::move(cameras)),
      camera_(camera),
      block_(kFirstBytes) {
  carried_ = content_.read(block_.data(), kFirstBytes);
  ended_ = carried_ < kFirstBytes;
  const std::string_view first = withoutByteOrderMark({block_.data(), carried_});
  requireTextLines(first, name());
  columns_ = findEventColumns(std::string(wholeLines(first, ended_)), options, name());
  usual_ = columns_.isUsual();
}

bool EventTextStream::decode(std::vector<Event>& events) {
  events.clear();
  lines_.clear();
  if (started_ && ended_) return false;
  started_ = true;
  block_.resize(kBlockBytes);
  if (!ended_) {
    const std::size_t wanted = kBlockBytes - carried_;
    const std::size_t count = content_.read(block_.data() + carried_, wanted);
    ended_ = count < wanted;
    carried_ += count;
  }

  std::string_view text(block_.data(), carried_);
  if (first_byte_ == 0 && line_ == 0) text = withoutByteOrderMark(text);
  const std::size_t newline = text.rfind('\n');
  const std::size_t whole = newline == std::string_view::npos ? 0 : newline + 1;
  char* const begin = block_.data() + (text.data() - block_.data());
  columns_.table.makePlain(begin, begin + (ended_ ? text.size() : whole));
  takeLines(text.data(), text.data() + whole, events);
  carried_ = text.size() - whole;
  if (ended_ && carried_ > 0) {
    ++line_;
    takeLine(text.substr(whole), true, events);
  } else if (carried_ == kBlockBytes) {
    ++line_;
    throw std::runtime_error(fmt::format("{}: {}: expected t x y p, not a line of over {} bytes",
                                         place(line_), inQuotes(text), kBlockBytes));
  }
  std::copy(text.begin() + static_cast<std::ptrdiff_t>(whole), text.end(), block_.begin());
  return true;
}

void EventTextStream::takeLines(const char* begin, const char* end, std::vector<Event>& events) {
  assert(begin == end || end[-1] == '\n');
  lines_.emplace_back(events.size(), line_ + 1);
  Event event;
  bool of_camera = true;
  while (begin != end) {
    ++line_;
    if (const char* const next = parsePlainLine(begin, event, of_camera)) {
      if (of_camera) events.push_back(event);
      if (!of_camera) lines_.emplace_back(events.size(), line_ + 1);
      begin = next;
    } else {
      const char* const newline = std::find(begin, end, '\n');
      takeLine({begin, static_cast<std::size_t>(newline - begin)}, false, events);
      begin = newline + 1;
    }
  }
}

void EventTextStream::takeLine(std::string_view line, bool unterminated,
                               std::vector<Event>& events) {
  const bool header = first_byte_ == 0 && line_ <= columns_.table.lines_before;
  try {
    if (const auto event = header ? std::nullopt : parseLine(line, unterminated)) {
      events.push_back(*event);
      return;
    }
  } catch (const std::runtime_error& error) {
    if (bad_ == nullptr) throw;
    bad_->skip(error.what());
  }
  lines_.emplace_back(events.size(), line_ + 1);
}

/// Parses a plain line fast. Each step stops at the newline at the latest.
/// @return the next line; null if `parseLine` must parse this line.
const char* EventTextStream::parsePlainLine(const char* text, Event& event, bool& of_camera) const {
  if (usual_) {
    if (!takeTime(text, 9, event) || !takeBlanks(text) || !takePixel(text, event.x) ||
        !takeBlanks(text) || !takePixel(text, event.y) || !takeBlanks(text) ||
        !takePolarity(text, event.polarity)) {
      return nullptr;
    }
  } else {
    const int decimals_of_ns = 9 + columns_.time_exponent;
    for (std::size_t k = 0; k < columns_.order.size(); ++k) {
      if (k > 0 && !takeSeparator(text, columns_.table.separator)) return nullptr;
      const char column = columns_.order[k];
      const char* const begin = text;
      const bool taken = column == 't'   ? takeTime(text, decimals_of_ns, event)
                         : column == 'x' ? takePixel(text, event.x)
                         : column == 'y' ? takePixel(text, event.y)
                         : column == 'p' ? takePolarity(text, event.polarity)
                         : column == 'n' ? false
                                         : takeIgnored(text, columns_.table.separator);
      if (!taken) return nullptr;
      if (column != 'c') continue;
      const std::string_view camera(begin, static_cast<std::size_t>(text - begin));
      of_camera = isOfCamera(camera);
      if (!of_camera && !isLeft(camera)) return nullptr;
    }
  }
  if (*text == '\r') ++text;
  return *text == '\n' ? text + 1 : nullptr;
}

std::optional<Event> EventTextStream::parseLine(std::string_view line, bool unterminated) const {
  const std::string_view content = line.substr(0, line.find('#'));
  const std::vector<std::string_view> fields = columns_.table.fieldsOf(line);
  if (fields.empty()) return std::nullopt;
  const std::size_t camera = columns_.order.find('c');
  if (camera < fields.size() && !isOfCamera(fields[camera])) {
    if (isLeft(fields[camera])) return std::nullopt;
    throw std::runtime_error(fmt::format("{}: camera = {}: expected {}", place(line_),
                                         inQuotes(fields[camera]), fmt::join(cameras_, " or ")));
  }
  const auto names = [&] { return fmt::join(columns_.order, " "); };
  const std::size_t count = columns_.order.size();
  if (fields.size() != count && camera_ > 0) return std::nullopt;
  if (fields.size() < count && unterminated) {
    throw std::runtime_error(fmt::format("{}: {}: expected {}, but the file ends within the line",
                                         place(line_), inQuotes(content), names()));
  }
  if (fields.size() != count) {
    throw std::runtime_error(
        fmt::format("{}: {}: expected {} fields, {}, not {} ({})", place(line_), inQuotes(content),
                    count, names(), fields.size(),
                    fields.size() == 12 ? kPosesWithoutTimes
                    : columns_.table.separator == ',' && fields.size() == count + 1
                        ? "a decimal comma? Then semicolons between the fields; other columns: "
                          "--event-columns"
                        : "other columns: --event-columns, - for one to ignore"));
  }

  const auto fail = [&](const char* name, std::string_view value, const std::string& expected) {
    return std::runtime_error(
        fmt::format("{}: {} = {}: expected {}", place(line_), name, inQuotes(value), expected));
  };
  const auto field_of = [&](char column) { return fields[columns_.order.find(column)]; };
  const auto pixel_of = [&](const char* name) {
    const std::optional<double> number = parseFinite(field_of(name[0]));
    const auto pixel = number ? wholeNumber(*number, 0, 65'535) : std::nullopt;
    if (pixel) return static_cast<std::uint16_t>(*pixel);
    throw fail(name, field_of(name[0]),
               fmt::format("{} (columns in another order: --event-columns)",
                           expectedPixel(number.value_or(0))));
  };
  const std::string_view time = field_of('t');
  std::optional<std::int64_t> t_ns = parseTimeIn(time, columns_.time_exponent);
  if (const std::size_t n = columns_.order.find('n'); t_ns && n < fields.size()) {
    const auto part_ns = nanosecondsIn(time, fields[n], columns_.parts_exponent);
    if (!part_ns)
      throw fail("part of a second", fields[n], "less than a second, after whole seconds");
    *t_ns += *part_ns;
  }
  if (!t_ns || *t_ns >= kEndOfTimeNs || *t_ns <= -kEndOfTimeNs) {
    throw fail("t", time,
               columns_.time_exponent == 0 ? "a time in decimal seconds" : "a decimal time");
  }
  Event event;
  event.t_ns = *t_ns;
  event.x = pixel_of("x");
  event.y = pixel_of("y");
  const std::optional<int> polarity = polarityOf(field_of('p'));
  if (!polarity) {
    throw fail("p", field_of('p'),
               std::string(kExpectedPolarity) + " (columns in another order: --event-columns)");
  }
  event.polarity = *polarity == 1;
  return event;
}

/// Finds the first event in the lines that begin after a byte. @return the byte of its line and its
/// time; std::nullopt if the next bytes have no event.
std::optional<std::pair<std::uint64_t, std::int64_t>> EventTextStream::firstEventAfter(
    std::uint64_t byte) {
  std::array<char, 4096> bytes{};
  content_.seek(byte);
  const std::string_view text(bytes.data(), content_.read(bytes.data(), bytes.size()));
  columns_.table.makePlain(bytes.data(), bytes.data() + text.size());
  for (std::size_t begin = text.find('\n'); begin != std::string_view::npos;) {
    ++begin;
    const std::size_t newline = text.find('\n', begin);
    if (newline == std::string_view::npos) break;
    Event event;
    bool of_camera = true;
    if (parsePlainLine(text.data() + begin, event, of_camera) != nullptr) {
      if (of_camera) return std::pair(byte + begin, event.t_ns);
      begin = newline;
      continue;
    }
    try {
      const auto parsed = parseLine(text.substr(begin, newline - begin), false);
      if (parsed) return std::pair(byte + begin, parsed->t_ns);
    } catch (const std::runtime_error&) {
      return std::nullopt;  // `read` reports the error when it gets there
    }
    begin = newline;
  }
  return std::nullopt;
}

void EventTextStream::seek(std::int64_t t_ns) {
  constexpr std::uint64_t kCloseBytes = std::uint64_t{1} << 16;
  // An event that is over 10 ms older than an earlier event of the file is an error. So no event of
  // t_ns or later is before an event that is older than before_ns.
  const std::int64_t before_ns = t_ns - kMaxEventDelayNs;
  std::uint64_t low = 0;
  std::uint64_t high = content_.seekableBytes();
  if (high <= kFirstBytes) return;
  while (high > low + kCloseBytes) {
    const std::uint64_t middle = low + (high - low) / 2;
    const auto event = firstEventAfter(middle);
    if (event && event->second < before_ns) {
      low = event->first;
    } else {
      high = middle;
    }
  }
  content_.seek(low);
  carried_ = 0;
  ended_ = false;
  first_byte_ = low;
}

std::string EventTextStream::positionOf(std::size_t index) const {
  const auto after =
      std::upper_bound(lines_.begin(), lines_.end(), index,
                       [](std::size_t i, const auto& entry) { return i < entry.first; });
  const auto& [first, line] = *std::prev(after);
  return place(line + (index - first));
}

std::string EventTextStream::commandInOrder() const {
  const std::size_t column = columns_.order.find('t') + 1;
  const bool plain = content_.seekableBytes() > 0;
  const std::string separator =
      columns_.table.separator == ' ' ? "" : fmt::format(" -t'{}'", columns_.table.separator);
  const std::string sort = fmt::format("sort{} -g -k{},{} -s", separator, column, column);
  if (columns_.table.lines_before == 0) {
    return plain ? sort + " FILE >NEW" : "zcat FILE | " + sort + " >NEW";
  }
  return fmt::format("({} FILE | head -n {}; {} FILE | tail -n +{} | {}) >NEW",
                     plain ? "cat" : "zcat", columns_.table.lines_before, plain ? "cat" : "zcat",
                     columns_.table.lines_before + 1, sort);
}

std::string EventTextStream::commandOfCamera() const {
  const std::size_t column = columns_.order.find('c') + 1;
  const auto isPlain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' || c == '-';
  };
  std::string camera;  // quotes, blanks and CR are hard to write in a command
  std::copy_if(cameras_[camera_].begin(), cameras_[camera_].end(), std::back_inserter(camera),
               isPlain);
  const bool plain = content_.seekableBytes() > 0;
  return fmt::format(
      "{} has the events of several cameras in column {}; one alone: {}awk{} '{{c = ${}; "
      "gsub(/[^a-zA-Z0-9._-]/, \"\", c)}} NR <= {} || c == \"{}\"'{} >NEW",
      name(), column, plain ? "" : "zcat FILE | ",
      columns_.table.separator == ' ' ? "" : fmt::format(" -F'{}'", columns_.table.separator),
      column, columns_.table.lines_before, camera, plain ? " FILE" : "");
}

std::string EventTextStream::place(std::uint64_t line) const {
  if (first_byte_ == 0) return fmt::format("{}:{}", name(), line);
  return fmt::format("{}: line {} after byte {}", name(), line, first_byte_);
}

std::string beginningOfText(const std::filesystem::path& file) {
  constexpr std::size_t kBytes = 4096;
  const std::string bytes = firstContentOf(file, kBytes);
  const std::string_view text = withoutByteOrderMark(bytes);
  requireTextLines(text, file.string());
  return std::string(wholeLines(text, bytes.size() < kBytes));
}

bool looksLikeEventText(const std::filesystem::path& file, const ReaderOptions& options) {
  try {
    return isFile(file) && looksLikeEventLines(beginningOfText(file), options.columns);
  } catch (const std::exception&) {
    return false;
  }
}

std::vector<std::unique_ptr<EventTextStream>> openEventText(const std::filesystem::path& file,
                                                            const ReaderOptions& options) {
  std::vector<std::unique_ptr<EventTextStream>> streams;
  streams.push_back(std::make_unique<EventTextStream>(file, options));
  const EventColumns& columns = streams.front()->columns();
  if (columns.order.find('c') == std::string::npos) return streams;
  const std::vector<std::string> cameras = camerasIn(file, columns);
  if (cameras.size() > 1) streams.clear();
  for (std::size_t i = 0; streams.size() < cameras.size(); ++i) {
    streams.push_back(std::make_unique<EventTextStream>(file, options, cameras, i));
  }
  return streams;
}

RecordingParts openEventText(const std::vector<std::filesystem::path>& files,
                             const ReaderOptions& options) {
  RecordingParts parts;
  for (const std::filesystem::path& file : files) {
    auto streams = openEventText(file, options);
    if (streams.size() > 1) parts.one_camera = streams.front()->commandOfCamera();
    for (auto& stream : streams) parts.cameras.push_back(std::move(stream));
  }
  return parts;
}

std::filesystem::path eventFileIn(const std::filesystem::path& folder) {
  for (const char* name :
       {"events.txt", "events.csv", "events.txt.gz", "events.csv.gz", "events.zip"}) {
    if (isFile(folder / name)) return folder / name;
  }
  return folder / "events.txt";
}

}  // namespace efm
