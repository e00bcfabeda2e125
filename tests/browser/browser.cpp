#include "browser/browser.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <tuple>

namespace photocoag::testing {
namespace {

constexpr int kPatienceMs = 120'000;  // of one answer; a loaded machine starts slowly

[[noreturn]] void become_chromium(const std::string& program, const std::string& profile, int reads,
                                  int writes) {
  // Out of the way first: the browser reads from 3 and writes to 4.
  const int in = fcntl(reads, F_DUPFD, 100), out = fcntl(writes, F_DUPFD, 100);
  dup2(in, 3);
  dup2(out, 4);
  const int nothing = ::open("/dev/null", O_RDWR);
  dup2(nothing, 1);
  dup2(nothing, 2);
  execl(program.c_str(), program.c_str(), "--headless", "--no-sandbox", "--disable-gpu",
        "--disable-dev-shm-usage", "--no-first-run", "--hide-scrollbars",
        ("--user-data-dir=" + profile).c_str(), "--remote-debugging-pipe", "about:blank", nullptr);
  _exit(127);
}

}  // namespace

std::string chromium() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');)
    for (const char* name : {"chromium", "chromium-browser", "google-chrome"})
      if (const std::string program = folder + "/" + name; access(program.c_str(), X_OK) == 0)
        return program;
  return {};
}

Browser::Browser(const std::filesystem::path& folder) {
  signal(SIGPIPE, SIG_IGN);
  int down[2], up[2];
  if (pipe2(down, O_CLOEXEC) != 0 || pipe2(up, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  const std::string program = chromium(), profile = (folder / "profile").string();
  child_ = fork();
  if (child_ == 0) {
    setpgid(0, 0);
    become_chromium(program, profile, down[0], up[1]);
  }
  close(down[0]);
  close(up[1]);
  to_ = down[1];
  from_ = up[0];
  const Json target = call("Target.createTarget", {{"url", "about:blank"}});
  session_ = call("Target.attachToTarget",
                  {{"targetId", target["targetId"]}, {"flatten", true}})["sessionId"];
  for (const char* domain : {"Page.enable", "Runtime.enable", "Log.enable", "Network.enable"})
    call(domain);
}

Browser::~Browser() {
  kill(-child_, SIGKILL);
  waitpid(child_, nullptr, 0);
  close(to_);
  close(from_);
}

void Browser::open(const std::filesystem::path& file, const Look& look) {
  visit("file://" + std::filesystem::absolute(file).string(), "file:", look);
}

void Browser::visit(const std::string& url, const std::string& home, const Look& look) {
  complaints_.clear();
  home_ = home;
  resize(look);
  call("Page.navigate", {{"url", url}});
  const std::string there =
      "document.readyState == 'complete' && location.href.startsWith('" + home + "')";
  while (evaluate(there) != true) std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

double Browser::heap_bytes() {
  call("HeapProfiler.collectGarbage");
  return call("Runtime.getHeapUsage")["usedSize"];
}

void Browser::resize(const Look& look) {
  call("Emulation.setScriptExecutionDisabled", {{"value", !look.script}});
  call("Emulation.setDeviceMetricsOverride", {{"width", look.width},
                                              {"height", look.height},
                                              {"deviceScaleFactor", look.scale},
                                              {"mobile", false}});
  const char* scheme = look.dark ? "dark" : "light";
  call("Emulation.setEmulatedMedia",
       {{"features", {{{"name", "prefers-color-scheme"}, {"value", scheme}}}}});
}

Browser::Json Browser::evaluate(const std::string& expression) {
  const Json answer =
      call("Runtime.evaluate", {{"expression", expression}, {"returnByValue", true}});
  if (answer.contains("exceptionDetails"))
    throw std::runtime_error(answer["exceptionDetails"].dump());
  return answer["result"].value("value", Json());
}

void Browser::press(const std::string& key) {
  Json event = {{"key", key}};
  // What makes a button feel it.
  for (const auto& [name, code, text] :
       {std::tuple{"Enter", 13, "\r"}, {" ", 32, " "}, {"Tab", 9, ""}}) {
    if (key != name) continue;
    event["windowsVirtualKeyCode"] = code;
    if (*text != 0) event["text"] = text;
  }
  for (const char* what : {"keyDown", "keyUp"}) {
    event["type"] = what;
    call("Input.dispatchKeyEvent", event);
  }
}

void Browser::mouse(const std::string& what, double x, double y) {
  const bool moves = what == "mouseMoved";
  call("Input.dispatchMouseEvent", {{"type", what},
                                    {"x", x},
                                    {"y", y},
                                    {"button", moves ? "none" : "left"},
                                    {"clickCount", moves ? 0 : 1}});
}

Browser::Json Browser::call(const std::string& method, Json parameters) {
  Json message = {{"id", ++id_}, {"method", method}, {"params", std::move(parameters)}};
  if (!session_.empty()) message["sessionId"] = session_;
  const std::string text = message.dump() + '\0';
  if (write(to_, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    throw std::runtime_error("the browser does not listen");
  for (;;) {
    const Json answer = read();
    if (answer.value("id", 0) == id_) {
      if (answer.contains("error")) throw std::runtime_error(method + answer["error"].dump());
      return answer["result"];
    }
    const std::string event = answer.value("method", "");
    if (event == "Runtime.exceptionThrown" || event == "Log.entryAdded" ||
        event == "Runtime.consoleAPICalled")
      complaints_.push_back(answer["params"].dump());
    if (event == "Network.requestWillBeSent" &&
        !answer["params"]["request"]["url"].get<std::string>().starts_with(home_))
      complaints_.push_back(answer["params"]["request"].dump());
  }
}

Browser::Json Browser::read() {
  for (std::size_t end; (end = rest_.find('\0')) == std::string::npos;) {
    pollfd ready{from_, POLLIN, 0};
    char bytes[65536];
    const ssize_t count = poll(&ready, 1, kPatienceMs) > 0 ? ::read(from_, bytes, sizeof bytes) : 0;
    if (count <= 0) throw std::runtime_error("the browser does not answer");
    rest_.append(bytes, static_cast<std::size_t>(count));
  }
  const std::size_t end = rest_.find('\0');
  const Json message = Json::parse(rest_.substr(0, end));
  rest_.erase(0, end + 1);
  return message;
}

}  // namespace photocoag::testing
