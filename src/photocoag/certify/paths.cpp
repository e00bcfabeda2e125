#include "photocoag/certify/paths.hpp"

#include <algorithm>

namespace photocoag {
namespace {

constexpr double kPositiveRate = 1e-10;  // DenseSolver also treats a rate above this as positive

// Depth first. A node is the solver between two decisions; its region is where all decisions on the
// way to it are possible.
class Search {
 public:
  Search(CellProblem& problem, long long budget, int enough, const Witness& witness)
      : problem_(problem),
        region_(problem.dimensions()),
        witness_(witness),
        budget_(budget),
        enough_(enough),
        n_(problem.inputs()) {}

  PathSearch run() {
    found_.condition = problem_.condition();
    found_.complete = problem_.definite();
    if (found_.complete) choose_rows(0);
    return found_;
  }

 private:
  static constexpr int kNone = -1;

  struct Candidate {
    int constraint;
    Affine violation;
    double size;
  };

  // Which rows DenseSolver::prepare keeps, and which are relaxed.
  void choose_rows(int i) {
    if (i == n_) return choose_entering(0, 0, kNone);
    for (const RowState state : {RowState::kLeftOut, RowState::kLimit, RowState::kRelaxed}) {
      const std::size_t size = region_.size();
      for (const Inequality& row : problem_.row_conditions(i, state)) region_.add(row);
      problem_.set_row(i, state);
      if (!region_.is_empty()) choose_rows(i + 1);
      region_.shrink(size);
    }
    problem_.set_row(i, RowState::kLeftOut);
  }

  // Step 1: the minimizer on `set` is reached, after `changes`; `left` is the constraint that left
  // last on the way from the minimizer before.
  void choose_entering(ActiveSet set, int changes, int left) {
    if (!visit(changes)) return;
    // The cost rises from minimizer to minimizer, so none occurs twice.
    if (std::find(seen_.begin(), seen_.end(), set) != seen_.end()) return;
    seen_.push_back(set);
    const std::size_t size = region_.size();
    const Equality& at = problem_.equality(set);
    const double multiplier_size = largest_size(at);
    for (const Affine& multiplier : at.multiplier) {
      region_.add(problem_.at_least_zero(multiplier, multiplier_size));
    }
    std::vector<Candidate> candidates;
    for (int c = 0; c < 3 * n_; ++c) {
      // The last constraint that left cannot be violated.
      if (c == left || !is_looked_at(set, c)) continue;
      const Affine v = problem_.violation(at, c);
      candidates.push_back({c, v, problem_.size(v)});
    }
    for (const Candidate& p : candidates) try_entering(set, p, candidates, changes);
    region_.shrink(size);
    seen_.pop_back();
  }

  void try_entering(ActiveSet set, const Candidate& p, const std::vector<Candidate>& candidates,
                    int changes) {
    const std::size_t size = region_.size();
    region_.add(problem_.at_least_zero(p.violation, p.size));
    for (const Candidate& c : candidates) {
      if (c.constraint == p.constraint) continue;
      region_.add(problem_.at_least_zero(
          problem_.combine(p.violation, Varying(1.0), c.violation, Varying(-1.0)),
          p.size + c.size));
    }
    if (!region_.is_empty()) step(set, p.constraint, changes, kNone);
    region_.shrink(size);
  }

  bool is_looked_at(ActiveSet set, int c) const {
    const auto holds = [set](int constraint) { return ((set >> constraint) & 1U) != 0; };
    if (holds(c) || (c < 2 * n_ && holds((c + n_) % (2 * n_)))) return false;
    if (c >= 2 * n_ && problem_.row(c - 2 * n_) == RowState::kLeftOut) return false;
    return !problem_.is_met_exactly(set, c);
  }

  double largest_size(const Equality& at) const {
    double largest = 0.0;
    for (const Affine& m : at.multiplier) largest = std::max(largest, problem_.size(m));
    return largest;
  }

  // Step 2: constraint p is entering; the multipliers of `set` fall along the rates, each reaching
  // 0 at lambda_k / r_k, and its own violation ends at violation / d2'd2.
  void step(ActiveSet set, int p, int changes, int left) {
    if (!visit(changes)) return;
    const Directions d = problem_.directions(set, p);
    const Equality& at = problem_.equality(set);
    if (!d.decided) {
      found_.complete = false;
      return;
    }
    const int q = static_cast<int>(at.members.size());
    const Affine v = problem_.violation(at, p);
    const double v_size = problem_.size(v);
    const double m_size = largest_size(at);
    const double curvature = d.curvature.range().magnitude();
    const auto rises = [&](int k) { return d.rate[k].range().low > kPositiveRate; };
    // sign (lambda_k d2'd2 - violation r_k) >= 0.
    const auto in_order = [&](int k, double sign) {
      region_.add(
          problem_.at_least_zero(problem_.combine(at.multiplier[k], d.curvature * Varying(sign), v,
                                                  d.rate[k] * Varying(-sign)),
                                 m_size * curvature + v_size * d.rate[k].range().magnitude()));
    };
    const std::size_t size = region_.size();
    if (!d.dependent) {
      for (int k = 0; k < q; ++k) {
        if (rises(k)) in_order(k, 1.0);
      }
      if (!region_.is_empty()) choose_entering(set | (1U << p), changes + 1, left);
      region_.shrink(size);
    }
    for (int k = 0; k < q; ++k) {
      const Interval rate = d.rate[k].range();
      if (!(rate.high > 0.0)) continue;
      if (!d.dependent) in_order(k, -1.0);
      for (int l = 0; l < q; ++l) {
        if (l == k || !rises(l)) continue;
        region_.add(problem_.at_least_zero(
            problem_.combine(at.multiplier[l], d.rate[k], at.multiplier[k], -d.rate[l]),
            m_size * (rate.magnitude() + d.rate[l].range().magnitude())));
      }
      const int member = at.members[k];
      if (!region_.is_empty()) step(set & ~(1U << member), p, changes + 1, member);
      region_.shrink(size);
    }
    // Dependent and nothing can leave: a problem without a solution, which (E22) excludes.
  }

  bool visit(int changes) {
    if (--budget_ < 0) found_.complete = false;
    if (!found_.complete) return false;
    ++found_.nodes;
    if (changes > found_.longest) {
      found_.longest = changes;
      witness_(region_.point(), changes);
      if (changes > enough_) found_.complete = false;
    }
    return found_.complete;
  }

  CellProblem& problem_;
  Region region_;
  const Witness& witness_;
  long long budget_;
  int enough_;
  int n_;
  std::vector<ActiveSet> seen_;  // minimizers on the way here
  PathSearch found_;
};

}  // namespace

PathSearch search_paths(CellProblem& problem, long long budget, int enough,
                        const Witness& witness) {
  return Search(problem, budget, enough, witness).run();
}

}  // namespace photocoag
