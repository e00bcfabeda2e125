#include "photocoag/certify/certify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "photocoag/certify/paths.hpp"
#include "photocoag/certify/sampled_problem.hpp"
#include "photocoag/core/parallel.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/qp/dense.hpp"

namespace photocoag {
namespace {

// Weight of halving alpha relative to halving a free response: the relative spread of the impulse
// responses against the spread of a temperature relative to the limit.
constexpr double kAbsorptionCounts = 3.0;
constexpr int kKept = 32;   // of the samples with the most changes, to search around
constexpr int kChunk = 64;  // boxes between two looks at `stop`
constexpr double kRoundings = 100.0;

struct Piece {
  CertifiedBox box;
  long long cycle = 3;
  int halvings = 0;
  double volume = 1.0;                            // share of the whole
  int longest = std::numeric_limits<int>::max();  // proved: no problem in it needs more
  double condition = 0.0;
  std::vector<ParameterPoint> witnesses{};
};

// The ranges of a box that matter, in one order.
std::vector<BoxRange*> ranges_of(CertifiedBox& box, int inputs, bool choroid, bool previous) {
  std::vector<BoxRange*> ranges{&box.absorption};
  if (choroid) ranges.push_back(&box.choroid);
  for (int k = 0; k < inputs; ++k) ranges.push_back(&box.free[k]);
  if (previous) ranges.push_back(&box.previous);
  return ranges;
}

class Certifier {
 public:
  Certifier(const ReducedModel& model, const ControlSettings& settings, CertifiedBox box,
            const CertifyOptions& options, const std::atomic<bool>& stop, const Progress& progress)
      : model_(model),
        settings_(settings),
        box_(std::move(box)),
        options_(options),
        stop_(stop),
        progress_(progress),
        inputs_(settings.horizon - 1) {
    if (settings.power_change_weight > 0.0) {  // the first cycle's u_prev is u_ref
      const BoxRange first = reference_powers(model, settings, box_);
      box_.previous = {std::min(box_.previous.low, first.low),
                       std::max(box_.previous.high, first.high)};
    }
    if (settings.state_weight == StateWeight::kDelayed) {
      cycles_ = {0, 1, 2, 3};
    }
    result_.hard_bound = DenseSolver::iteration_bound(inputs_, inputs_);
  }

  Certificate run() {
    look_around();
    std::vector<Piece> open;
    for (const long long cycle : cycles_) {
      open.push_back(
          {.box = box_, .cycle = cycle, .volume = 1.0 / static_cast<double>(cycles_.size())});
    }
    while (!open.empty() && !stop_ && result_.boxes < options_.boxes) {
      open = generation(std::move(open));
    }
    finish(std::move(open));
    return conclude();
  }

 private:
  // Random problems, then ones around those with the most changes.
  void look_around() {
    if (progress_) progress_("sampling", 0.0);
    for (const long long cycle : cycles_) {
      SampledProblem problem(model_, settings_, cycle);
      std::vector<std::pair<int, ParameterPoint>> best;
      for (long long i = 0; i < options_.samples && !stop_; ++i) {
        const bool near = i >= options_.samples / 2 && !best.empty();
        ParameterPoint point =
            near ? best[static_cast<std::size_t>(i) % best.size()].second : ParameterPoint{};
        move(point, static_cast<std::uint64_t>(i), cycle, near);
        const int changes = try_point(problem, point);
        if (best.size() < kKept || changes > best.back().first) {
          best.insert(std::upper_bound(best.begin(), best.end(), changes,
                                       [](int c, const auto& b) { return c > b.first; }),
                      {changes, point});
          if (best.size() > kKept) best.pop_back();
        }
      }
    }
  }

  int try_point(SampledProblem& problem, const ParameterPoint& point) {
    const int changes = problem.changes(point);
    ++result_.solved;
    result_.seen = std::max(result_.seen, changes);
    return changes;
  }

  // Moves to a random point of the box, or by a random step; every fourth number is at an end of
  // its range.
  void move(ParameterPoint& point, std::uint64_t i, long long cycle, bool near) const {
    std::uint64_t drawn = 16 * (4 * i + static_cast<std::uint64_t>(cycle));
    const auto random = [&] { return uniform(options_.seed, drawn++, RandomStream::kStudy); };
    const double reach = std::pow(10.0, -3.0 * random());
    const auto place = [&](const BoxRange& range, double& value) {
      if (near) {
        value += (2.0 * random() - 1.0) * reach * (range.high - range.low);
        value = std::clamp(value, range.low, range.high);
        return;
      }
      const double u = random();
      value = range.low + (range.high - range.low) * std::clamp(u * 1.25 - 0.125, 0.0, 1.0);
    };
    place(box_.absorption, point.absorption);
    if (model_.parameters.size() == 2) place(box_.choroid, point.choroid);
    for (int k = 0; k < inputs_; ++k) place(box_.free[k], point.free[k]);
    if (settings_.power_change_weight > 0.0) place(box_.previous, point.previous);
  }

  // Examines all boxes and halves those not proved; boxes at the limits are kept.
  std::vector<Piece> generation(std::vector<Piece> open) {
    std::vector<Piece> next;
    std::size_t done = 0;
    while (done < open.size() && !stop_ && result_.boxes < options_.boxes) {
      const std::size_t count =
          std::min({std::size_t{kChunk}, open.size() - done, options_.boxes - result_.boxes});
      for_each_in_parallel(
          count, [&](std::size_t i) { look_at(open[done + i], options_.nodes, result_.seen); });
      for (std::size_t i = 0; i < count; ++i) try_witnesses(open[done + i]);
      for (std::size_t i = 0; i < count; ++i) sort_out(open[done + i], next);
      result_.boxes += count;
      done += count;
      if (progress_) progress_("proving", proved_);
    }
    for (std::size_t i = done; i < open.size(); ++i) next.push_back(open[i]);
    return next;
  }

  // Examines the remaining boxes once more, to the end of every path, to get at least a bound.
  void finish(std::vector<Piece> open) {
    for (std::size_t done = 0; done < open.size(); done += kChunk) {
      const std::size_t count = std::min<std::size_t>(kChunk, open.size() - done);
      if (!stop_ && most_ < result_.hard_bound) {
        for_each_in_parallel(count, [&](std::size_t i) {
          look_at(open[done + i], 4 * options_.nodes, std::numeric_limits<int>::max());
        });
      }
      for (std::size_t i = 0; i < count; ++i) {
        try_witnesses(open[done + i]);
        if (!proves(open[done + i])) leave_open(open[done + i]);
      }
      if (progress_) {
        progress_("bounding", static_cast<double>(done) / static_cast<double>(open.size()));
      }
    }
    for (const Piece& piece : ended_) leave_open(piece);
  }

  void look_at(Piece& piece, long long nodes, int enough) const {
    CellProblem problem(model_, settings_, piece.box, piece.cycle);
    const Witness witness = [&](const std::array<double, kMaxDimensions>& x, int changes) {
      if (changes > result_.seen) piece.witnesses.push_back(point_at(piece.box, x));
    };
    const PathSearch found = search_paths(problem, nodes, enough, witness);
    if (!found.complete) return;
    piece.longest = std::min(piece.longest, found.longest);
    piece.condition = found.condition;
  }

  ParameterPoint point_at(const CertifiedBox& box,
                          const std::array<double, kMaxDimensions>& x) const {
    std::size_t i = 0;
    const auto at = [&](const BoxRange& range) {
      return std::clamp(range.middle() + x[i++] * range.radius(), range.low, range.high);
    };
    ParameterPoint point;
    for (int k = 0; k < inputs_; ++k) point.free[k] = at(box.free[k]);
    if (settings_.power_change_weight > 0.0) point.previous = at(box.previous);
    point.absorption = at(box.absorption);
    if (model_.parameters.size() == 2) point.choroid = at(box.choroid);
    return point;
  }

  void try_witnesses(Piece& piece) {
    if (piece.witnesses.empty()) return;
    SampledProblem problem(model_, settings_, piece.cycle);
    for (const ParameterPoint& point : piece.witnesses) try_point(problem, point);
    piece.witnesses.clear();
  }

  bool proves(const Piece& piece) {
    if (piece.longest > result_.seen) return false;
    proved_ += piece.volume;
    most_ = std::max(most_, piece.longest);
    result_.condition = std::max(result_.condition, piece.condition);
    return true;
  }

  void sort_out(const Piece& piece, std::vector<Piece>& next) {
    if (proves(piece)) return;
    if (piece.halvings >= options_.halvings) {
      ended_.push_back(piece);
    } else {
      for (const bool upper : {false, true}) next.push_back(half(piece, upper));
    }
  }

  // Along the range that counts most.
  Piece half(const Piece& piece, bool upper) const {
    Piece result = piece;
    ++result.halvings;
    result.volume *= 0.5;
    const bool previous = settings_.power_change_weight > 0.0;
    const std::vector<BoxRange*> ranges =
        ranges_of(result.box, inputs_, model_.parameters.size() == 2, previous);
    BoxRange* widest = ranges.front();
    double largest = 0.0;
    for (BoxRange* range : ranges) {
      double width = (range->high - range->low) / settings_.peak_max;
      if (range == &result.box.absorption || range == &result.box.choroid) {
        width = kAbsorptionCounts * std::log(range->high / range->low);
      } else if (range == &result.box.previous) {
        width = (range->high - range->low) / settings_.power_max;
      }
      if (width > largest) {
        largest = width;
        widest = range;
      }
    }
    (upper ? widest->low : widest->high) = widest->middle();
    return result;
  }

  // Records a box in which `seen` is not proved.
  void leave_open(const Piece& piece) {
    ++result_.open_boxes;
    result_.condition = std::max(result_.condition, piece.condition);
    if (piece.longest > result_.hard_bound) ++result_.undecided;
    most_ = std::max(most_, std::min(piece.longest, result_.hard_bound));
  }

  Certificate conclude() {
    result_.stopped = stop_;
    result_.share = result_.open_boxes == 0 ? 1.0 : proved_;
    result_.proved = std::min(std::max(most_, result_.seen), result_.hard_bound);
    result_.rounding = kRoundings * inputs_ * inputs_ * (result_.proved + 1) *
                       std::numeric_limits<double>::epsilon() * result_.condition;
    return result_;
  }

  const ReducedModel& model_;
  const ControlSettings& settings_;
  CertifiedBox box_;
  const CertifyOptions& options_;
  const std::atomic<bool>& stop_;
  const Progress& progress_;
  int inputs_;
  std::vector<long long> cycles_{3};
  Certificate result_;
  std::vector<Piece> ended_;  // halved as often as they may be
  double proved_ = 0.0;       // volume
  int most_ = 0;
};

}  // namespace

std::string claim_text(const ControlSettings& settings, const CertifiedBox& box,
                       const CertifyOptions& options) {
  std::string text = fmt::format(
      "dense N={} T={} y_ref={} y_max={} u_min={} u_max={} R0={} R1={} R2={} alpha={}..{} "
      "beta={}..{} u_prev={}..{}",
      settings.horizon, settings.period, settings.peak_reference, settings.peak_max,
      settings.power_min, settings.power_max,
      settings.state_weight == StateWeight::kDelayed ? "delayed" : "constant",
      settings.power_weight, settings.power_change_weight, box.absorption.low, box.absorption.high,
      box.choroid.low, box.choroid.high, box.previous.low, box.previous.high);
  for (int k = 0; k + 1 < settings.horizon; ++k) {
    text += fmt::format(" f_{}={}..{}", k + 1, box.free[k].low, box.free[k].high);
  }
  return text + fmt::format(" halvings={} boxes={} nodes={} samples={} seed={}", options.halvings,
                            options.boxes, options.nodes, options.samples, options.seed);
}

bool Certificate::covers_rounding() const noexcept { return rounding <= kUndecided; }

Certificate certify(const ReducedModel& model, const ControlSettings& settings,
                    const CertifiedBox& box, const CertifyOptions& options,
                    const std::atomic<bool>& stop, const Progress& progress) {
  require_certifiable(model, settings);
  box.validate();
  return Certifier(model, settings, box, options, stop, progress).run();
}

}  // namespace photocoag
