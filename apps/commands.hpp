// Role: the program; one function per command: parse is done, call the libraries, print. Each
// returns the exit code: 0 good, 1 a check failed or the treatment was stopped. Bad input throws
// Error (exit code 2).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "photocoag/run/spots.hpp"

namespace photocoag {

/// Options that several commands share.
struct CommonOptions {
  std::string config;            ///< TOML file; empty: defaults
  std::vector<std::string> set;  ///< "key=value"
  bool no_cache = false;
};

struct ConfigOptions : CommonOptions {
  bool schema = false;  ///< print the JSON Schema instead
};

struct RunOptions : CommonOptions {
  std::string out;                  ///< run folder; empty: a new one below runs/
  std::string seed;                 ///< as given; empty: from the configuration
  std::string device;               ///< of `treat`: empty, or see run/device_address.hpp
  std::vector<std::string> faults;  ///< of an eye that `treat` starts itself
  bool json = false;                ///< the outcome as JSON on standard output
};

struct ResponseOptions : CommonOptions {
  std::string model = "full";
  std::string rom;
  double power = 0.0;         ///< W
  std::vector<double> times;  ///< s
  std::string csv = "-";
};

struct ReduceOptions : CommonOptions {
  std::string out;  ///< model file; with compare: a folder or a .csv file, may be empty
  bool compare = false;
  std::string method;
  std::string order;
  bool json = false;  ///< sizes and errors as JSON on standard output
};

struct ExportOptions : CommonOptions {
  std::string out;                         ///< folder, new or empty
  std::vector<double> absorption_factors;  ///< columns of B
};

struct ExportCOptions : CommonOptions {
  std::string out;  ///< folder, new or empty
  std::string prefix = "pc_";
  bool single_precision = false;
};

struct CertifyCommandOptions : CommonOptions {
  std::string absorption;      ///< "low,high"; empty: the estimator's bounds
  std::string choroid;         ///< the same of beta
  std::string free;            ///< K
  std::string previous;        ///< W; empty: the configured powers
  std::size_t boxes = 20'000;  ///< most to look at
  std::string out;             ///< model file with the proof in it; may be empty
  bool again = false;          ///< even if the model file has a proof
  bool json = false;
};

struct FieldOptions : CommonOptions {
  std::string model = "full";
  std::optional<double> power;  ///< W, constant
  std::string run;              ///< or a run folder
  std::vector<double> times;    ///< s
  std::string out;              ///< folder, new or empty
};

struct DiscretizationsOptions : CommonOptions {
  std::string out;  ///< folder for CSV and figure; may be empty
};

struct SpotsOptions : CommonOptions {
  std::size_t count = 1000;
  SpotRange range;
  std::string csv;          ///< file for one row per spot; may be empty
  bool corners = false;     ///< all extremes of the declared set instead of random spots
  bool this_eye = false;    ///< the eye of [plant.tissue] instead
  std::size_t survey = 60;  ///< treatments of every corner; the worst get count
};

struct EstimationOptions : CommonOptions {
  int seeds = 200;
  std::string csv;       ///< file; - is standard output; may be empty
  bool compare = false;  ///< filter against moving horizon, one and two unknowns
  std::string out;       ///< of the comparison: folder for figure and CSV; may be empty
};

struct FaultsOptions {
  std::string row;                  ///< one id; empty: all
  bool without_supervisor = false;  ///< to see that every row needs it
  int allocation_step = 97;         ///< row X3: every n-th allocation fails
  int healthy = 0;                  ///< treatments without faults, to count false stops
  int kills = 0;                    ///< controllers to kill beside an eye in another process
  int stops = 0;                    ///< controllers to stop for 20 ms
};

struct ReplayOptions {
  std::string run;  ///< run folder
  bool no_cache = false;
};

struct DoctorOptions {
  std::string json;  ///< file; - is standard output
};

struct LatencyOptions {
  double seconds = 10.0;
  double period_ms = 1.0;
  std::string json;  ///< file; - is standard output
};

struct BenchOptions {
  std::string name;              ///< cycle, qp, first-cycle
  std::string config;            ///< cycle: one row more, for this file …
  std::vector<std::string> set;  ///< … with these
  std::string json;              ///< file; - is standard output
  std::string svg;               ///< qp: figure
  std::string problems;          ///< qp: the recorded problems, JSON
  int repetitions = 10;          ///< qp: of every step
  bool one_process = false;      ///< first-cycle: measure in this process, print one number
};

struct InformationOptions : CommonOptions {
  int eyes = 100;
  std::string out;  ///< folder, new or empty; empty: the table alone
};

int treat(const RunOptions& options);
int simulate(const RunOptions& options);
int response(const ResponseOptions& options);
int reduce_command(const ReduceOptions& options);
int compare_command(const ReduceOptions& options);
int export_command(const ExportOptions& options);
int export_c_command(const ExportCOptions& options);
int certify_command(const CertifyCommandOptions& options);
int field_command(const FieldOptions& options);
int print_config(const ConfigOptions& options);
int boundaries(const CommonOptions& options);
int discretizations(const DiscretizationsOptions& options);
int information(const InformationOptions& options);
int spots_command(const SpotsOptions& options);
int estimation(const EstimationOptions& options);
int compare_estimators(const EstimationOptions& options);
int bench(const BenchOptions& options);
int faults_command(const FaultsOptions& options);
int doctor_command(const DoctorOptions& options);
int latency_command(const LatencyOptions& options);
int kill_trials(const FaultsOptions& options);
int replay_command(const ReplayOptions& options);

}  // namespace photocoag
