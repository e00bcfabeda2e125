// Role: offline; a run folder -> report.html. Used by apps, session, python.
// Source: the paper's figures of closed-loop runs: peak and volume temperature, power, absorption.
// Differences: all four in one report, with limits, uncertainty and a textual summary.
// Units: as in the run folder; on the page every number carries its unit.
// Real-time promise: none (reads files, allocates). Threads: none.
#pragma once

#include <filesystem>

namespace photocoag {

/// Reads config.toml, run.csv, summary.json and, if there, field.vtr of `run_folder` and writes
/// report.html there.
///
/// The page is one self-contained file with one script of its own, without which it shows the same;
/// for phone, desktop and print, light and dark. The same folder gives the same bytes. An existing
/// report.html is replaced at the end, never left half-written. Columns `_true` that are empty (eye
/// not simulated) are left out.
/// Throws Error: a file missing or malformed (file, line, column or key), the report cannot be
/// written. Tests: tests/report/report_test.cpp.
void write_report(const std::filesystem::path& run_folder);

}  // namespace photocoag
