// `photocoag export`: the full-order model as Matrix Market files, with its outputs for the
// validation powers, so that other programs can reduce it and measure their errors.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/fom/sparse_system.hpp"
#include "photocoag/mor/reduce.hpp"
#include "photocoag/run/run_folder.hpp"

namespace photocoag {
namespace {

struct ExportOptions : CommonOptions {
  std::string out;                         ///< folder, new or empty
  std::vector<double> absorption_factors;  ///< columns of B
};

namespace fs = std::filesystem;
using Eigen::Index;

// The change of coordinates leaves rounding errors where there is no light.
constexpr double kRounding = 1e-13;

std::string matrix_market(std::string_view kind, Index rows, Index columns, std::size_t entries,
                          const std::string& body) {
  return fmt::format("%%MatrixMarket matrix coordinate real {}\n{} {} {}\n{}", kind, rows, columns,
                     entries, body);
}

std::string symmetric_matrix(const Eigen::SparseMatrix<double>& matrix) {
  std::string body;
  std::size_t entries = 0;
  for (Index column = 0; column < matrix.outerSize(); ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(matrix, column); it; ++it) {
      if (it.row() < it.col()) continue;
      fmt::format_to(std::back_inserter(body), "{} {} {}\n", it.row() + 1, it.col() + 1,
                     it.value());
      ++entries;
    }
  }
  return matrix_market("symmetric", matrix.rows(), matrix.cols(), entries, body);
}

std::string diagonal_matrix(const Eigen::VectorXd& diagonal) {
  std::string body;
  for (Index i = 0; i < diagonal.size(); ++i) {
    fmt::format_to(std::back_inserter(body), "{} {} {}\n", i + 1, i + 1, diagonal[i]);
  }
  return matrix_market("symmetric", diagonal.size(), diagonal.size(),
                       static_cast<std::size_t>(diagonal.size()), body);
}

// Vectors as columns, or as rows.
std::string thin_matrix(const std::vector<Eigen::VectorXd>& vectors, bool as_rows) {
  std::string body;
  std::size_t entries = 0;
  for (std::size_t k = 0; k < vectors.size(); ++k) {
    const double least = kRounding * vectors[k].cwiseAbs().maxCoeff();
    for (Index i = 0; i < vectors[k].size(); ++i) {
      if (std::abs(vectors[k][i]) <= least) continue;
      const auto cell = static_cast<std::size_t>(i);
      fmt::format_to(std::back_inserter(body), "{} {} {}\n", (as_rows ? k : cell) + 1,
                     (as_rows ? cell : k) + 1, vectors[k][i]);
      ++entries;
    }
  }
  const Index length = vectors.front().size();
  const auto count = static_cast<Index>(vectors.size());
  return matrix_market("general", as_rows ? count : length, as_rows ? length : count, entries,
                       body);
}

std::string validation_csv(const ValidationRun& run, double period) {
  std::string csv = "signal,time_s,power_W";
  for (const char* output : {"peak", "volume"}) {
    for (const AbsorptionFactors& at : run.factors) {
      fmt::format_to(std::back_inserter(csv), ",{}_K_alpha_{}", output, at.alpha);
    }
  }
  csv += '\n';
  const std::size_t count = run.factors.size();
  for (std::size_t s = 0; s < run.powers.size(); ++s) {
    for (std::size_t k = 0; k < run.powers[s].size(); ++k) {
      fmt::format_to(std::back_inserter(csv), "{},{},{}", s == 0 ? "constant" : "on-off",
                     static_cast<double>(k + 1) * period, run.powers[s][k]);
      const Outputs* outputs = &run.outputs[s][k * count];
      for (std::size_t a = 0; a < count; ++a) {
        fmt::format_to(std::back_inserter(csv), ",{}", outputs[a].peak);
      }
      for (std::size_t a = 0; a < count; ++a) {
        fmt::format_to(std::back_inserter(csv), ",{}", outputs[a].volume);
      }
      csv += '\n';
    }
  }
  return csv;
}

int export_command(const ExportOptions& options) {
  const Config config = configured(Use::kExport, options.config, options.set);
  for (const double alpha : options.absorption_factors) {
    if (!(alpha > 0.0 && alpha <= 10.0)) {
      throw Error(ErrorParts{.where = "--alphas",
                             .found = fmt::format("{}", alpha),
                             .accepted = "absorption factors above 0, at most 10"});
    }
  }
  const fs::path folder = options.out;
  check_run_folder(folder);
  const auto full = std::make_shared<const FullOrderModel>(config.tissue, config.grid);
  const SparseSystem system = assemble_sparse_system(*full);
  const double beta = config.plant.choroid_factor;
  std::vector<Eigen::VectorXd> inputs;
  std::vector<Eigen::VectorXd> outputs = {peak_of_cells(*full)};
  for (const double alpha : options.absorption_factors) {
    inputs.emplace_back(system.E.cwiseProduct(input_of_cells(*full, {alpha, beta})));
    outputs.push_back(volume_of_cells(*full, {alpha, beta}));
  }
  ValidationSettings validation;
  validation.absorption_factors = options.absorption_factors;
  validation.choroid_factors = {beta};
  const ValidationRun run =
      validation_run(full, config.model.discretization, config.control.period, validation);

  const ClaimedFolder claimed = open_run_folder(folder, config);
  write_file(folder / "E.mtx", diagonal_matrix(system.E));
  write_file(folder / "A.mtx", symmetric_matrix(system.A));
  write_file(folder / "B.mtx", thin_matrix(inputs, false));
  write_file(folder / "C.mtx", thin_matrix(outputs, true));
  write_file(folder / "validation.csv", validation_csv(run, config.control.period));
  say("photocoag {}: {}\nE x' = A x + B u, y = C x in Matrix Market format: {} states; "
      "columns of B: alpha = {};\nrows of C: peak, then the volume temperature of each "
      "alpha\nwritten   {}\n",
      version(), kResearchNotice, full->states(), fmt::join(options.absorption_factors, ", "),
      folder.string());
  return 0;
}

const Command kExport(
    "export", "write the full-order model as sparse matrices (Matrix Market), for other programs",
    export_command, [](CommandLine& command, ExportOptions& options) {
      add_common(command, options);
      command.add_option("--out", options.out, "folder, new or empty").required().type_name("DIR");
      command
          .add_text(
              "--alphas",
              [&options](const std::string& text) {
                options.absorption_factors = number_list("--alphas", text, 0.0, 10.0);
              },
              "absorption factors of the columns of B and the rows of C, comma-separated")
          .required()
          .type_name("a1,a2,...");
      command.footer(
          footer("  photocoag export --alphas 0.5,0.7363,1.1 --out matrices\n"
                 "Writes E.mtx, A.mtx, B.mtx, C.mtx, and validation.csv: the powers that reduce\n"
                 "measures errors with and the full-order model's temperatures for them."));
    });

}  // namespace

}  // namespace photocoag
