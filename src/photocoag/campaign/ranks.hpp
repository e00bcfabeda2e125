// Role: offline; the processes of a campaign: MPI ranks if started by mpirun, else one. Used by
// campaign. The only user of MPI. Threads: the main thread only.
#pragma once

#include <optional>
#include <vector>

namespace photocoag {

/// Messages between the ranks; values are doubles.
class Ranks {
 public:
  /// Starts MPI if mpirun (or srun) started this process; ends it when destroyed. Throws Error if
  /// the launcher started another number of processes than MPI reports.
  Ranks();
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  int rank() const noexcept { return rank_; }
  int size() const noexcept { return size_; }
  /// True if this build has MPI.
  static bool has_mpi() noexcept;

  enum class Tag { kRequest = 1, kWork = 2, kResult = 3 };
  struct Message {
    int from = 0;
    Tag tag = Tag::kRequest;
    std::vector<double> values;
  };
  void send(int to, Tag tag, const std::vector<double>& values);
  /// A message that has arrived, if any.
  std::optional<Message> receive();
  /// Ends all ranks at once: after an error on one of them.
  [[noreturn]] void abort(int exit_code);

 private:
  int rank_ = 0;
  int size_ = 1;
  bool started_ = false;
};

}  // namespace photocoag
