#include "slow/document_figures.hpp"

#include <fmt/format.h>

namespace photocoag::testing {
namespace {

constexpr double kMs = 1e3;
constexpr double kPercent = 1e2;

const std::string kPeak = "/peak_true_max_K";
const std::string kFast = "/time_to_95_percent_s";
const std::string kFree250Hz =
    "simulate --set control.period_ms=4 --set run.duration_ms=400 --set safety.supervisor=off";
const std::string kSchemes = "discretizations --set plant.absorption_factor=0.7363";

void add_readme(std::vector<Figures>& list) {
  const std::string readme = "README.md";
  const std::string first = "simulate";
  list.push_back({readme,
                  "peak at most {30.18} K, limit 32 K not exceeded 95 % of 30 K after {3} ms; RMS "
                  "error after 50 ms {0.07} K",
                  first,
                  {{kPeak}, {kFast, kMs}, {"/rms_error_after_50_ms_K"}}});
  list.push_back({readme,
                  "absorption factor {1.098} estimated, 1.1 true ({-0.2} %)",
                  first,
                  {{R"(absorption factor (\S+) estimated)"}, {R"(true \((\S+) %\))"}}});
  list.push_back({readme,
                  "order 6, for 1 ms; largest error {0.83} % of the peak, {0.78} % of the "
                  "volume temperature (absorption factor 0.3 to 1.7)",
                  first,
                  {{"largest error (\\S+) %"}, {"peak, (\\S+) %"}}});
  list.push_back({readme,
                  "misses of the first steps, {11.8} % of the peak at 1 ms",
                  kSchemes,
                  {{"discretizations.csv 0 peak_error_relative", -kPercent}}});
  list.push_back({readme,
                  "It takes {7} ms instead of 3 ms to reach 95 % of 30 K",
                  "simulate --set plant.absorption_factor=0.5",
                  {{kFast, kMs}}});
  list.push_back(
      {readme,
       "the peak gets to {33.32} K, above the limit, for {20} cycles, and the absorption "
       "factor is estimated {16} % too high",
       "simulate --set plant.tissue.spot_radius_um=90",
       {{kPeak}, {"/limit_violations"}, {"/absorption_error_final", kPercent}}});
  list.push_back({readme,
                  "the first 4 ms at 100 mW already heat the spot to {37.76} K",
                  kFree250Hz,
                  {{kPeak}}});
  list.push_back({readme,
                  "first choice of weights (R1 = 5e4) keeps it at {30.35} K",
                  "simulate --config configs/paper-250hz-a.toml",
                  {{kPeak}}});
  list.push_back({readme,
                  "the robust limit keeps it at {30.20} K, {8} ms instead of 4 ms to 95 %",
                  kFree250Hz + " --set control.robust=certified",
                  {{kPeak}, {kFast, kMs}}});
}

/// The paper's cases, two rows of the table for each sweep.
void add_cases(std::vector<Figures>& list) {
  struct Case {
    const char* name;
    const char* file;
    const char* figures[2];
  };
  const Case cases[] = {{"1 kHz, R1 = R2 = 0, N = 2",
                         "paper-1khz",
                         {"{30.40} K | {0} | {7} ms | {0.08} K | {0.5} %",
                          "{30.47} K | {0} | {3} ms | {0.10} K | {0.5} %"}},
                        {"250 Hz a): R1 = 5e4",
                         "paper-250hz-a",
                         {"{30.08} K | {0} | {28} ms | {0.43} K | {0.8} %",
                          "{30.35} K | {0} | {4} ms | {0.16} K | {0.5} %"}},
                        {"250 Hz b): R0 delayed, R1 = 5e1",
                         "paper-250hz-b",
                         {"{30.94} K | {0} | {16} ms | {0.14} K | {0.8} %",
                          "{30.46} K | {0} | {16} ms | {0.13} K | {0.5} %"}},
                        {"250 Hz c): R2 = 5e4",
                         "paper-250hz-c",
                         {"{30.84} K | {0} | {12} ms | {0.14} K | {0.8} %",
                          "{30.87} K | {0} | {8} ms | {0.13} K | {0.5} %"}},
                        {"250 Hz d): R0 delayed, R2 = 5e1",
                         "paper-250hz-d",
                         {"{30.89} K | {0} | {16} ms | {0.14} K | {0.8} %",
                          "{30.41} K | {0} | {16} ms | {0.13} K | {0.5} %"}}};
  for (const Case& one : cases) {
    for (int row = 0; row < 2; ++row) {
      const auto cell = [row](const char* column) {
        return fmt::format("sweep.csv {} {}", row, column);
      };
      list.push_back(
          {"README.md",
           fmt::format("| {} | {} | {} |", one.name, row == 0 ? "0.5" : "1.1", one.figures[row]),
           fmt::format("sweep --config configs/{}.toml --vary "
                       "plant.absorption_factor=0.5,1.1 --seeds 20",
                       one.file),
           {{cell("max_peak_max_K")},
            {cell("max_over_limit_cycles")},
            {cell("median_time_to_95_ms")},
            {cell("max_late_rms_error_K")},
            {cell("max_absorption_final_error_percent")}}});
    }
  }
}

void add_equations(std::vector<Figures>& list) {
  const std::string equations = "docs/equations.md";
  struct Step {
    int row;  // of implicit Euler; TR-BDF2 stands a hundred rows below
    const char* figures;
  };
  const Step steps[] = {
      {0, "| 1 ms | 1 | {133.18} | {117.43} | {−11.8} % | {140.66} | {+5.6} % |"},
      {1, "| 1 ms | 2 | {197.42} | {185.22} | {−6.2} % | {197.35} | {−0.04} % |"},
      {3, "| 1 ms | 4 | {291.14} | {281.14} | {−3.4} % | {291.35} | {+0.07} % |"},
      {9, "| 1 ms | 10 | {470.73} | {461.94} | {−1.9} % | {470.82} | {+0.02} % |"},
      {99, "| 1 ms | 100 | {968.25} | {967.05} | {−0.1} % | {968.25} | {0.00} % |"},
      {200, "| 4 ms | 1 | {291.14} | {254.01} | {−12.8} % | {306.77} | {+5.4} % |"},
      {201, "| 4 ms | 2 | {421.77} | {387.59} | {−8.1} % | {421.64} | {−0.03} % |"},
      {209, "| 4 ms | 10 | {791.63} | {778.47} | {−1.7} % | {791.85} | {+0.03} % |"}};
  for (const Step& step : steps) {
    const auto cell = [](int row, const char* column) {
      return fmt::format("discretizations.csv {} {}", row, column);
    };
    const int other = step.row + 100;
    list.push_back({equations,
                    step.figures,
                    kSchemes,
                    {{cell(step.row, "exact_peak_K")},
                     {cell(step.row, "peak_K")},
                     {cell(step.row, "peak_error_relative"), kPercent},
                     {cell(other, "peak_K")},
                     {cell(other, "peak_error_relative"), kPercent}}});
  }
  list.push_back({equations,
                  "The first step is {12} % low at 1 ms",
                  kSchemes,
                  {{"discretizations.csv 0 peak_error_relative", -kPercent}}});
  list.push_back(
      {equations,
       "prints them: {0.83} % of the peak and {0.78} % of the volume temperature at worst "
       "(1 ms, order 6, default tissue)",
       "simulate",
       {{"largest error (\\S+) %"}, {"peak, (\\S+) %"}}});
  const std::string volume =
      "response --model full --power 1 --times 0.001 --csv - --set plant.absorption_factor=0.7363";
  const std::string last_column = "0.001,[^,]+,(\\S+)";
  list.push_back({equations, "after 1 ms: {52.89} and 66.32 K/W", volume, {{last_column}}});
  list.push_back({equations,
                  "after 1 ms: 52.89 and {66.32} K/W",
                  volume + " --set tissue.volume_temperature=normalized",
                  {{last_column}}});
  const std::string gains =
      "response --model full --power 1 --times 0.1,0.4,100 --csv - --set "
      "plant.absorption_factor=0.7363";
  const std::vector<Source> three = {{"0.1,([^,]+),"}, {"0.4,([^,]+),"}, {"100,([^,]+),"}};
  list.push_back({equations, "| default layers | {968.2} | {1117.7} | {1162.6} |", gains, three});
  list.push_back(
      {equations, "| with vitreous and a thick sclera | {972.1} | {1164.7} | {1344.3} |",
       gains +
           " --set 'tissue.layers=[{name=\"vitreous\", thickness_um=2000.0, absorption_per_m=0.0}, "
           "{name=\"retina\", thickness_um=190.0, absorption_per_m=0.0}, "
           "{name=\"RPE\", thickness_um=6.0, absorption_per_m=120400.0, scaled_by=\"alpha\"}, "
           "{name=\"unpigmented\", thickness_um=4.0, absorption_per_m=0.0}, "
           "{name=\"choroid\", thickness_um=400.0, absorption_per_m=2662.2}, "
           "{name=\"sclera\", thickness_um=2000.0, absorption_per_m=0.0}]'",
       three});
}

/// Defaults that the table of choices names.
void add_choices(std::vector<Figures>& list) {
  struct Choice {
    const char* sentence;
    std::vector<Source> sources;
  };
  const Choice choices[] = {
      {"| spot radius | {100} µm |", {{"\\nspot_radius_um *= (\\S+)"}}},
      {"| RPE thickness | {6} µm |", {{"\"RPE\", *thickness_um = (\\S+?),"}}},
      {"| outer radius | {2} mm |", {{"\\ndomain_radius_um *= (\\S+)", 1e-3}}},
      {"| transmission | {1} |", {{"\\ntransmission *= (\\S+)"}}},
      {"| ambient | {22} °C", {{"\\nambient_C *= (\\S+)"}}},
      {"| measurement noise | {0.288} K per control sample",
       {{"\\nmeasurement_noise_K *= (\\S+)"}}},
      {"before the first sample | {0.7363} |", {{"\\nabsorption_initial *= (\\S+)"}}},
      {"in the filter | {0.2} to {2.0} |",
       {{"\\nabsorption_min *= (\\S+)"}, {"\\nabsorption_max *= (\\S+)"}}},
      {"| unknown power | {0.4} mW per control sample",
       {{"\\npower_process_noise_W *= (\\S+)", 1e3}}},
      {"| duration | {250} ms |", {{"\\nduration_ms *= (\\S+)"}}}};
  for (const Choice& choice : choices) {
    list.push_back({"docs/equations.md", choice.sentence, "config", choice.sources});
  }
}

/// Of the paper's claims: documents, and what a study's file says of a claim that differs.
void add_claims(std::vector<Figures>& list) {
  struct Quoted {
    const char* document;
    const char* sentence;
    std::vector<Source> sources;
  };
  const char* results = "docs/results.md";
  const char* control = "docs/control.md";
  const char* hot = "studies/spots-30k-250hz.toml";
  const Quoted quoted[] = {
      {results,
       "Of {50} claims, {12} of them ours and marked so, {42} hold, {5} differ, {2} are undecided "
       "and {1} (the software",
       {{"claims count"},
        {"claims ours"},
        {"claims holds"},
        {"claims differs"},
        {"claims undecided"},
        {"claims cannot be judged here"}}},
      {results,
       "the power reaches 0.1 W | {70} mW (alpha 0.6)",
       {{"spots-30k-250hz: min(power_max_mW, r1_low)"}}},
      {results,
       "30 K, 250 Hz: alpha is undershot by more than 5 % | by {2.5} % ({0.4} to {4} %)",
       {{"spots-30k-250hz: median(absorption_dip_percent, r1_low)"},
        {"spots-30k-250hz: median(absorption_dip_percent, r1_low), low"},
        {"spots-30k-250hz: median(absorption_dip_percent, r1_low), high"}}},
      {results,
       "R2 = 5e4 exceeds the limit by 2 K | the estimate stays {1.1} K below it",
       {{"spots-30k-250hz: max(estimate_over_limit_K, r2_low)", -1.0}}},
      {results,
       "R2 = 8e5 looks like R1 = 5e4 | {1.7} K rms apart",
       {{"spots-30k-250hz: max(estimate_rms_difference_K, r2_strong_low, r1_low)"}}},
      {results,
       "1 kHz overshoots no more than 250 Hz | by {0.48} K instead of {0.35} K (a), alpha 1.1)",
       {{"closed-loop-1khz: max(overshoot_K, fast_high)"},
        {"closed-loop-1khz: max(overshoot_K, a_high)"}}},
      {results,
       "| undecided | {4.7} % ({1.4} to {7.5} %): noise alone makes it |",
       {{"same-spot-10k: median(absorption_dip_percent, r2_low)"},
        {"same-spot-10k: median(absorption_dip_percent, r2_low), low"},
        {"same-spot-10k: median(absorption_dip_percent, r2_low), high"}}},
      {results,
       "| undecided: {0.50} K in the worst of 20 seeds |",
       {{"four-spots-1khz: max(estimate_overshoot_K, spot3)"}}},
      {control,
       "Plans of 5 ms exceed it by {6.6} K with the right model and by {7.8} K with the wrong one",
       {{"blind-plans: min(over_limit_K, right_5)"}, {"blind-plans: min(over_limit_K, wrong_5)"}}},
      {control,
       "what the wrong model costs then (some {1.1} K) is the estimator's",
       {{"blind-plans: max(late_mean_error_K, wrong_10)"}}},
      {control,
       "95 % of 30 K come after {4} instead of {3} ms (alpha 1.1) and after the same {7} ms",
       {{"delayed-cost-1khz: median(time_to_95_ms, delayed_high)"},
        {"delayed-cost-1khz: median(time_to_95_ms, free_high)"},
        {"delayed-cost-1khz: median(time_to_95_ms, delayed_low)"}}},
      {hot,
       "stops at about {70} mW: with the default tissue",
       {{"spots-30k-250hz: min(power_max_mW, r1_low)"}}},
      {hot,
       "The undershoot here is some {2.5} % of the truth",
       {{"spots-30k-250hz: median(absorption_dip_percent, r1_low)"}}},
      {hot,
       "later than R1 = 5e4, by {1.7} K rms over the treatment",
       {{"spots-30k-250hz: max(estimate_rms_difference_K, r2_strong_low, r1_low)"}}}};
  for (const Quoted& one : quoted) {
    list.push_back({one.document, one.sentence, "reproduce --quick", one.sources});
  }
}

/// Boxes that are decided within seconds.
void add_certified(std::vector<Figures>& list) {
  const Source proved{"at most (\\d+) changes? of the active set everywhere"};
  const Source seen{"seen +(\\d+) at most"};
  const Source boxes{"search +(\\d+) boxes, 0 left open"};
  const Source limit{"gives up +after (\\d+),"};
  const auto add = [&](const char* sentence, const char* options, std::vector<Source> sources) {
    list.push_back({"docs/certify.md", sentence,
                    std::string("certify --set control.horizon=") + options, std::move(sources)});
  };
  add("| 2 | {1} | {1} | all | {5} | {32} |", "2", {proved, seen, boxes, limit});
  add("| 3 | {4} | {4} | all | {255} | {48} |", "3", {proved, seen, boxes, limit});
  add("| 28 to 31 | {4} | {4} | all | {89} |", "5 --free 28,31", {proved, seen, boxes});
  add("| 28.5 to 31.5 | {4} | {4} | all | {561} |", "5 --free 28.5,31.5", {proved, seen, boxes});
  add("| 30 to 40 | {4} | {4} | all | {313} |", "5 --free 30,40", {proved, seen, boxes});
}

}  // namespace

const std::vector<Figures>& figures() {
  static const std::vector<Figures> list = [] {
    std::vector<Figures> all;
    add_readme(all);
    add_cases(all);
    add_equations(all);
    add_choices(all);
    add_claims(all);
    add_certified(all);
    return all;
  }();
  return list;
}

}  // namespace photocoag::testing
