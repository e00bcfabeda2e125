#include "photocoag/campaign/ranks.hpp"

#include <cstdlib>

#include "photocoag/core/error.hpp"

#if PHOTOCOAG_HAS_MPI
#include <mpi.h>
#endif

namespace photocoag {
namespace {

// What mpirun of Open MPI, of MPICH, and srun leave in the environment.
int launched_size() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}) {
    if (const char* value = std::getenv(name)) return std::atoi(value);
  }
  return 0;
}

}  // namespace

#if PHOTOCOAG_HAS_MPI

bool Ranks::has_mpi() noexcept { return true; }

Ranks::Ranks() {
  if (launched_size() == 0) return;
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  started_ = true;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
  if (provided < MPI_THREAD_FUNNELED) throw Error("this MPI library cannot be used with threads");
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

bool Ranks::any(bool flag) {
  if (size_ == 1) return flag;
  int mine = flag ? 1 : 0;
  int all = 0;
  MPI_Allreduce(&mine, &all, 1, MPI_INT, MPI_LOR, MPI_COMM_WORLD);
  return all != 0;
}

void Ranks::abort(int exit_code) {
  if (started_) MPI_Abort(MPI_COMM_WORLD, exit_code);
  std::_Exit(exit_code);
}

#else

bool Ranks::has_mpi() noexcept { return false; }
Ranks::Ranks() {
  if (launched_size() > 1) {
    throw Error("this build has no MPI: several ranks would each do the whole campaign");
  }
}
Ranks::~Ranks() = default;
void Ranks::send(int, Tag, const std::vector<double>&) {}
std::optional<Ranks::Message> Ranks::receive() { return {}; }
bool Ranks::any(bool flag) { return flag; }
void Ranks::abort(int exit_code) { std::_Exit(exit_code); }

#endif

}  // namespace photocoag
