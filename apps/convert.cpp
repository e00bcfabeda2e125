// `photocoag convert`: exports a run's log for other programs, or recovers a run folder from it.
#include <fmt/format.h>

#include <filesystem>

#include "command.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/report/report.hpp"
#include "photocoag/run/recover.hpp"
#include "photocoag/run_files/table.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

struct ConvertOptions {
  std::vector<std::string> paths;  ///< run folder, or log segments
  std::string csv;                 ///< file; - is standard output
  std::string hdf5;
  std::string mat;
  std::string mcap;
  bool recover = false;  ///< run.csv, summary.json and report.html of a run that ended early
};

void recover(const fs::path& folder) {
  const LogContent log = recover_run(folder);
  for (const std::string& remark : log.remarks) say("remark    {}\n", remark);
  say("recovered {} cycles of {} planned; the log was {}\n", log.records.size(),
      log.header.planned_cycles, log.closed ? "closed" : "not closed");
  write_report(folder);
  say("report    {}\n", (folder / "report.html").string());
}

DataTable table_of_paths(const std::vector<std::string>& paths) {
  std::vector<fs::path> segments;
  for (const std::string& path : paths) {
    if (!fs::is_directory(path)) {
      segments.emplace_back(path);
      continue;
    }
    const std::vector<fs::path> found = segments_of(path);
    segments.insert(segments.end(), found.begin(), found.end());
    if (found.empty()) {
      if (paths.size() == 1) return table_of_csv(fs::path(path) / "run.csv");
      throw Error(ErrorParts{.where = path, .problem = "there is no log segment"});
    }
  }
  const LogContent log = read_segments(segments);
  for (const std::string& remark : log.remarks) say("remark    {}\n", remark);
  DataTable table = table_of(log);
  const fs::path run = fs::path(paths.front()) / "run.csv";
  if (paths.size() == 1 && fs::exists(run)) add_truth(table, table_of_csv(run));
  return table;
}

int convert_command(const ConvertOptions& options) {
  if (options.recover) {
    if (options.paths.size() != 1 || !fs::is_directory(options.paths.front())) {
      throw Error(ErrorParts{.where = "--recover",
                             .found = fmt::format("{} paths", options.paths.size()),
                             .accepted = "one run folder"});
    }
    recover(options.paths.front());
  }
  if (options.csv.empty() && options.hdf5.empty() && options.mat.empty() && options.mcap.empty()) {
    if (options.recover) return 0;
    throw Error(ErrorParts{.where = "convert",
                           .problem = "nothing to write",
                           .accepted = "--csv, --hdf5, --mat, --mcap or --recover"});
  }
  const DataTable table = table_of_paths(options.paths);
  if (!options.csv.empty()) write_output(options.csv, csv_text(table));
  if (!options.hdf5.empty()) write_hdf5(options.hdf5, table);
  if (!options.mat.empty()) write_mat(options.mat, table);
  if (!options.mcap.empty()) write_mcap(options.mcap, table);
  say("{} cycles, {} columns\n", table.rows(), table.columns.size());
  return 0;
}

const Command kConvert(
    "convert",
    "convert the log of a run to CSV, HDF5, MAT or MCAP, or recover the run folder of a program "
    "that ended early",
    convert_command, [](CommandLine& command, ConvertOptions& options) {
      command.add_option("RUN", options.paths, "run folder, or log segments (*.seg)")
          .required()
          .type_name("RUN|SEGMENT...");
      command.add_option("--csv", options.csv, "CSV file to write; - is standard output")
          .type_name("FILE");
      command.add_option("--hdf5", options.hdf5, "HDF5 file to write").type_name("FILE");
      command.add_option("--mat", options.mat, "MAT file to write").type_name("FILE");
      command.add_option("--mcap", options.mcap, "MCAP file to write").type_name("FILE");
      command.add_flag("--recover", options.recover,
                       "write run.csv, summary.json and report.html from the log");
      command.footer(
          footer("  photocoag convert runs/first --hdf5 first.h5 --mat first.mat\n"
                 "  photocoag convert runs/first --mcap first.mcap\n"
                 "  photocoag convert runs/first/log/000000.seg --csv -\n"
                 "  photocoag convert runs/killed --recover\n"
                 "A run of `simulate` has no log: its run.csv is converted."));
    });

}  // namespace

}  // namespace photocoag
