// Role: tests of the documents; a sentence with figures, the command that they come from, and where
// in its output each of them stands.
#pragma once

#include <string>
#include <vector>

namespace photocoag::testing {

/// `from`: "/pointer" into summary.json of the run folder, "FILE ROW COLUMN" of a CSV file in the
/// output folder (rows from 0), of its claims.json "STUDY: TERM" (its interval's ends: ", low",
/// ", high") or "claims WHICH", how many, those about computation times left out: WHICH is a
/// verdict, "ours" or "count"; or else a regular expression with one group on what was printed.
struct Source {
  std::string from;
  double times = 1.0;  ///< quoted in another unit
};

/// In `sentence` the figures are in braces, line breaks of the document are blanks. The last quoted
/// digit is right: rounded to it the value is the figure.
struct Figures {
  std::string document;
  std::string sentence;
  std::string command;  ///< without ./photocoag; "--out out" is added to what makes a folder
  std::vector<Source> sources;
};

/// All that are checked.
const std::vector<Figures>& figures();

}  // namespace photocoag::testing
