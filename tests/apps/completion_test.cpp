// Shell completion and manual page: made from the commands, taken by the shells.
#include <gtest/gtest.h>

#include <cstdlib>

#include "apps/program.hpp"

namespace photocoag::testing {
namespace {

// What bash offers for these words, the last of which is being typed.
std::string offered(const Sandbox& sandbox, const std::string& words) {
  write_all(sandbox.path("complete.sh"), "source ./completion\nCOMP_WORDS=(" + words +
                                             ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n"
                                             "_photocoag \"${COMP_WORDS[0]}\"\n"
                                             "printf '%s\\n' \"${COMPREPLY[@]}\" >offered\n");
  const std::string command = "cd '" + sandbox.path(".").string() + "' && bash complete.sh";
  EXPECT_EQ(std::system(command.c_str()), 0) << words;
  return read_all(sandbox.path("offered"));
}

class Completion : public ::testing::Test {
 protected:
  void SetUp() override {
    const ProgramResult script = sandbox_.run("completion bash");
    ASSERT_EQ(script.exit_code, 0) << script.err;
    write_all(sandbox_.path("completion"), script.out);
  }
  Sandbox sandbox_;
};

TEST_F(Completion, OffersCommandsOptionsKeysAndWords) {
  EXPECT_EQ(offered(sandbox_, "photocoag tre"), "treat\n");
  EXPECT_EQ(offered(sandbox_, "photocoag tes"), "\n");
  EXPECT_EQ(offered(sandbox_, "./photocoag tes"), "test\n");
  EXPECT_EQ(offered(sandbox_, "./photocoag pack"), "package\n");
  EXPECT_EQ(offered(sandbox_, "photocoag simulate --see"), "--seed\n");
  EXPECT_EQ(offered(sandbox_, "photocoag treat --set control.hor"), "control.horizon=\n");
  EXPECT_EQ(offered(sandbox_, "photocoag treat --set tissue.layers.RPE.thick"),
            "tissue.layers.RPE.thickness_um=\n");
  EXPECT_EQ(offered(sandbox_, "photocoag bench cy"), "cycle\n");
  EXPECT_EQ(offered(sandbox_, "photocoag completion z"), "zsh\n");
}

TEST_F(Completion, EveryCommandIsInEveryScriptAndInTheManual) {
  const std::string help = sandbox_.run("--help").out;
  for (const std::string kind : {"bash", "zsh", "fish", "man"}) {
    const ProgramResult made = sandbox_.run("completion " + kind);
    ASSERT_EQ(made.exit_code, 0) << made.err;
    for (const std::string command : {"treat", "campaign", "config", "doctor", "completion"}) {
      EXPECT_NE(help.find("\n  " + command + " "), std::string::npos) << command;
      EXPECT_NE(made.out.find(command), std::string::npos) << kind << " " << command;
    }
  }
  EXPECT_EQ(sandbox_.run("completion tcsh").exit_code, 2);
}

TEST_F(Completion, TheShellsThatAreHereTakeTheirScripts) {
  for (const std::string shell : {"bash", "zsh", "fish"}) {
    write_all(sandbox_.path("script"), sandbox_.run("completion " + shell).out);
    const std::string command = "! command -v " + shell + " >/dev/null || " + shell + " -n '" +
                                sandbox_.path("script").string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0) << shell;
  }
}

}  // namespace
}  // namespace photocoag::testing
