// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/argument_checks.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <optional>

#include "mapping/base/named_choice.h"
#include "mapping/base/text.h"

namespace efm {
namespace {

template <typename Holds>
CLI::Validator numberThat(const Holds& holds, const char* expected) {
  return {[=](std::string& text) {
            const std::optional<double> number = parseFinite(text);
            if (number && holds(*number)) return std::string();
            return fmt::format("{}: expected {}", inQuotes(text), expected);
          },
          ""};
}

/// The command that the words of the command line chose: "event-fusion evaluate depth".
const CLI::App& chosenCommand(const CLI::App& app, std::string& path) {
  path = app.get_name();
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
    path += " " + command->get_name();
  }
  return *command;
}

std::vector<std::string> commandsOf(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(command->get_name());
  }
  return names;
}

std::vector<std::string> optionsOf(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

/// The error for a word of the command line that no option took.
std::string extraText(const CLI::App& command, const std::string& path, const std::string& word) {
  if (word.front() == '-' && word.size() > 1) {
    const std::string name = word.substr(0, word.find('='));
    const auto near = nearestName(name, optionsOf(command));
    return near ? fmt::format("{}: unknown option: did you mean {}?", printable(name), *near)
                : fmt::format("{}: unknown option; {} --help lists all", printable(name), path);
  }
  const std::vector<std::string> commands = commandsOf(command);
  if (commands.empty()) {
    return fmt::format("{}: one word too many; see {} --help", inQuotes(word), path);
  }
  return fmt::format("{}: unknown command: {}", inQuotes(word), expectedName(word, commands));
}

}  // namespace

CLI::Validator oneOf(const std::vector<std::string>& names) {
  return {[names](std::string& text) {
            for (const std::string& name : names) {
              if (name == text) return std::string();
            }
            return inQuotes(text) + ": " + expectedName(text, names);
          },
          fmt::format("{{{}}}", fmt::join(names, ","))};
}

CLI::Validator aboveZero() {
  return numberThat([](double number) { return number > 0; }, "a number above 0");
}

CLI::Validator zeroOrMore() {
  return numberThat([](double number) { return number >= 0; }, "a number, 0 or more");
}

std::string errorText(const CLI::App& app, const CLI::ParseError& error) {
  std::string path;
  const CLI::App& command = chosenCommand(app, path);
  const bool wrong_value = dynamic_cast<const CLI::ValidationError*>(&error) != nullptr ||
                           dynamic_cast<const CLI::ConversionError*>(&error) != nullptr ||
                           dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr;
  // A mistyped name is the cause of what is missing.
  const std::vector<std::string> extras = app.remaining(true);
  if (!wrong_value && !extras.empty()) return extraText(command, path, extras.front());
  const std::vector<std::string> commands = commandsOf(command);
  if (!wrong_value && !commands.empty()) {
    return fmt::format("no command: expected one of {}", fmt::join(commands, ", "));
  }
  const std::string text = error.what();
  const std::string conversion = "Could not convert: ";
  if (text.compare(0, conversion.size(), conversion) == 0) {  // only numbers are converted
    return text.substr(conversion.size()) + ": expected a number";
  }
  const std::size_t repeated = text.find(": At Most 1 required but received ");
  if (repeated != std::string::npos) {
    return text.substr(0, repeated) + ": given more than once: expected it once";
  }
  return wrong_value ? text : text + "; see " + path + " --help";
}

}  // namespace efm
