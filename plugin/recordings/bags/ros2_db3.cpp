// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/bags/bag_source.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <limits>
#include <stdexcept>
#include <system_error>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// A query whose rows are read one by one.
class SqlQuery {
 public:
  SqlQuery(sqlite3* database, const std::string& file, const char* sql)
      : database_(database), file_(file), statement_(nullptr, &sqlite3_finalize) {
    sqlite3_stmt* statement = nullptr;
    const int status = sqlite3_prepare_v2(database, sql, -1, &statement, nullptr);
    statement_.reset(statement);
    if (status != SQLITE_OK) fail("expected the tables of a ROS 2 bag");
  }

  SqlQuery& bind(int parameter, std::int64_t value) {
    sqlite3_bind_int64(statement_.get(), parameter, value);
    return *this;
  }
  bool next() {
    const int status = sqlite3_step(statement_.get());
    if (status != SQLITE_ROW && status != SQLITE_DONE) fail("expected a whole database");
    return status == SQLITE_ROW;
  }
  std::int64_t number(int column) const { return sqlite3_column_int64(statement_.get(), column); }
  std::string text(int column) const {
    const auto* const text = sqlite3_column_text(statement_.get(), column);
    return text == nullptr ? std::string() : reinterpret_cast<const char*>(text);
  }
  std::pair<const std::uint8_t*, std::size_t> bytes(int column) const {
    const auto* const data =
        static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_.get(), column));
    return {data, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
  }

 private:
  [[noreturn]] void fail(const char* expected) const {
    throw std::runtime_error(
        fmt::format("{}: SQLite: {}: {}", file_, sqlite3_errmsg(database_), expected));
  }

  sqlite3* database_;
  const std::string& file_;
  std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> statement_;
};

/// Returns the log time in the first column of a row.
std::int64_t logTime(const SqlQuery& row) {
  return std::clamp(row.number(0), -kEndOfTimeNs, kEndOfTimeNs);
}

class Db3Bag : public BagSource {
 public:
  explicit Db3Bag(std::filesystem::path file)
      : BagSource(std::move(file)),
        name_(this->file().string()),
        database_(nullptr, &sqlite3_close) {
    open();
    // Views are not accepted: a view could be an endless query.
    SqlQuery tables(database_.get(), name_,
                    "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND rootpage > 0 AND "
                    "name IN ('topics', 'messages')");
    if (!tables.next() || tables.number(0) != 2) {
      throw std::runtime_error(
          fmt::format("{}: expected the tables `topics` and `messages` of a ROS 2 bag", name_));
    }
    SqlQuery topics(database_.get(), name_,
                    "SELECT id, name, type, serialization_format FROM topics ORDER BY id");
    while (topics.next()) {
      const std::string format = topics.text(3);
      if (format != "cdr") continue;
      const BagTopic topic = {topics.text(1), typeWithoutMsg(topics.text(2))};
      if (addTopic(topic) == ids_.size()) ids_.push_back(topics.number(0));
    }
    // Two queries: SQLite takes each result from its index.
    SqlQuery first(database_.get(), name_, "SELECT min(timestamp) FROM messages");
    SqlQuery last(database_.get(), name_, "SELECT max(timestamp) FROM messages");
    if (first.next() && last.next()) setLogTimes(logTime(first), logTime(last));
  }

  BagCursor messages(std::size_t topic, std::int64_t from_log_ns) override;
  void countMessages() override;

 private:
  void open();

  std::string name_;
  std::unique_ptr<sqlite3, decltype(&sqlite3_close)> database_;
  std::vector<std::int64_t> ids_;  // the topics' ids in the database
};

void Db3Bag::open() {
  // If there is no journal, SQLite need not create files beside the bag, which may be on a
  // read-only disk. A journal has the end of a recording that was cut off.
  std::error_code ignored;
  const bool journal = std::filesystem::exists(name_ + "-wal", ignored);
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(file()).string()) {
    const bool special = c == '%' || c == '?' || c == '#';
    uri += special ? fmt::format("%{:02x}", c) : std::string(1, c);
  }
  if (!journal) uri += "?immutable=1";
  sqlite3* database = nullptr;
  const int status =
      sqlite3_open_v2(uri.c_str(), &database, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
  database_.reset(database);
  if (status != SQLITE_OK) {
    throw std::runtime_error(fmt::format("{}: SQLite: {}: expected a database of a ROS 2 bag",
                                         name_, sqlite3_errstr(status)));
  }
  // No value is longer than the file.
  const std::uintmax_t size = std::filesystem::file_size(file());
  sqlite3_limit(database, SQLITE_LIMIT_LENGTH,
                static_cast<int>(std::min<std::uintmax_t>(size, std::numeric_limits<int>::max())));
}

/// Messages come in the order of their ids, as they were recorded. Reading by time would jump.
BagCursor Db3Bag::messages(std::size_t topic, std::int64_t from_log_ns) {
  std::int64_t first_id = std::numeric_limits<std::int64_t>::min();
  if (from_log_ns > firstLogNs()) {
    SqlQuery query(database_.get(), name_,
                   "SELECT id FROM messages WHERE timestamp >= ? ORDER BY timestamp LIMIT 1");
    first_id = query.bind(1, from_log_ns).next() ? query.number(0)
                                                 : std::numeric_limits<std::int64_t>::max();
  }
  auto query = std::make_shared<SqlQuery>(
      database_.get(), name_,
      "SELECT timestamp, data FROM messages WHERE id >= ? AND topic_id = ? ORDER BY id");
  query->bind(1, first_id).bind(2, ids_[topic]);
  return [query, ended = false](BagMessage& message) mutable {
    ended = ended || !query->next();
    if (ended) return false;
    const auto [data, size] = query->bytes(1);
    message = {logTime(*query), data, size, true};
    return true;
  };
}

/// Reads the head of each message.
void Db3Bag::countMessages() {
  SqlQuery query(database_.get(), name_,
                 "SELECT min(timestamp), max(timestamp), count(*), topic_id FROM messages GROUP BY "
                 "topic_id");
  while (query.next()) {
    const auto id = std::find(ids_.begin(), ids_.end(), query.number(3));
    if (id == ids_.end()) continue;
    topic(static_cast<std::size_t>(id - ids_.begin()))
        .add(static_cast<std::uint64_t>(query.number(2)), logTime(query), query.number(1));
  }
}

}  // namespace

std::unique_ptr<BagSource> openDb3(const std::filesystem::path& file) {
  return std::make_unique<Db3Bag>(file);
}

}  // namespace efm
