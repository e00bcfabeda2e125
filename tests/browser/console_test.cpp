// The console's page in a browser, on a desk that the test feeds by hand.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <thread>

#include "browser/browser.hpp"
#include "console/consoles.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/console/describe.hpp"
#include "photocoag/console/token.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/run/model_cache.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

using namespace std::chrono_literals;

std::string before() {
  static const std::string message = [] {
    const Config config = load_config("", {"grid.min_cells=2000", "run.duration_ms=5000"});
    ModelStore models(config, true);
    return before_message(
        config, models.reduced(),
        {.name = "simulated eye", .browser_starts = true, .self_test_first = true},
        {{.topic = "kernel", .health = Health::kWarn, .found = "ordinary", .advice = "another"}});
  }();
  return message;
}

class ConsolePage : public ::testing::Test {
 protected:
  void SetUp() override {
    if (chromium().empty()) GTEST_SKIP() << "there is no Chromium (Debian: chromium)";
    try {
      browser_ = std::make_unique<Browser>(folder_.path());
    } catch (const std::runtime_error& error) {
      GTEST_SKIP() << chromium() << " does not start here: " << error.what();
    }
    serve(0);
    desk_.self_tested(good_self_test(), some_limits());
    open();
  }
  void TearDown() override {
    if (browser_ && !expects_complaints_)
      for (const std::string& complaint : browser_->complaints()) ADD_FAILURE() << complaint;
  }

  void serve(std::uint16_t port) {
    server_ =
        std::make_unique<ConsoleServer>(ServerSettings{.port = port, .token = token_, .limits = {}},
                                        desk_.hooks(page_file, nullptr));
  }
  void open(const Browser::Look& look = {}) {
    const std::string home = fmt::format("http://127.0.0.1:{}/", server_->port());
    browser_->visit(server_->address(), home, look);
    wait_for("document.getElementById('state').textContent.length > 3");
    wait_for("document.getElementById('role').textContent != ''");
  }
  Browser::Json js(const std::string& expression) { return browser_->evaluate(expression); }
  std::string text(const std::string& id) {
    return js("document.getElementById('" + id + "').textContent").get<std::string>();
  }
  bool holds(const std::string& expression) { return js("Boolean(" + expression + ")") == true; }
  bool visible(const std::string& id) {
    return holds("!document.getElementById('" + id + "').hidden");
  }
  void wait_for(const std::string& expression) {
    for (int k = 0; k < 1500; ++k) {
      if (holds(expression)) return;
      std::this_thread::sleep_for(20ms);
    }
    FAIL() << "never: " << expression << "; " << text("state") << " " << text("banner");
  }
  void wait_for_state(const std::string& word) {
    wait_for("document.getElementById('state').textContent.includes('" + word + "')");
  }
  /// Tab until an element has the focus.
  void tab_to(const std::string& id) {
    for (int k = 0; k < 60; ++k) {
      if (holds("document.activeElement && document.activeElement.id == '" + id + "'")) return;
      browser_->press("Tab");
    }
    FAIL() << id << " is not reached by Tab";
  }
  Desk::Wish wish() { return desk_.wait(20s); }
  /// The page says that STOP was sent; the desk hears of it a moment later.
  bool stopped() {
    for (int k = 0; k < 1000 && !stop_; ++k) std::this_thread::sleep_for(10ms);
    return stop_;
  }
  void begin(int number = 1) { desk_.begin({.number = number, .planned_cycles = 5000}); }
  /// The loop's cycles [from, to) with these estimated peaks, K.
  template <typename F>
  void feed(std::int64_t from, std::int64_t to, F&& peak) {
    for (std::int64_t k = from; k < to; ++k) {
      LogRecord record;
      record.cycle = k;
      record.time = static_cast<double>(k + 1) * 1e-3;
      record.measured = 10.0;
      record.power = record.authorization.power = record.end.next_power = 0.02;
      record.end.readback.power = 0.02;
      record.estimate.outputs.peak = peak(k);
      record.estimate.absorption_factor = 1.0;
      record.estimate.absorption_sigma = 0.01;
      while (!desk_.live().push(record)) std::this_thread::sleep_for(5ms);
    }
  }
  /// A session with a spot of each outcome; the last one is next.
  void tell_session() {
    Browser::Json spots = Browser::Json::array();
    int k = 0;
    for (const char* ending : {"treated", "goal-missed", "over-limit", "stopped", "device-fault",
                               "interrupted", "may-have-emitted", "skipped", "planned"}) {
      ++k;
      spots.push_back({{"name", fmt::format("A{}", k)},
                       {"x_um", 300 * (k % 5)},
                       {"y_um", k < 5 ? 0 : -300},
                       {"reference_K", 30},
                       {"duration_ms", 100},
                       {"most_energy_mJ", 10.1},
                       {"ending", ending},
                       {"words", ending},
                       {"wanted", k == 9},
                       {"attempts", k < 8 ? 1 : 0}});
      if (k >= 8) continue;
      spots.back().update({{"run", k},
                           {"why", "supervisor: stuck (safe_stop)"},
                           {"energy_mJ", 5.0},
                           {"peak_K", 30.1}});
    }
    desk_.tell_session(Browser::Json{
        {"type", "session"},
        {"title", "nine"},
        {"folder", "/runs/nine"},
        {"phase", "before"},
        {"spot", "A9"},
        {"why", ""},
        {"pause_ms", 50},
        {"begun_unix_s", 1.0},
        {"limits", {{{"name", "Energy"}, {"used", 40}, {"most", 100}, {"unit", "mJ"}}}},
        {"spots", spots}}.dump());
    desk_.offer({"skip", "end", "repeat"}, {"A1", "A5"});
    wait_for("document.getElementById('session-words').textContent.includes('is next')");
    wait_for("document.querySelectorAll('#spots tbody button').length == 2");
  }
  /// Dark pixels of the first figure between 15 and 25 K.
  double ink_in_the_middle() {
    return js("(() => { const c = document.querySelector('#charts canvas'), g = c.getContext('2d');"
              "const top = c.height * 0.30 | 0, tall = c.height * 0.16 | 0, left = c.width * 0.1 | "
              "0;"
              "const p = g.getImageData(left, top, c.width * 0.85 - left | 0, tall).data; let n = "
              "0;"
              "for (let i = 0; i < p.length; i += 4)"
              "  if (p[i + 3] > 100 && p[i] < 60) ++n; return n; })()")
        .get<double>();
  }

  TemporaryFolder folder_;
  std::string token_ = random_token();
  std::atomic<bool> stop_{false};
  std::atomic<int> resumed_{0};  ///< armed or started
  Desk desk_{{.browser_starts = true,
              .period = 1e-3,
              .stop = [this] { stop_ = true; },
              .resume =
                  [this] {
                    ++resumed_;
                    stop_ = false;
                  },
              .before = before()}};
  std::unique_ptr<ConsoleServer> server_;
  std::unique_ptr<Browser> browser_;
  bool expects_complaints_ = false;
};

TEST_F(ConsolePage, AWholeSpotByKeyboardAlone) {
  EXPECT_NE(text("test-items").find("✓ passed"), std::string::npos);
  for (const char* words : {"Research software, not a medical device", "SHA-256", "Certificate",
                            "Declared prior", "Limits", "Calibration", "Real-time health"}) {
    EXPECT_NE(js("document.body.textContent").get<std::string>().find(words), std::string::npos)
        << words;
  }
  tab_to("arm");
  browser_->press("Enter");
  wait_for_state("READY");
  tab_to("start");
  browser_->press("Enter");
  EXPECT_EQ(wish(), Desk::Wish::kStart);
  begin();
  feed(0, 300, [](auto) { return 29.5; });
  wait_for("document.querySelector('#charts output').textContent.startsWith('29.50')");
  EXPECT_NE(text("emission").find("20.0 mW"), std::string::npos);
  browser_->press(" ");
  wait_for("document.getElementById('answer').textContent.startsWith('STOP sent')");
  EXPECT_TRUE(stopped());
  desk_.over(SafetyState::kDone, SafetyReason::kNone);
  wait_for("document.getElementById('answer').textContent.startsWith('0 W reported')");
  EXPECT_NE(text("emission").find("0 W"), std::string::npos);
  desk_.end({.state = SafetyState::kDone,
             .message =
                 R"({"type":"spot","spot":1,"state":"done","why":"Stopped by hand.",)"
                 R"("what_to_do":"","failure":"","log_alarm":"","stopped":true,"folder":"/f",)"
                 R"("peak_estimate_max_K":29.5})",
             .folder = folder_.path()});
  wait_for("!document.getElementById('after').hidden");
  EXPECT_NE(text("after").find("29.50 K"), std::string::npos);
  tab_to("reset");
  browser_->press("Enter");
  EXPECT_EQ(wish(), Desk::Wish::kReset);
}

TEST_F(ConsolePage, SpaceStopsAndPressesNothingElse) {
  wait_for("!document.getElementById('arm').hidden");
  js("document.getElementById('arm').focus()");
  browser_->press(" ");
  wait_for("document.getElementById('answer').textContent.startsWith('STOP sent')");
  EXPECT_TRUE(stopped());
  stop_ = false;
  browser_->press(" ");
  EXPECT_TRUE(stopped()) << "what the first key had sent besides is heard by now";
  EXPECT_EQ(resumed_, 0) << "the button with the focus was not pressed";
  EXPECT_EQ(desk_.state(), SafetyState::kStandby);
  js("document.querySelector('summary').focus()");
  browser_->press(" ");
  EXPECT_TRUE(holds("document.querySelector('details').open"));
}

TEST_F(ConsolePage, FiftyClicksOnStopSetFiftyFlags) {
  begin();
  const auto at =
      js("(() => { const b = document.getElementById('stop').getBoundingClientRect();"
         "return [b.x + b.width / 2, b.y + b.height / 2]; })()");
  for (int k = 0; k < 50; ++k) {
    stop_ = false;
    browser_->mouse("mousePressed", at[0], at[1]);
    browser_->mouse("mouseReleased", at[0], at[1]);
    ASSERT_TRUE(stopped()) << k;
    std::this_thread::sleep_for(25ms);  // fifty in a second are too many
  }
}

TEST_F(ConsolePage, ASpikeOfOneSampleStaysVisible) {
  expects_complaints_ = true;  // the browser advises against reading a canvas twice
  begin();
  feed(0, 4500, [](auto) { return 8.0; });
  wait_for("document.querySelector('#charts output').textContent.startsWith('8.00')");
  std::this_thread::sleep_for(200ms);
  EXPECT_EQ(ink_in_the_middle(), 0.0);
  begin(2);
  std::this_thread::sleep_for(100ms);
  feed(0, 4500, [](auto k) { return k == 2001 ? 29.0 : 8.0; });
  wait_for("document.querySelector('#charts output').textContent.startsWith('8.00')");
  std::this_thread::sleep_for(200ms);
  EXPECT_GT(ink_in_the_middle(), 0.0);
}

TEST_F(ConsolePage, ADeadServerIsABannerAndANewOneIsFoundAgain) {
  expects_complaints_ = true;  // the browser logs the attempts
  const std::uint16_t port = server_->port();
  server_.reset();
  wait_for("!document.getElementById('banner').hidden");
  EXPECT_NE(text("banner").find("NO CONNECTION"), std::string::npos);
  wait_for("document.body.classList.contains('stale')");
  EXPECT_FALSE(visible("arm"));
  browser_->press(" ");
  EXPECT_NE(text("answer").find("could not be sent"), std::string::npos);
  EXPECT_FALSE(stop_);
  serve(port);
  wait_for("document.getElementById('banner').hidden");
  wait_for("!document.getElementById('arm').hidden");
}

TEST_F(ConsolePage, ASessionByKeyboardAlone) {
  tell_session();
  EXPECT_NE(text("session-words").find("A9 is next: 30 K, 100 ms"), std::string::npos);
  EXPECT_EQ(js("document.querySelectorAll('#map .spot:not(.now)').length"), 9);
  EXPECT_EQ(js("document.querySelectorAll('#spots tbody tr').length"), 9);
  EXPECT_NE(text("spots").find("may-have-emitted"), std::string::npos) << "words beside shapes";
  EXPECT_EQ(js("document.querySelectorAll('#spots tbody button').length"), 2) << "to be repeated";
  tab_to("skip");
  browser_->press("Enter");
  EXPECT_EQ(wish(), Desk::Wish::kChoice);
  EXPECT_EQ(desk_.choice(), "skip");
  js("document.querySelector('[aria-label=\"Repeat A5\"]').focus()");
  browser_->press("Enter");
  EXPECT_EQ(wish(), Desk::Wish::kChoice);
  EXPECT_EQ(desk_.choice(), "repeat A5");
  tab_to("run_on");
  browser_->press("Enter");
  wait_for("document.getElementById('run_on').getAttribute('aria-pressed') == 'true'");
  EXPECT_TRUE(desk_.runs_on());
  browser_->press(" ");
  wait_for("document.getElementById('run_on').getAttribute('aria-pressed') == 'false'");
  EXPECT_TRUE(stopped());
  EXPECT_FALSE(desk_.runs_on());
}

TEST_F(ConsolePage, FitsEveryScreenInBothSchemes) {
  tell_session();
  struct Screen {
    int width, height, scale;
  };
  for (const bool dark : {false, true}) {
    for (const Screen screen : {Screen{320, 640, 1}, {1280, 800, 1}, {640, 400, 2}}) {
      browser_->resize(
          {.width = screen.width, .height = screen.height, .dark = dark, .scale = screen.scale});
      std::this_thread::sleep_for(150ms);
      EXPECT_LE(js("document.documentElement.scrollWidth").get<int>(), screen.width);
      EXPECT_TRUE(
          holds("(() => { const b = document.getElementById('stop').getBoundingClientRect();"
                "return b.left >= 0 && b.right <= innerWidth && b.top >= 0 && "
                "b.bottom <= innerHeight; })()"))
          << "STOP is in sight at " << screen.width;
      // Nothing lies on anything else, but a fixed STOP on what scrolls below it.
      EXPECT_EQ(
          js("(() => { const boxes = [...document.querySelectorAll('.vitals > div, #stop, h1, "
             ".buttons button, .bar button, figcaption, .plot, th, td, summary, .lines > div')]"
             ".filter(e => e.getClientRects().length && getComputedStyle(e).position != 'fixed')"
             ".map(e => { const b = e.getBoundingClientRect(), s = e.closest('#spots');"
             "const c = s ? s.getBoundingClientRect() : b;"  // what is scrolled away lies nowhere
             "return [e.id || e.textContent.slice(0, 20), {left: b.left, right: b.right,"
             "top: Math.max(b.top, c.top), bottom: Math.min(b.bottom, c.bottom)}]; });"
             "const bad = []; for (let i = 0; i < boxes.length; ++i)"
             "for (let j = 0; j < i; ++j) { const [m, a] = boxes[i], [n, b] = boxes[j];"
             "if (Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 &&"
             "Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1) bad.push(m + ' on ' + n);"
             "} return bad; })()"),
          Browser::Json::array())
          << screen.width;
    }
  }
}

// axe-core from console/node_modules, where `npm ci` has put it.
TEST_F(ConsolePage, AxeFindsNothingSerious) {
  const std::string axe = PHOTOCOAG_SOURCE_DIR "/console/node_modules/axe-core/axe.min.js";
  if (!std::filesystem::exists(axe)) GTEST_SKIP() << "no axe-core: cd console && npm ci";
  const std::string source = read_file(axe, std::size_t{1} << 22);
  tell_session();
  begin();
  feed(0, 300, [](auto) { return 29.5; });
  for (const bool dark : {false, true}) {
    browser_->resize({.width = 1280, .height = 900, .dark = dark});
    js(source + ";0");
    js("window.found = null; axe.run().then(r => { window.found = r.violations.filter(v => "
       "['serious', 'critical'].includes(v.impact)).map(v => v.id + ': ' + "
       "v.nodes.map(n => n.target + ' ' + n.failureSummary).join(' | ')); }); 0");
    wait_for("window.found !== null");
    EXPECT_EQ(js("window.found"), Browser::Json::array()) << (dark ? "dark" : "light");
  }
}

// What ten minutes at 1 kHz bring, in twenty seconds.
TEST_F(ConsolePage, TenMinutesOfCyclesDoNotFillTheHeap) {
  begin();
  constexpr std::int64_t kSecond = 1000;  // cycles
  // A slow machine takes its time.
  const auto caught_up = [&](std::int64_t to) {
    wait_for(fmt::format("document.getElementById('state-words').textContent.includes('Cycle {} ')",
                         to * kSecond));
  };
  const auto seconds = [&](std::int64_t from, std::int64_t to) {
    for (std::int64_t k = from; k < to; ++k) {
      feed(k * kSecond, (k + 1) * kSecond, [](auto) { return 29.5; });
      std::this_thread::sleep_for(33ms);
      if (k % 3 == 2 || k + 1 == to) caught_up(k + 1);
    }
  };
  seconds(0, 70);  // the page's own memory is full
  const double early = browser_->heap_bytes();
  seconds(70, 600);
  EXPECT_LT(browser_->heap_bytes() - early, 10e6);
  EXPECT_EQ(server_->refusals().slow, 0U) << "drawing does not hold it up";
}

}  // namespace
}  // namespace photocoag::testing
