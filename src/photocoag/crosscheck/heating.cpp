#include "photocoag/crosscheck/heating.hpp"

#include <algorithm>
#include <cstring>

#include "photocoag/core/wide_vectors.hpp"

namespace photocoag::crosscheck {
namespace {

/// Alexander's three stages, a_ij of the lower triangle; the last row gives the new value.
struct Alexander {
  static constexpr double kShift = 0.435866521508458999;
  static constexpr double kHalf = 0.5 * (1.0 - kShift);
  static constexpr double kFirst = -0.25 * (6.0 * kShift * kShift - 16.0 * kShift + 1.0);
  static constexpr double kSecond = 0.25 * (6.0 * kShift * kShift - 20.0 * kShift + 5.0);
};

typedef double Lane4 __attribute__((vector_size(kLanes * sizeof(double)), aligned(8), may_alias));

Lane4* lanes_of(std::vector<double>& values) { return reinterpret_cast<Lane4*>(values.data()); }

/// What one stage of a step reads and writes: temperatures and slopes node by node, source by
/// source, kLanes numbers each. Null: not of this stage.
struct Stage {
  const Lane4* now;
  const Lane4* first;
  const Lane4* second;
  double first_weight;
  double second_weight;
  Lane4* at;
  Lane4* slope;
};

/// What all stages of a step have in common; of the factors `inverse` is one over the diagonal.
struct StageMatrices {
  std::size_t nodes;
  std::size_t count;
  const double* load;
  const Lane4* diagonal;
  const Lane4* beside;
  const Lane4* inverse;
  const Lane4* ratio;
};

/// The factors of mass + h stiffness, and `inverse`, one over their diagonal.
PHOTOCOAG_WIDE_VECTORS
void shift_and_factorize(const Lane4* mass, const Lane4* mass_beside, const Lane4* stiffness,
                         const Lane4* stiffness_beside, double h, std::size_t nodes, Lane4* inverse,
                         Lane4* ratio) {
  Lane4 diagonal = mass[0] + h * stiffness[0];
  for (std::size_t i = 0; i < nodes; ++i) {
    inverse[i] = 1.0 / diagonal;
    if (i + 1 == nodes) break;
    const Lane4 beside = mass_beside[i] + h * stiffness_beside[i];
    ratio[i] = beside / diagonal;
    diagonal = mass[i + 1] + h * stiffness[i + 1] - ratio[i] * beside;
  }
}

/// at = now + weighted slopes.
template <int Slopes>
inline __attribute__((always_inline)) void start(const Stage& stage, std::size_t k) {
  Lane4 value = stage.now[k];
  if constexpr (Slopes > 0) value += stage.first_weight * stage.first[k];
  if constexpr (Slopes > 1) value += stage.second_weight * stage.second[k];
  stage.at[k] = value;
}

template <int Slopes>
inline __attribute__((always_inline)) void forward_sweep(const Stage stage,
                                                         const StageMatrices& matrices) {
  const std::size_t count = matrices.count;
  for (std::size_t a = 0; a < count; ++a) start<Slopes>(stage, a);
  for (std::size_t i = 0; i < matrices.nodes; ++i) {
    const double* const load = matrices.load + i * count;
    const Lane4 own = matrices.diagonal[i];
    const Lane4 after = matrices.beside[i];
    const std::size_t here = i * count;
    const bool first = i == 0;
    const bool last = i + 1 == matrices.nodes;
    const Lane4 before = first ? own : matrices.beside[i - 1];
    const Lane4 factor = first ? own : matrices.ratio[i - 1];
    for (std::size_t k = here; k < here + count; ++k) {
      Lane4 sum = load[k - here] - own * stage.at[k];
      if (!first) sum -= before * stage.at[k - count];
      if (!last) {
        start<Slopes>(stage, k + count);
        sum -= after * stage.at[k + count];
      }
      if (!first) sum -= factor * stage.slope[k - count];
      stage.slope[k] = sum;
    }
  }
}

/// at = now + weighted slopes, and slope = L^-1 (load - stiffness at), in one pass over the nodes.
PHOTOCOAG_WIDE_VECTORS
void forward(const Stage& stage, const StageMatrices& matrices) {
  if (stage.second != nullptr) {
    forward_sweep<2>(stage, matrices);
  } else if (stage.first != nullptr) {
    forward_sweep<1>(stage, matrices);
  } else {
    forward_sweep<0>(stage, matrices);
  }
}

/// slope = L^-T D^-1 slope; with `next` also next = at + weight slope.
PHOTOCOAG_WIDE_VECTORS
void backward(const Stage& stage, const StageMatrices& matrices, double weight, Lane4* next) {
  const std::size_t count = matrices.count;
  Lane4* const slope = stage.slope;
  for (std::size_t i = matrices.nodes; i-- > 0;) {
    const Lane4 inverse = matrices.inverse[i];
    const Lane4 factor = matrices.ratio[i];
    const bool last = i + 1 == matrices.nodes;
    for (std::size_t k = i * count; k < (i + 1) * count; ++k) {
      Lane4 value = slope[k] * inverse;
      if (!last) value -= factor * slope[k + count];
      slope[k] = value;
      if (next != nullptr) next[k] = stage.at[k] + weight * value;
    }
  }
}

/// Columns of a Gram matrix that stay in registers, for a few rows at a time.
constexpr std::size_t kGramColumns = 2 * kLanes;
constexpr std::size_t kGramRows = 4;

/// GramSum's loads as a plain struct: the loops below are compiled for two instruction sets.
struct Loads {
  std::size_t nodes;
  std::size_t count;
  std::size_t padded;
  const double* load;
};

/// `Rows` rows of gram += weight heat load', node after node; numbers of `heat` are `stride` apart.
template <std::size_t Rows>
inline __attribute__((always_inline)) void add_gram_rows(double* __restrict gram,
                                                         const double* __restrict heat,
                                                         std::size_t stride, const Loads& loads,
                                                         double weight, std::size_t a,
                                                         std::size_t b) {
  double kept[Rows][kGramColumns] = {};
  const std::size_t columns = std::min(kGramColumns, loads.count - b);
  for (std::size_t r = 0; r < Rows; ++r) {
    for (std::size_t c = 0; c < columns; ++c) kept[r][c] = gram[(a + r) * loads.count + b + c];
  }
  Lane4 sum[Rows][2];
  std::memcpy(sum, kept, sizeof sum);
  for (std::size_t i = 0; i < loads.nodes; ++i) {
    const Lane4* load = reinterpret_cast<const Lane4*>(loads.load + i * loads.padded + b);
    for (std::size_t r = 0; r < Rows; ++r) {
      const double scaled = weight * heat[(i * loads.count + a + r) * stride];
      sum[r][0] += scaled * load[0];
      sum[r][1] += scaled * load[1];
    }
  }
  std::memcpy(kept, sum, sizeof sum);
  for (std::size_t r = 0; r < Rows; ++r) {
    for (std::size_t c = 0; c < columns; ++c) gram[(a + r) * loads.count + b + c] = kept[r][c];
  }
}

PHOTOCOAG_WIDE_VECTORS
void add_gram(double* gram, const double* heat, std::size_t stride, const Loads& loads,
              double weight) {
  for (std::size_t b = 0; b < loads.count; b += kGramColumns) {
    std::size_t a = 0;
    for (; a + kGramRows <= loads.count; a += kGramRows) {
      add_gram_rows<kGramRows>(gram, heat, stride, loads, weight, a, b);
    }
    for (; a < loads.count; ++a) add_gram_rows<1>(gram, heat, stride, loads, weight, a, b);
  }
}

}  // namespace

void Symmetric::factorize() {
  for (std::size_t i = 0; i + 1 < diagonal.size(); ++i) {
    const double ratio = beside[i] / diagonal[i];
    diagonal[i + 1] -= ratio * beside[i];
    beside[i] = ratio;
  }
}

void Symmetric::solve(std::vector<double>& x, std::size_t count) const {
  const std::size_t n = diagonal.size();
  for (std::size_t i = 1; i < n; ++i) {
    for (std::size_t a = 0; a < count; ++a)
      x[i * count + a] -= beside[i - 1] * x[(i - 1) * count + a];
  }
  for (std::size_t i = n; i-- > 0;) {
    const double inverse = 1.0 / diagonal[i];
    for (std::size_t a = 0; a < count; ++a) {
      const double behind = i + 1 < n ? beside[i] * x[(i + 1) * count + a] : 0.0;
      x[i * count + a] = x[i * count + a] * inverse - behind;
    }
  }
}

void Heating::Matrices::take(std::size_t lane, const Symmetric& matrix) {
  for (std::size_t i = 0; i < matrix.diagonal.size(); ++i) {
    diagonal[i * kLanes + lane] = matrix.diagonal[i];
    beside[i * kLanes + lane] = matrix.beside[i];
  }
}

Heating::Heating(const std::vector<Pencil>& pencils, const Sources& sources)
    : sources_(sources),
      nodes_(pencils.front().mass.diagonal.size()),
      mass_(nodes_),
      stiffness_(nodes_),
      factors_(nodes_),
      now_(sources.load.size() * kLanes, 0.0),
      at_(now_.size()),
      slope_{now_, now_, now_} {
  for (std::size_t l = 0; l < kLanes; ++l) {
    mass_.take(l, pencils[l].mass);
    stiffness_.take(l, pencils[l].stiffness);
  }
}

void Heating::advance(double time, int steps) {
  const double h = time / steps;
  shift_and_factorize(lanes_of(mass_.diagonal), lanes_of(mass_.beside),
                      lanes_of(stiffness_.diagonal), lanes_of(stiffness_.beside),
                      Alexander::kShift * h, nodes_, lanes_of(factors_.diagonal),
                      lanes_of(factors_.beside));
  const StageMatrices matrices{nodes_,
                               sources_.count,
                               sources_.load.data(),
                               lanes_of(stiffness_.diagonal),
                               lanes_of(stiffness_.beside),
                               lanes_of(factors_.diagonal),
                               lanes_of(factors_.beside)};
  const auto solve = [&](const Stage& stage, Lane4* next) {
    forward(stage, matrices);
    backward(stage, matrices, h * Alexander::kShift, next);
  };
  Lane4* const now = lanes_of(now_);
  Lane4* const at = lanes_of(at_);
  Lane4* const slopes[] = {lanes_of(slope_[0]), lanes_of(slope_[1]), lanes_of(slope_[2])};
  for (int step = 0; step < steps; ++step) {
    solve({now, nullptr, nullptr, 0.0, 0.0, at, slopes[0]}, nullptr);
    solve({now, slopes[0], nullptr, h * Alexander::kHalf, 0.0, at, slopes[1]}, nullptr);
    solve({now, slopes[0], slopes[1], h * Alexander::kFirst, h * Alexander::kSecond, at, slopes[2]},
          now);
  }
}

GramSum::GramSum(const Sources& sources, std::size_t nodes)
    : nodes_(nodes),
      count_(sources.count),
      padded_((count_ + kGramColumns - 1) / kGramColumns * kGramColumns),
      load_(nodes_ * padded_) {
  for (std::size_t i = 0; i < nodes_; ++i) {
    for (std::size_t a = 0; a < count_; ++a) load_[i * padded_ + a] = sources.load[i * count_ + a];
  }
}

void GramSum::add(double* gram, const double* heat, std::size_t stride, double weight) const {
  add_gram(gram, heat, stride, {nodes_, count_, padded_, load_.data()}, weight);
}

}  // namespace photocoag::crosscheck
