// Role: the Python package; many treatments on all cores: seeds, configurations, spots of a
// campaign, studies of the paper.
#include <nanobind/stl/function.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "common.hpp"
#include "photocoag/campaign/campaign_file.hpp"
#include "photocoag/campaign/report.hpp"
#include "photocoag/campaign/spot.hpp"
#include "photocoag/campaign/spot_rows.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/parallel.hpp"
#include "photocoag/run/claimed_folder.hpp"
#include "photocoag/study/reproduce.hpp"
#include "run.hpp"

namespace photocoag::python {
namespace {

// Calls a worker's job(i) for each i below `count` on `threads` threads until `stop`; the first
// exception stops all workers and is rethrown.
void on_all(std::size_t count, unsigned threads, std::atomic<bool>& stop,
            std::atomic<std::size_t>& done,
            const std::function<std::function<void(std::size_t)>()>& make_worker) {
  const auto most = static_cast<unsigned>(std::min<std::size_t>(thread_count(threads), count));
  Workers<std::size_t, std::size_t> workers(most, [&make_worker, &stop] {
    return [job = make_worker(), &stop](std::size_t i) {
      try {
        job(i);
      } catch (...) {
        stop = true;
        throw;
      }
      return i;
    };
  });
  for (std::size_t i = 0; i < count; ++i) workers.add(i);
  while (done < count && !stop.load()) done += workers.wait().size();
}

std::function<void()> watch_of(nb::handle progress, const std::atomic<std::size_t>& done,
                               std::size_t total) {
  if (progress.is_none()) return {};
  return [progress, &done, total] { progress(done.load(), total); };
}

// Runs of arbitrary configurations.
nb::list simulate_all(const std::vector<OwnedConfig>& configs, unsigned threads, bool use_cache,
                      nb::handle progress) {
  for (const OwnedConfig& config : configs) config.require_simulation();
  std::vector<std::shared_ptr<OwnedRun>> runs(configs.size());
  std::atomic<std::size_t> done{0};
  interruptible(
      [&](std::atomic<bool>& stop) {
        on_all(configs.size(), threads, stop, done, [&] {
          return [&](std::size_t i) {
            const Config& config = configs[i].config();
            runs[i] = std::make_shared<OwnedRun>(
                simulated(config, models_without_gil(config, use_cache, true), stop));
          };
        });
      },
      watch_of(progress, done, configs.size()));
  if (!progress.is_none()) progress(done.load(), configs.size());
  nb::list list;
  for (const auto& run : runs) list.append(run);
  return list;
}

// Runs of one configuration with different seeds.
nb::list simulate_seeds(const OwnedConfig& owned, const std::vector<std::uint64_t>& seeds,
                        unsigned threads, bool use_cache, nb::handle progress) {
  owned.require_simulation();
  std::vector<std::shared_ptr<OwnedRun>> runs(seeds.size());
  std::atomic<std::size_t> done{0};
  interruptible(
      [&](std::atomic<bool>& stop) {
        const auto models = models_without_gil(owned.config(), use_cache, true);
        on_all(seeds.size(), threads, stop, done, [&] {
          return [&](std::size_t i) {
            Config config = owned.config();
            config.run.seed = seeds[i];
            runs[i] = std::make_shared<OwnedRun>(simulated(config, models, stop));
          };
        });
      },
      watch_of(progress, done, seeds.size()));
  if (!progress.is_none()) progress(done.load(), seeds.size());
  nb::list list;
  for (const auto& run : runs) list.append(run);
  return list;
}

constexpr std::uint64_t kMostSpotsInMemory = 10'000'000;

// (columns by name, units by name, summary as JSON)
nb::tuple campaign(const std::string& file, unsigned threads, bool use_cache, nb::handle progress) {
  const Campaign description = load_campaign(file);
  if (description.spots > kMostSpotsInMemory) {
    throw Error(ErrorParts{.where = file,
                           .key = "spots",
                           .problem = "too many to keep in memory, as this function does",
                           .found = std::to_string(description.spots),
                           .accepted = "at most " + std::to_string(kMostSpotsInMemory) +
                                       "; the program `photocoag campaign` has no such limit, and "
                                       "its campaign.h5 can be read in parts"});
  }
  std::vector<SpotRecord> spots(description.spots);
  std::atomic<std::size_t> done{0};
  interruptible(
      [&](std::atomic<bool>& stop) {
        const SpotModels models = make_spot_models(description, use_cache);
        on_all(spots.size(), threads, stop, done, [&] {
          const auto runner = std::make_shared<SpotRunner>(description, models);
          return [&spots, runner](std::size_t i) { spots[i] = runner->run(i); };
        });
      },
      watch_of(progress, done, spots.size()));
  if (!progress.is_none()) progress(done.load(), spots.size());
  nb::dict columns;
  nb::dict units;
  const auto add = [&](const std::string& name, std::string_view unit, auto get) {
    std::vector<std::decay_t<decltype(get(spots[0]))>> values;
    values.reserve(spots.size());
    for (const SpotRecord& spot : spots) values.push_back(get(spot));
    const nb::str key(name.c_str());
    columns[key] = array_of(values);
    units[key] = nb::str(unit.data(), unit.size());
  };
  add("spot", "1", [](const SpotRecord& s) { return s.spot; });
  add("noise_seed", "1", [](const SpotRecord& s) { return s.noise_seed; });
  for (std::size_t i = 0; i < description.inputs.size(); ++i) {
    const std::string& key = description.inputs[i].key;
    add(key, input_unit(key), [i](const SpotRecord& s) { return s.inputs[i]; });
  }
  for (std::size_t i = 0; i < outcome_columns().size(); ++i) {
    const OutcomeColumn& column = outcome_columns()[i];
    add(std::string(column.name), column.unit, [i](const SpotRecord& s) { return s.outcomes[i]; });
  }
  return nb::make_tuple(columns, units,
                        campaign_json(description, summarize_campaign(rows_of(spots))));
}

// (study, claim, verdict, expected) of every claim.
nb::list reproduce_all(const std::string& studies, const std::string& out, bool quick,
                       bool use_cache, nb::handle progress) {
  std::atomic<std::size_t> thousandths{0};
  std::vector<StudyOutcome> outcomes;
  interruptible(
      [&](std::atomic<bool>&) {
        const ClaimedFolder folder(out);
        outcomes = reproduce(
            {.studies = studies, .out = folder.path(), .quick = quick, .use_cache = use_cache},
            [&](std::string_view, double fraction) {
              thousandths = static_cast<std::size_t>(1000.0 * fraction);
            });
      },
      watch_of(progress, thousandths, 1000));
  nb::list list;
  for (const StudyOutcome& outcome : outcomes) {
    for (const JudgedClaim& claim : outcome.claims) {
      const std::string_view verdict = name_of(claim.verdict);
      list.append(nb::make_tuple(outcome.study.title, claim.claim.text,
                                 nb::str(verdict.data(), verdict.size()), claim.as_expected()));
    }
  }
  return list;
}

}  // namespace

void bind_many(nb::module_& module) {
  module.def("simulate_seeds", &simulate_seeds, nb::arg("config"), nb::arg("seeds"),
             nb::arg("threads"), nb::arg("use_cache"), nb::arg("progress").none());
  module.def("simulate_all", &simulate_all, nb::arg("configs"), nb::arg("threads"),
             nb::arg("use_cache"), nb::arg("progress").none());
  module.def("campaign", &campaign, nb::arg("file"), nb::arg("threads"), nb::arg("use_cache"),
             nb::arg("progress").none());
  module.def("reproduce", &reproduce_all, nb::arg("studies"), nb::arg("out"), nb::arg("quick"),
             nb::arg("use_cache"), nb::arg("progress").none());
}

}  // namespace photocoag::python
