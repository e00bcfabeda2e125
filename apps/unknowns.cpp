// `photocoag estimation --compare`: filter against moving horizon, for one and two unknowns.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <optional>

#include "configured.hpp"
#include "console.hpp"
#include "estimation.hpp"
#include "estimation_cost.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/page/figure.hpp"
#include "photocoag/population/unknowns_study.hpp"
#include "photocoag/run/run_folder.hpp"

namespace photocoag {
namespace {

void print_case(const UnknownsResult& one, double period) {
  const std::size_t cycles = one.cycles.size();
  const std::size_t edges[] = {0, cycles / 25, cycles / 5, cycles};
  const bool two = one.which.estimator.unknowns == Unknowns::kRpeAndChoroid;
  std::string_view name = one.which.name;
  for (int i = 0; i < 3; ++i) {
    if (edges[i] == edges[i + 1]) continue;
    const UnknownsCycle mean = one.over(edges[i], edges[i + 1]);
    print("{:<36}{:>11}{:>8.2f}{:>8.2f}{:>8.3f}{:>8.2f}{:>8}{:>8.1f}{:>8}\n", name,
          fmt::format("{:g} to {:g}", 1e3 * period * static_cast<double>(edges[i] + 1),
                      1e3 * period * static_cast<double>(edges[i + 1])),
          100.0 * mean.alpha, 100.0 * mean.beta, mean.peak, mean.nees_alpha,
          two ? fmt::format("{:.2f}", mean.nees_beta) : "-", 100.0 * mean.at_bound,
          i == 2 ? fmt::format("{}", one.limit_exceeded) : "");
    name = "";
  }
}

std::string csv(const std::vector<UnknownsResult>& all, double period) {
  std::string text =
      "case,time_s,rms_alpha_relative,rms_beta_relative,rms_peak_K,nees_alpha,nees_beta,at_bound\n";
  for (const UnknownsResult& one : all) {
    for (std::size_t k = 0; k < one.cycles.size(); ++k) {
      const UnknownsCycle& c = one.cycles[k];
      fmt::format_to(std::back_inserter(text), "\"{}\",{},{},{},{},{},{},{}\n", one.which.name,
                     period * static_cast<double>(k + 1), c.alpha, c.beta, c.peak, c.nees_alpha,
                     c.nees_beta, c.at_bound);
    }
  }
  return text;
}

// The first fifth of the treatment.
Figure figure(const std::vector<UnknownsResult>& all, double period) {
  const std::size_t drawn = std::max<std::size_t>(2, all.front().cycles.size() / 5);
  Figure result{.description =
                    "Root mean square errors of alpha, beta and the peak over time, for the filter "
                    "and the moving horizon estimator with one and two unknowns",
                .x_label = "time in ms",
                .x_min = 0.0,
                .x_max = 1e3 * period * static_cast<double>(drawn)};
  const auto panel = [&](const char* title, double UnknownsCycle::*field, double factor) {
    Panel p{.title = title, .y_min = 0.0};
    constexpr Ink kInks[] = {Ink::kSeries1, Ink::kSeries2, Ink::kSeries3, Ink::kSeries4};
    std::size_t next = 0;
    for (const UnknownsResult& one : all) {
      const bool two = one.which.estimator.unknowns == Unknowns::kRpeAndChoroid;
      const bool default_prior = one.which.estimator.choroid_sigma_initial < 1.0;
      if (one.which.dark || (default_prior && one.which.estimator.choroid_max > 10.0) ||
          (!two && one.which.choroid_varies)) {
        continue;
      }
      // Filters solid, moving horizons dashed; a colour for each pair, the same in every panel.
      const bool mhe = one.which.estimator.kind == EstimatorKind::kMhe;
      const Ink ink = kInks[(next++ / 2) % std::size(kInks)];
      if (!two && field == &UnknownsCycle::beta) continue;
      Series series{
          .legend = one.which.name, .ink = ink, .dash = mhe ? Dash::kDashed : Dash::kSolid};
      for (std::size_t k = 0; k < drawn; ++k) {
        series.x.push_back(1e3 * period * static_cast<double>(k + 1));
        series.y.push_back(factor * one.cycles[k].*field);
      }
      p.series.push_back(std::move(series));
    }
    result.panels.push_back(std::move(p));
  };
  panel("Error of alpha in %", &UnknownsCycle::alpha, 100.0);
  panel("Error of beta in %", &UnknownsCycle::beta, 100.0);
  panel("Error of the peak in K", &UnknownsCycle::peak, 1.0);
  return result;
}

}  // namespace

int compare_estimators(const EstimationOptions& options) {
  const Config config = configured(Use::kEstimation, options.config, options.set);
  std::optional<ClaimedFolder> claimed;  // before the work
  if (!options.out.empty()) claimed.emplace(options.out);
  ModelStore models(config, !options.no_cache);
  const double period = config.control.period;
  std::vector<UnknownsResult> all;
  for (const UnknownsCase& which : unknowns_cases(config)) {
    all.push_back(unknowns_study(config, models, which, options.seeds));
    if (all.size() == 1) {
      print("photocoag {}: {}\n", version(), kResearchNotice);
      print(
          "{} full-order eyes, {:g} ms each; root mean square errors; NEES: squared errors over "
          "the stated variance, 1 is consistent\n\n",
          options.seeds, config.run.duration * 1e3);
      print("{:<36}{:>11}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}\n", "", "", "alpha", "beta", "peak",
            "NEES", "NEES", "at a", "above");
      print("{:<36}{:>11}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}\n", "estimator", "ms", "%", "%", "K",
            "alpha", "beta", "bound %", "limit");
    }
    print_case(all.back(), period);
  }
  print("\none sample, median, us:");
  for (const Unknowns unknowns : {Unknowns::kRpe, Unknowns::kRpeAndChoroid}) {
    EstimatorSettings settings = config.estimator;
    settings.unknowns = unknowns;
    for (const EstimatorKind kind : {EstimatorKind::kEkf, EstimatorKind::kMhe}) {
      settings.kind = kind;
      print(" {} {} {:.2f};", kind == EstimatorKind::kEkf ? "ekf" : "mhe",
            unknowns == Unknowns::kRpe ? "one unknown" : "two",
            estimator_cost_us(config, models.reduced(), settings));
    }
  }
  print(" window {}\n", config.estimator.window);
  if (!options.csv.empty()) write_output(options.csv, csv(all, period));
  if (options.out.empty()) return 0;
  const std::filesystem::path folder = options.out;
  const Figure drawing = figure(all, period);
  write_file((folder / "unknowns.csv").string(), csv(all, period));
  write_file((folder / "unknowns.svg").string(), figure_svg(drawing, SvgKind::kStandAlone));
  say("written   {0}/unknowns.csv, {0}/unknowns.svg\n", options.out);
  return 0;
}

}  // namespace photocoag
