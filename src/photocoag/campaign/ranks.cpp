#include "photocoag/campaign/ranks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <utility>

#include "photocoag/core/error.hpp"

#if PHOTOCOAG_HAS_MPI
#include <mpi.h>
#endif

namespace photocoag {
namespace {

struct Launch {
  std::string variable;
  int size = 0;
};

// What mpirun of Open MPI, of MPICH, and srun leave in the environment. A launcher may itself have
// been launched: the first is the innermost.
std::vector<Launch> launches() {
  std::vector<Launch> found;
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"}) {
    const char* value = std::getenv(name);
    const int size = value == nullptr ? 0 : std::atoi(value);
    if (size > 0) found.push_back({name, size});
  }
  return found;
}

// Processes unaware of each other would each run the whole campaign.
[[noreturn]] void refuse_launch(const Launch& launch, std::string problem, std::string accepted) {
  throw Error(ErrorParts{.where = "environment",
                         .key = launch.variable,
                         .problem = std::move(problem),
                         .found = fmt::format("{}", launch.size),
                         .accepted = std::move(accepted)});
}

}  // namespace

#if PHOTOCOAG_HAS_MPI

bool Ranks::has_mpi() noexcept { return true; }

Ranks::Ranks() {
  const std::vector<Launch> stated = launches();
  if (stated.empty()) return;
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  started_ = true;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
  try {
    if (provided < MPI_THREAD_FUNNELED) throw Error("this MPI library cannot be used with threads");
    const bool as_stated = std::any_of(stated.begin(), stated.end(),
                                       [&](const Launch& launch) { return launch.size == size_; });
    if (!as_stated) {
      refuse_launch(
          stated.front(), "the launcher is not that of this program's MPI",
          fmt::format("{}, as this MPI counts: start with the mpirun of the same MPI", size_));
    }
  } catch (...) {
    MPI_Finalize();
    throw;
  }
}

Ranks::~Ranks() {
  if (started_) MPI_Finalize();
}

void Ranks::send(int to, Tag tag, const std::vector<double>& values) {
  MPI_Send(values.data(), static_cast<int>(values.size()), MPI_DOUBLE, to, static_cast<int>(tag),
           MPI_COMM_WORLD);
}

std::optional<Ranks::Message> Ranks::receive() {
  if (size_ == 1) return {};
  int there = 0;
  MPI_Status status;
  MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &status);
  if (there == 0) return {};
  int count = 0;
  MPI_Get_count(&status, MPI_DOUBLE, &count);
  Message message{.from = status.MPI_SOURCE,
                  .tag = static_cast<Tag>(status.MPI_TAG),
                  .values = std::vector<double>(static_cast<std::size_t>(count))};
  MPI_Recv(message.values.data(), count, MPI_DOUBLE, status.MPI_SOURCE, status.MPI_TAG,
           MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  return message;
}

void Ranks::abort(int exit_code) {
  if (started_) MPI_Abort(MPI_COMM_WORLD, exit_code);
  std::_Exit(exit_code);
}

#else

bool Ranks::has_mpi() noexcept { return false; }
Ranks::Ranks() {
  for (const Launch& launch : launches()) {
    if (launch.size > 1) refuse_launch(launch, "this build has no MPI", "1");
  }
}
Ranks::~Ranks() = default;
void Ranks::send(int, Tag, const std::vector<double>&) {}
std::optional<Ranks::Message> Ranks::receive() { return {}; }
void Ranks::abort(int exit_code) { std::_Exit(exit_code); }

#endif

}  // namespace photocoag
