// The program's memory at the end of campaigns of 10^4 to 10^6 spots, whose journals are there
// already: it does not grow with them. Killed while it writes the table, it writes the same one.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <string>

#include "photocoag/campaign/journal.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/random.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;
using testing::TemporaryFolder;

// A folder with all spots in its journal, nearly in their order, as threads leave them.
void make_campaign(const TemporaryFolder& folder, const std::string& name, std::uint64_t spots) {
  const std::string file = folder.file(name + ".toml");
  write_file(file, "spots = " + std::to_string(spots) +
                       "\nset = [\"plant.model=reduced\", \"grid.min_cells=4000\"]\n[[input]]\n"
                       "key = \"plant.absorption_factor\"\ndistribution = \"uniform\"\nlow = 0.4\n"
                       "high = 1.4\n");
  const Campaign campaign = load_campaign(file);
  fs::create_directory(folder.path() / name);
  Journal journal(folder.path() / name / "journal.bin", campaign);
  SpotRecord record{.spot = 0, .noise_seed = 0, .inputs = {0.0}, .outcomes = {}};
  record.outcomes.resize(outcome_columns().size());
  for (std::uint64_t k = 0; k < spots; ++k) {
    record.spot = k ^ 3U;
    if (record.spot >= spots) record.spot = k;
    record.inputs[0] = uniform(1, record.spot, RandomStream::kTest);
    for (std::size_t i = 0; i < record.outcomes.size(); ++i) {
      record.outcomes[i] = uniform(i + 2, record.spot, RandomStream::kTest) + record.inputs[0];
    }
    journal.append(record);
  }
}

// Of the process, as it says itself, MB. `before` is shell text put before the program.
double memory_of(const TemporaryFolder& folder, const std::string& name,
                 const std::string& before = "", int exit_code = 0) {
  const std::string command = "cd '" + folder.path().string() + "' && XDG_CACHE_HOME=cache " +
                              before + " '" PHOTOCOAG_PROGRAM "' campaign " + name +
                              ".toml --out " + name + " 2>said";
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), exit_code);
  const std::string said = read_file(folder.file("said"), 1'000'000);
  const std::size_t at = said.find("memory    ");
  return at == std::string::npos ? 0.0 : std::stod(said.substr(at + 10));
}

TEST(CampaignMemory, DoesNotGrowWithTheSpots) {
  const TemporaryFolder folder;
  make_campaign(folder, "warm", 4);
  memory_of(folder, "warm");  // makes the model, which takes memory of its own
  std::vector<double> memory;
  for (const std::string name : {"10000", "100000", "1000000"}) {
    make_campaign(folder, name, std::stoull(name));
    memory.push_back(memory_of(folder, name));
    RecordProperty("MB_at_" + name, std::to_string(memory.back()));
    if (name != "1000000") fs::remove_all(folder.path() / name);
  }
  ASSERT_GT(memory[0], 1.0);
  // Buffers fill up, of which the external sort has some 15 MB; the rows of 10^6 spots are 168 MB.
  EXPECT_LT(memory[1], memory[0] + 20.0);
  EXPECT_LT(memory[2], memory[0] + 20.0);

  const fs::path table = folder.path() / "1000000" / "campaign.h5";
  const fs::path whole = folder.path() / "whole.h5";
  fs::rename(table, whole);
  write_file(folder.file("kill.sh"),
             "\"$@\" & p=$!\nwhile kill -0 $p 2>/dev/null && [ ! -e 1000000/campaign.h5.part ]\n"
             "do sleep 0.002; done\nkill -9 $p\nwait $p\n");
  memory_of(folder, "1000000", "sh kill.sh", 128 + 9);
  EXPECT_FALSE(fs::exists(table));
  memory_of(folder, "1000000");
  EXPECT_EQ(std::system(("cmp '" + whole.string() + "' '" + table.string() + "'").c_str()), 0);
}

}  // namespace
}  // namespace photocoag
