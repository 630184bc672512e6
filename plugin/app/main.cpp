// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/program.h"

int main(int argc, char** argv) { return efm::runProgram(argc, argv); }
