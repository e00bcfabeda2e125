// A headless Chromium that a test drives over a pair of pipes (--remote-debugging-pipe).
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace photocoag::testing {

/// The program's path; empty if there is none in PATH.
std::string chromium();

class Browser {
 public:
  using Json = nlohmann::json;

  /// `folder`: for its profile. Throws std::runtime_error if it does not start.
  explicit Browser(const std::filesystem::path& folder);
  ~Browser();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  struct Look {
    int width = 1200, height = 900;
    bool dark = false;
    bool script = true;
    int scale = 1;  // pixels of the device per pixel: 2 is a zoom of 200 %
  };
  /// Opens a file and waits until it is there.
  void open(const std::filesystem::path& file, const Look& look);
  /// The same of an address; what is loaded from elsewhere than `home` is a complaint.
  void visit(const std::string& url, const std::string& home, const Look& look);
  /// Another window for the page that is there.
  void resize(const Look& look);
  /// Of the page's objects, after a collection.
  double heap_bytes();
  /// The value of an expression of JavaScript. Throws std::runtime_error with what it threw.
  Json evaluate(const std::string& expression);
  void press(const std::string& key);
  /// "mousePressed", "mouseMoved", "mouseReleased" at a place of the window.
  void mouse(const std::string& what, double x, double y);
  /// What the page has thrown, logged or tried to load since the last open().
  const std::vector<std::string>& complaints() const { return complaints_; }

 private:
  Json call(const std::string& method, Json parameters = Json::object());
  Json read();
  pid_t child_ = -1;
  int to_ = -1, from_ = -1, id_ = 0;
  std::string session_, rest_, home_ = "file:";
  std::vector<std::string> complaints_;
};

}  // namespace photocoag::testing
