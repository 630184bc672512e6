// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <string>
#include <vector>

namespace efm {

/// Checks of an option's value. Their errors show the value and say what was expected.

CLI::Validator oneOf(const std::vector<std::string>& names);
CLI::Validator aboveZero();
CLI::Validator zeroOrMore();

/// The error of a wrong command line: one sentence that names what the user typed.
/// @param app has parsed the command line.
std::string errorText(const CLI::App& app, const CLI::ParseError& error);

}  // namespace efm
