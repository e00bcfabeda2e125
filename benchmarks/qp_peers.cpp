// `photocoag_bench_qp_peers PROBLEMS [--json FILE] [--answers FILE]`: `dense` and the peers that
// can be had as C or C++, in one binary, on the problems of `photocoag bench qp --export PROBLEMS`.
// Built by benchmarks/peers/qp_run, which gets the peers. Research software, not a medical device.
//
// Every problem is new to every solver: all its matrices differ from the last one's. Time: CPU time
// of this thread for a few rounds over four consecutive problems, per solve, after one round that
// fills the caches, as condensing does in a cycle; the solvers take turns, and of ten such times
// the least counts: what the algorithm needs, without what the machine does besides. What counts:
// from the problem's data to the powers, workspaces kept. `dense` checks its answer in that time;
// the others do not.
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/qp/dense.hpp"
#include "qp_peer.hpp"
#include "samples.hpp"
#ifdef PHOTOCOAG_HAVE_DAQP
#include <api.h>
#include <utils.h>
#endif
#ifdef PHOTOCOAG_HAVE_EIQUADPROG
#include "eiquadprog_peer.hpp"
#endif
#ifdef PHOTOCOAG_HAVE_QPOASES
#include <qpOASES.hpp>
#endif

namespace photocoag::benchmarks {
namespace {

constexpr int kRepetitions = 10;
constexpr std::size_t kWindow = 4;  // problems that fit the caches together
constexpr int kRounds = 5;          // in one reading of the clock
class Dense : public Peer {
 public:
  std::string name() const override { return "dense, its check included"; }
  std::span<const double> solve(Problem& problem, std::size_t) override {
    if (solver_.solve(problem.qp, solution_) != QpStatus::kSolved) return {};
    return {solution_.power.data(), static_cast<std::size_t>(solution_.power.size())};
  }

 private:
  DenseSolver solver_;
  QpSolution solution_;
};

#ifdef PHOTOCOAG_HAVE_DAQP
// Workspace set up once, then everything updated in place; the active set starts empty.
class Daqp : public Peer {
 public:
  explicit Daqp(Problem& first) : u_(first.g.size()), multipliers_(first.upper.size()) {
    sense_.assign(first.upper.size(), 0);
    bind(first);
    if (setup_daqp(&problem_, &work_, nullptr) < 0) throw Error("DAQP could not be set up");
    work_.settings->primal_tol = 1e-9;
    result_.x = u_.data();
    result_.lam = multipliers_.data();
  }
  ~Daqp() override {
    free_daqp_workspace(&work_);
    free_daqp_ldp(&work_);
  }
  Daqp(const Daqp&) = delete;
  Daqp& operator=(const Daqp&) = delete;

  std::string name() const override { return "DAQP, C, workspace kept"; }
  std::span<const double> solve(Problem& problem, std::size_t) override {
    bind(problem);
    constexpr int kAll =
        DAQP_UPDATE_Rinv + DAQP_UPDATE_M + DAQP_UPDATE_v + DAQP_UPDATE_d + DAQP_UPDATE_sense;
    if (daqp_update_ldp(kAll, &work_, &problem_) < 0) return {};
    daqp_solve(&result_, &work_);
    if (result_.exitflag <= 0) return {};
    return u_;
  }

 private:
  void bind(Problem& p) {
    problem_.n = static_cast<int>(p.g.size());
    problem_.m = static_cast<int>(p.upper.size());
    problem_.ms = problem_.n;
    problem_.H = p.H.data();
    problem_.f = p.g.data();
    problem_.A = p.G.data();
    problem_.bupper = p.upper.data();
    problem_.blower = p.lower.data();
    problem_.sense = sense_.data();
  }

  DAQPProblem problem_{};
  DAQPWorkspace work_{};
  DAQPResult result_{};
  std::vector<int> sense_;
  std::vector<double> u_;
  std::vector<double> multipliers_;
};
#endif

#ifdef PHOTOCOAG_HAVE_QPOASES
// Its options for model predictive control; cold, or from the last problem's active set as its
// manual recommends for changing matrices.
class QpOases : public Peer {
 public:
  QpOases(const Problem& first, bool hot)
      : solver_(static_cast<int>(first.g.size()),
                static_cast<int>(first.upper.size() - first.g.size())),
        hot_(hot),
        u_(first.g.size()) {
    qpOASES::Options options;
    options.setToMPC();
    options.printLevel = qpOASES::PL_NONE;
    solver_.setOptions(options);
  }
  std::string name() const override {
    return hot_ ? "qpOASES, C++, hot start" : "qpOASES, C++, cold";
  }
  std::span<const double> solve(Problem& p, std::size_t) override {
    const std::size_t n = u_.size();
    qpOASES::int_t changes = 1000;
    const bool again = hot_ && started_;
    if (!again) solver_.reset();
    const auto status =
        again ? solver_.hotstart(p.H.data(), p.g.data(), p.G.data(), p.lower.data(), p.upper.data(),
                                 p.lower.data() + n, p.upper.data() + n, changes)
              : solver_.init(p.H.data(), p.g.data(), p.G.data(), p.lower.data(), p.upper.data(),
                             p.lower.data() + n, p.upper.data() + n, changes);
    started_ = status == qpOASES::SUCCESSFUL_RETURN;
    if (!started_) return {};
    solver_.getPrimalSolution(u_.data());
    return u_;
  }

 private:
  qpOASES::SQProblem solver_;
  bool hot_;
  bool started_ = false;
  std::vector<double> u_;
};
#endif

std::vector<std::unique_ptr<Peer>> peers(Problem& first) {
  std::vector<std::unique_ptr<Peer>> all;
  all.push_back(std::make_unique<Dense>());
#ifdef PHOTOCOAG_HAVE_DAQP
  all.push_back(std::make_unique<Daqp>(first));
#endif
#ifdef PHOTOCOAG_HAVE_EIQUADPROG
  if (auto peer = make_eiquadprog(first)) all.push_back(std::move(peer));
#endif
#ifdef PHOTOCOAG_HAVE_QPOASES
  all.push_back(std::make_unique<QpOases>(first, false));
  all.push_back(std::make_unique<QpOases>(first, true));
#endif
  return all;
}

Problem read_problem(const Json& raw) {
  Problem p;
  p.horizon = raw.at("horizon").get<int>();
  p.weights = raw.value("weights", "");
  p.H = raw.at("H").get<std::vector<double>>();
  p.g = raw.at("g").get<std::vector<double>>();
  p.G = raw.at("G").get<std::vector<double>>();
  p.lower = raw.at("lower").get<std::vector<double>>();
  p.upper = raw.at("upper").get<std::vector<double>>();
  const auto limit = raw.at("limit").get<std::vector<double>>();
  if (raw.contains("u0") && raw["u0"].is_number()) p.u0 = raw["u0"].get<double>();
  const int n = static_cast<int>(p.g.size());
  const int m = static_cast<int>(limit.size());
  p.qp.resize(n, m);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) p.qp.hessian(i, j) = p.H[i * n + j];
    for (int k = 0; k < m; ++k) p.qp.rows(k, i) = p.G[k * n + i];
    p.qp.gradient(i) = p.g[i];
    p.qp.lower(i) = p.lower[i];
    p.qp.upper(i) = p.upper[i];
  }
  for (int k = 0; k < m; ++k) p.qp.limit(k) = limit[k];
  p.upper.insert(p.upper.end(), limit.begin(), limit.end());
  p.lower.insert(p.lower.end(), static_cast<std::size_t>(m), -1e30);
  return p;
}

// One horizon and choice of weights after the other; each has a new set of peers.
Json compare(std::vector<Problem>& problems) {
  Json rows = Json::array();
  for (std::size_t begin = 0; begin < problems.size();) {
    std::size_t end = begin;
    while (end < problems.size() && problems[end].horizon == problems[begin].horizon &&
           problems[end].weights == problems[begin].weights) {
      ++end;
    }
    const std::span<Problem> mine(problems.data() + begin, end - begin);
    const auto all = peers(mine.front());
    std::vector<Samples> windows(all.size());
    for (std::size_t at = 0; at + kWindow <= mine.size(); at += kWindow) {
      const std::span<Problem> window = mine.subspan(at, kWindow);
      std::vector<double> least(all.size(), std::numeric_limits<double>::infinity());
      for (int repetition = 0; repetition < kRepetitions; ++repetition) {
        for (std::size_t s = 0; s < all.size(); ++s) {
          for (std::size_t k = 0; k < kWindow; ++k) all[s]->prepare(window[k], k);
          const auto round = [&] {
            for (std::size_t k = 0; k < kWindow; ++k) all[s]->solve(window[k], k);
          };
          round();
          Samples once;
          once.time([&] {
            for (int k = 0; k < kRounds; ++k) round();
          });
          least[s] = std::min(least[s], once.first());
        }
      }
      for (std::size_t s = 0; s < all.size(); ++s) windows[s].add(least[s]);
    }
    for (std::size_t s = 0; s < all.size(); ++s) {
      double error = 0.0;
      int unanswered = 0;
      for (Problem& problem : mine) {
        all[s]->prepare(problem, 0);
        const std::span<const double> u = all[s]->solve(problem, 0);
        if (u.empty()) {
          ++unanswered;
        } else if (!std::isnan(problem.u0)) {
          error = std::max(error, std::abs(u[0] - problem.u0));
        }
      }
      constexpr double kSolves = kWindow * kRounds;
      const double median = windows[s].median() / kSolves;
      const double p99 = windows[s].p99() / kSolves;
      const double most = windows[s].max() / kSolves;
      fmt::print(stderr, "{:>3}  {:<12} {:<28} {:8.3f} {:8.3f} {:8.3f}  {:8.1e}{}\n",
                 mine.front().horizon, mine.front().weights, all[s]->name(), median, p99, most,
                 error, unanswered > 0 ? fmt::format("  {} not solved", unanswered) : "");
      rows.push_back({{"horizon", mine.front().horizon},
                      {"weights", mine.front().weights},
                      {"name", all[s]->name()},
                      {"median_us", median},
                      {"p99_us", p99},
                      {"slowest_us", most},
                      {"power_error_of_u_max", error},
                      {"not_solved", unanswered}});
    }
    begin = end;
  }
  return rows;
}

// u of every problem by every solver, null where it has none.
Json answers(std::vector<Problem>& problems) {
  Json out = Json::array();
  for (Problem& problem : problems) {
    Json row = Json::object();
    for (const auto& peer : peers(problem)) {
      peer->prepare(problem, 0);
      const std::span<const double> u = peer->solve(problem, 0);
      row[peer->name()] = u.empty() ? Json() : Json(std::vector<double>(u.begin(), u.end()));
    }
    out.push_back(std::move(row));
  }
  return out;
}

int run(std::span<char*> arguments) {
  std::string json_file;
  std::string answers_file;
  for (std::size_t k = 1; k + 1 < arguments.size(); k += 2) {
    const std::string_view option = arguments[k];
    if (option == "--json") json_file = arguments[k + 1];
    if (option == "--answers") answers_file = arguments[k + 1];
  }
  if (arguments.empty() || (arguments.size() > 1 && json_file.empty() && answers_file.empty())) {
    fmt::print(stderr, "usage: photocoag_bench_qp_peers PROBLEMS [--json FILE] [--answers FILE]\n");
    return 2;
  }
  std::ifstream file(arguments[0]);
  std::vector<Problem> problems;
  for (const Json& raw : Json::parse(file)) problems.push_back(read_problem(raw));
  if (!answers_file.empty()) {
    write_file(answers_file, answers(problems).dump() + "\n");
    return 0;
  }
  fmt::print(stderr, "photocoag {}: {} problems, {} at a time, solvers in turn, CPU time, us\n",
             version(), problems.size(), kWindow);
  fmt::print(stderr, "{:>3}  {:<12} {:<28} {:>8} {:>8} {:>8}  u0 error / u_max\n", "N", "weights",
             "solver", "median", "99 %", "slowest");
  const Json rows = compare(problems);
  if (!json_file.empty()) write_file(json_file, rows.dump(2) + "\n");
  return 0;
}

}  // namespace
}  // namespace photocoag::benchmarks

int main(int argc, char** argv) {
  try {
    return photocoag::benchmarks::run({argv + 1, static_cast<std::size_t>(argc - 1)});
  } catch (const std::exception& error) {
    fmt::print(stderr, "photocoag_bench_qp_peers: {}\n", error.what());
    return 2;
  }
}
