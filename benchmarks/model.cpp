// `./photocoag bench model`: what a step of the full-order model costs, against one sparse Cholesky
// solve of the same implicit Euler system, interleaved; and how reduction time, step time and
// memory grow with the number of cells. Research software, not a medical device.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <functional>
#include <memory>
#include <span>
#include <string_view>

#include "cholesky.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/fom/layered_stepper.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/mor/reduce.hpp"
#include "samples.hpp"

namespace photocoag::benchmarks {
namespace {

constexpr double kAlpha = 0.7363;
constexpr std::size_t kCells = 80000;  // the paper's more than 80,000

double seconds_of(const std::function<void()>& work) {
  Samples samples;
  samples.time(work);
  return samples.first() * 1e-6;
}

// ---- against sparse Cholesky ----------------------------------------------------------------

struct Alternative {
  std::string name;
  std::function<void(const Eigen::VectorXd&, Eigen::VectorXd&)> solve;
  double factorize_s = 0.0;
  double factor_entries = 0.0;
  Samples samples = {};
  double difference = 0.0;  // of the temperatures, relative to the highest
};

template <typename Solver, typename... Options>
Alternative alternative(std::string name, const Eigen::SparseMatrix<double>& matrix,
                        Options... options) {
  std::shared_ptr<Solver> solver;
  const double seconds = seconds_of([&] { solver = std::make_shared<Solver>(matrix, options...); });
  return {.name = std::move(name),
          .solve = [solver](const Eigen::VectorXd& right,
                            Eigen::VectorXd& solution) { solver->solve(right, solution); },
          .factorize_s = seconds,
          .factor_entries = solver->factor_entries()};
}

std::vector<Alternative> alternatives(const Eigen::SparseMatrix<double>& matrix) {
  std::vector<Alternative> all;
  all.push_back(alternative<EigenCholesky>("Eigen SimplicialLDLT", matrix));
#ifdef PHOTOCOAG_HAVE_CHOLMOD
  all.push_back(alternative<CholmodCholesky>("CHOLMOD, simplicial", matrix, false));
  all.push_back(alternative<CholmodCholesky>("CHOLMOD, supernodal", matrix, true));
#endif
  return all;
}

// Power switched on and off: every step differs from the one before.
double power_of(int step) { return step % 7 < 4 ? 0.03 : 0.0; }

void print_row(std::string_view name, const Samples& s, const std::string& rest) {
  fmt::print(stderr, "{:<40} {:9.1f} {:9.1f} {:9.1f} {:9.1f}  {}\n", name, s.median(), s.p99(),
             s.max(), s.first(), rest);
}

Json compare_steps(const std::shared_ptr<const FullOrderModel>& full, const SparseSystem& system,
                   double period) {
  constexpr int kChecked = 25;
  constexpr int kRounds = 100;
  constexpr int kOwnSteps = 20;  // per round and solve
  const Eigen::VectorXd input = input_of_cells(*full, kAlpha);
  std::vector<Alternative> others = alternatives(implicit_euler_matrix(system, period));

  ModalStepper exact(full, Discretization::kZeroOrderHold, period);
  ModalStepper euler(full, Discretization::kImplicitEuler, period);
  for (int k = 0; k < kChecked; ++k) euler.step(power_of(k));
  const Eigen::VectorXd reference = euler.temperatures(kAlpha).reshaped();
  const auto right_side = [&](const Eigen::VectorXd& temperatures, int step) {
    return Eigen::VectorXd(system.E.cwiseProduct(temperatures + period * power_of(step) * input));
  };
  for (Alternative& other : others) {
    Eigen::VectorXd temperatures = Eigen::VectorXd::Zero(input.size());
    for (int k = 0; k < kChecked; ++k) other.solve(right_side(temperatures, k), temperatures);
    other.difference =
        (temperatures - reference).cwiseAbs().maxCoeff() / reference.cwiseAbs().maxCoeff();
  }

  Samples exact_samples;
  Samples exact_cold;
  Samples euler_samples;
  const Eigen::VectorXd right = right_side(reference, 0);
  Eigen::VectorXd solution;
  for (int round = 0; round < kRounds; ++round) {
    for (Alternative& other : others) {
      other.samples.time([&] { other.solve(right, solution); });
      for (int k = 0; k < kOwnSteps; ++k) {
        // A solve leaves nothing of ours in the caches: the first step after it stands apart.
        (k == 0 ? exact_cold : exact_samples).time([&] { exact.step(power_of(round + k)); });
      }
      euler_samples.time([&] { euler.step(power_of(round)); });
    }
  }

  fmt::print(stderr, "\nOne step of {:g} ms, {} states, us\n", period * 1e3, full->states());
  fmt::print(stderr, "{:<40} {:>9} {:>9} {:>9} {:>9}  {}\n", "", "median", "99 %", "max", "first",
             "median / ours");
  print_row("ours, exact zero-order hold", exact_samples,
            fmt::format("{} of the modes have memory", exact.active_modes()));
  print_row("  the same, caches cold", exact_cold, "");
  print_row("ours, implicit Euler", euler_samples, "");
  Json rows = Json::array({exact_samples.json("ours, exact zero-order hold"),
                           exact_cold.json("ours, exact zero-order hold, caches cold"),
                           euler_samples.json("ours, implicit Euler")});
  for (const Alternative& other : others) {
    const double ratio = other.samples.median() / exact_samples.median();
    print_row("solve, " + other.name, other.samples,
              fmt::format("{:.0f} (cold {:.0f}, implicit Euler {:.0f})", ratio,
                          other.samples.median() / exact_cold.median(),
                          other.samples.median() / euler_samples.median()));
    Json row = other.samples.json("one solve, " + other.name);
    row["ratio_to_exact"] = ratio;
    row["ratio_to_exact_cold"] = other.samples.median() / exact_cold.median();
    row["ratio_to_implicit_euler"] = other.samples.median() / euler_samples.median();
    row["factorize_s"] = other.factorize_s;
    row["factor_entries"] = other.factor_entries;
    row["difference_of_temperatures"] = other.difference;
    rows.push_back(row);
  }
  for (const Alternative& other : others) {
    fmt::print(stderr,
               "{:<20} factorised in {:.2f} s, {:.1f} million entries; after {} steps the "
               "temperatures differ from ours (implicit Euler) by {:.1e} of the highest\n",
               other.name, other.factorize_s, other.factor_entries * 1e-6, kChecked,
               other.difference);
  }
#ifndef PHOTOCOAG_HAVE_CHOLMOD
  fmt::print(stderr, "CHOLMOD              not measured: libsuitesparse-dev is not installed\n");
#endif
  return {{"period_ms", period * 1e3},
          {"states", full->states()},
          {"modes_with_memory", exact.active_modes()},
          {"rows", rows}};
}

// ---- layered tissue -------------------------------------------------------------------------

// Conductivity, heat capacity and perfusion of their own in some layers.
Tissue layered_tissue() {
  Tissue tissue;
  tissue.layers[0].conductivity = 0.57;
  tissue.layers[3].conductivity = 0.53;
  tissue.layers[3].heat_capacity = 3840.0;
  tissue.layers[3].perfusion = 2e5;
  tissue.layers[4].conductivity = 0.58;
  return tissue;
}

Json compare_layered_steps() {
  constexpr double kPeriod = 1e-3;
  constexpr int kChecked = 25;
  constexpr int kRounds = 100;
  const auto full =
      std::make_shared<const FullOrderModel>(layered_tissue(), GridSettings{.min_cells = kCells});
  const SparseSystem system = assemble_sparse_system(*full);
  const Eigen::VectorXd input = input_of_cells(*full, kAlpha);
  Alternative solve =
      alternative<EigenCholesky>("Eigen SimplicialLDLT", implicit_euler_matrix(system, kPeriod));
  LayeredStepper euler(full, Discretization::kImplicitEuler, kPeriod, kAlpha);
  LayeredStepper second(full, Discretization::kTrBdf2, kPeriod, kAlpha);
  LayeredStepper exact(full, Discretization::kZeroOrderHold, kPeriod, kAlpha);
  Eigen::VectorXd temperatures = Eigen::VectorXd::Zero(input.size());
  for (int k = 0; k < kChecked; ++k) {
    euler.step(power_of(k));
    solve.solve(system.E.cwiseProduct(temperatures + kPeriod * power_of(k) * input), temperatures);
  }
  const Eigen::VectorXd own = euler.temperatures().reshaped();
  solve.difference = (temperatures - own).cwiseAbs().maxCoeff() / own.cwiseAbs().maxCoeff();
  Samples euler_samples;
  Samples second_samples;
  Samples exact_samples;
  Eigen::VectorXd solution;
  for (int round = 0; round < kRounds; ++round) {
    solve.samples.time([&] { solve.solve(temperatures, solution); });
    for (int k = 0; k < 5; ++k) {
      euler_samples.time([&] { euler.step(power_of(round + k)); });
      second_samples.time([&] { second.step(power_of(round + k)); });
      exact_samples.time([&] { exact.step(power_of(round + k)); });
    }
  }
  fmt::print(stderr, "\nOne step of 1 ms, layers and perfusion, {} states, us\n", full->states());
  print_row("ours, implicit Euler", euler_samples, "");
  print_row("ours, TR-BDF2", second_samples, "");
  print_row("ours, zero-order hold", exact_samples, "");
  print_row("solve, " + solve.name, solve.samples,
            fmt::format("{:.0f} times ours; temperatures differ by {:.1e}",
                        solve.samples.median() / euler_samples.median(), solve.difference));
  Json row = solve.samples.json("one solve, " + solve.name);
  row["ratio_to_implicit_euler"] = solve.samples.median() / euler_samples.median();
  row["difference_of_temperatures"] = solve.difference;
  return {{"period_ms", kPeriod * 1e3},
          {"states", full->states()},
          {"rows", Json::array({euler_samples.json("ours, implicit Euler"),
                                second_samples.json("ours, TR-BDF2"),
                                exact_samples.json("ours, zero-order hold"), row})}};
}

// ---- growth with n --------------------------------------------------------------------------

struct Size {
  double cells = 0.0;
  double build_s = 0.0;
  double reduce_s = 0.0;
  double step_us = 0.0;        // 1 ms, median
  double short_step_us = 0.0;  // 0.1 ms, median
  double error = 0.0;          // of the reduced model, the larger of both outputs
  double memory_MB = 0.0;      // most that the process held
};

double step_median(const std::shared_ptr<const FullOrderModel>& full, double period) {
  ModalStepper stepper(full, Discretization::kZeroOrderHold, period);
  Samples samples;
  for (int k = 0; k < 300; ++k) samples.time([&] { stepper.step(power_of(k)); });
  return samples.median();
}

Size measure_size(std::size_t min_cells) {
  Size size;
  std::shared_ptr<const FullOrderModel> full;
  size.build_s = seconds_of([&] {
    full = std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = min_cells});
  });
  size.reduce_s = seconds_of([&] {
    const ReducedModel model = reduce(full, {}, 1e-3, Discretization::kZeroOrderHold);
    size.error = std::max(model.error.peak_max(), model.error.volume_max());
  });
  size.cells = static_cast<double>(full->states());
  size.step_us = step_median(full, 1e-3);
  size.short_step_us = step_median(full, 1e-4);
  return size;
}

// In a process of its own, so that the memory is that of this size alone.
Size measure_apart(std::size_t min_cells) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw Error("no pipe");
  const pid_t child = fork();
  if (child < 0) throw Error("no process for a size");
  if (child == 0) {
    int status = 1;
    try {
      const Size size = measure_size(min_cells);
      status = write(ends[1], &size, sizeof size) == static_cast<ssize_t>(sizeof size) ? 0 : 1;
    } catch (const std::exception& error) {
      fmt::print(stderr, "{}\n", error.what());
    }
    _exit(status);
  }
  close(ends[1]);  // the child's end: if it dies, read returns
  Size size;
  const bool complete = read(ends[0], &size, sizeof size) == static_cast<ssize_t>(sizeof size);
  int status = 0;
  rusage usage{};
  wait4(child, &status, 0, &usage);
  close(ends[0]);
  if (!complete || status != 0) throw Error("the measurement of one size failed");
  size.memory_MB = static_cast<double>(usage.ru_maxrss) / 1024.0;
  return size;
}

Json growth() {
  constexpr std::array<std::size_t, 4> kSizes{20000, kCells, 320000, 1000000};
  fmt::print(stderr, "\nGrowth with n (each in a process of its own)\n");
  fmt::print(stderr, "{:>9} {:>9} {:>10} {:>10} {:>12} {:>14} {:>9}\n", "states", "build s",
             "reduce s", "memory MB", "step 1 ms us", "step 0.1 ms us", "error %");
  Json rows = Json::array();
  for (const std::size_t cells : kSizes) {
    const Size size = measure_apart(cells);
    fmt::print(stderr, "{:9.0f} {:9.3f} {:10.3f} {:10.1f} {:12.1f} {:14.1f} {:9.2f}\n", size.cells,
               size.build_s, size.reduce_s, size.memory_MB, size.step_us, size.short_step_us,
               100.0 * size.error);
    rows.push_back({{"states", size.cells},
                    {"build_s", size.build_s},
                    {"reduce_s", size.reduce_s},
                    {"memory_MB", size.memory_MB},
                    {"step_1ms_us", size.step_us},
                    {"step_0.1ms_us", size.short_step_us},
                    {"error_relative", size.error}});
  }
  return rows;
}

int run(std::span<char*> arguments) {
  std::string json_file;
  if (arguments.size() == 2 && std::string_view(arguments[0]) == "--json") {
    json_file = arguments[1];
  } else if (!arguments.empty()) {
    fmt::print(stderr, "usage: ./photocoag bench model [--json FILE]   (- is standard output)\n");
    return std::string_view(arguments[0]) == "--help" ? 0 : 2;
  }
  Samples clock;
  for (int k = 0; k < 10000; ++k) clock.time([] {});
  fmt::print(stderr,
             "photocoag {}: full-order model, interleaved with sparse Cholesky; CPU time of one "
             "thread, {:.2f} us of clock reading in each\n",
             version(), clock.median());
  Json json = {{"bench", "model"},
               {"version", version()},
               {"clock_us", clock.median()},
               {"growth", growth()}};
  const auto full =
      std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = kCells});
  const SparseSystem system = assemble_sparse_system(*full);
  json["steps"] = Json::array();
  for (const double period : {1e-3, 1e-4}) {
    json["steps"].push_back(compare_steps(full, system, period));
  }
  json["layered"] = compare_layered_steps();
  if (json_file == "-") {
    fmt::print("{}\n", json.dump(2));
  } else if (!json_file.empty()) {
    write_file(json_file, json.dump(2) + "\n");
  }
  return 0;
}

}  // namespace
}  // namespace photocoag::benchmarks

int main(int argc, char** argv) {
  // One thread for everybody: a BLAS reads this when it is loaded, hence the second start.
  constexpr const char* kThreads = "OPENBLAS_NUM_THREADS";
  if (std::getenv(kThreads) == nullptr) {
    setenv(kThreads, "1", 1);
    execv("/proc/self/exe", argv);
  }
  try {
    return photocoag::benchmarks::run({argv + 1, static_cast<std::size_t>(argc - 1)});
  } catch (const std::exception& error) {
    fmt::print(stderr, "photocoag bench model: {}\n", error.what());
    return 2;
  }
}
