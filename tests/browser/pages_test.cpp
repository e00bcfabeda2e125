// A report in a browser: what the script adds, and that nothing else runs.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>

#include "browser/browser.hpp"
#include "photocoag/report/report.hpp"
#include "report/run_folder.hpp"

namespace photocoag::testing {
namespace {

class Pages : public ::testing::Test {
 protected:
  void SetUp() override {
    if (chromium().empty()) GTEST_SKIP() << "there is no Chromium (Debian: chromium)";
    run_.write();
    write_report(run_.path);
    try {
      browser_ = std::make_unique<Browser>(run_.path);
    } catch (const std::runtime_error& error) {
      GTEST_SKIP() << chromium() << " does not start here: " << error.what();
    }
  }
  void TearDown() override {
    if (browser_ && !expects_complaints_)
      for (const std::string& complaint : browser_->complaints()) ADD_FAILURE() << complaint;
  }
  void open(const Browser::Look& look = {}) { browser_->open(run_.path / "report.html", look); }
  Browser::Json js(const std::string& expression) { return browser_->evaluate(expression); }
  std::string text(const std::string& expression) { return js(expression).get<std::string>(); }
  double number(const std::string& expression) { return js(expression).get<double>(); }
  // All drawn curves of the wide figures.
  std::string curves() {
    return text("[...document.querySelectorAll('.wide [data-m]')].map(e => e.outerHTML).join('')");
  }
  // Presses at one share of the width of the first figure's plot, releases at another.
  void drag(double from, double to) {
    js("document.querySelector('.wide svg').scrollIntoView()");
    const auto box =
        js("(() => { const s = document.querySelector('.wide svg'), b = s.getBoundingClientRect(),"
           "v = s.dataset.view.split(' ').map(Number), k = b.width / s.viewBox.baseVal.width;"
           "return [b.left + v[2] * k, b.left + v[3] * k, b.top + b.height / 2]; })()");
    const auto at = [&](double share) {
      return box[0].get<double>() + share * (box[1].get<double>() - box[0].get<double>());
    };
    browser_->mouse("mousePressed", at(from), box[2]);
    browser_->mouse("mouseMoved", at(0.5 * (from + to)), box[2]);
    browser_->mouse("mouseMoved", at(to), box[2]);
    browser_->mouse("mouseReleased", at(to), box[2]);
  }

  RunFolder run_;
  std::unique_ptr<Browser> browser_;
  bool expects_complaints_ = false;
};

TEST_F(Pages, TheCursorReadsTheLogAndIsSharedByAllFiguresOverTime) {
  open();
  js("document.querySelector('.wide svg').focus()");
  for (int k = 0; k < 7; ++k) browser_->press("ArrowRight");
  // The seventh cycle ends at 7 ms.
  EXPECT_EQ(text("document.querySelector('output').textContent"),
            fmt::format("time 7 ms; Peak temperature rise in K: true {:.5g}, estimate {:.5g}",
                        run_.peak(6), 30.0 * run_.peak(6) / 30.25));
  const std::string boxes =
      text("[...document.querySelectorAll('.wide svg')].map(s => s.textContent).join('\\n')");
  EXPECT_EQ(count_of(boxes, "time 7 ms"), 10U)
      << "five figures of the whole run, five of its start";
  EXPECT_NE(boxes.find(fmt::format("measured {:.5g}", 0.8 * run_.peak(6) + 0.1 * std::sin(42.0))),
            std::string::npos)
      << boxes;
  EXPECT_NE(boxes.find("applied 25"), std::string::npos) << boxes;
  browser_->press("End");
  EXPECT_TRUE(text("document.querySelector('output').textContent").starts_with("time 60 ms"));
}

TEST_F(Pages, DraggingZoomsOnePartOfTheRunAndEscapeShowsAllOfIt) {
  open();
  const std::string before = curves();
  const std::string ticks =
      "[...document.querySelectorAll('.wide svg')].map("
      "s => s.querySelector('[data-axis=x]').textContent.trim())";
  const auto labels = js(ticks);
  drag(0.5, 0.75);  // 30 to 45 ms
  const auto zoomed = js(ticks);
  for (std::size_t k = 0; k < 5; ++k) {
    EXPECT_EQ(zoomed[2 * k / 2], zoomed[0]) << "the whole run's figures go together";
    EXPECT_EQ(zoomed[5 + k], labels[5 + k]) << "its start stays";
  }
  EXPECT_NE(zoomed[0], labels[0]);
  EXPECT_NE(zoomed[0].get<std::string>().find("40"), std::string::npos) << zoomed[0];
  // Noise of 0.2 K fills much of the panel: the range of y is that of the data in view.
  const std::string noise = "document.querySelector('.wide [data-n=measured]').getBBox().height";
  EXPECT_GT(number(noise), 40.0);
  EXPECT_NE(curves(), before);
  browser_->press("Escape");
  EXPECT_EQ(js(ticks), labels);
  EXPECT_EQ(curves(), before);
  browser_->press("+");
  EXPECT_NE(curves(), before);
  browser_->press("-");
  EXPECT_EQ(curves(), before);
}

TEST_F(Pages, ANameHidesItsCurveByKey) {
  open();
  const std::string button = "document.querySelector('.wide [data-key][role=button]')";
  const std::string curve = "document.querySelector('.wide [data-n=true]').getClientRects().length";
  EXPECT_EQ(text(button + ".textContent.trim()"), "true");
  EXPECT_EQ(number(curve), 1.0);
  js(button + ".focus()");
  browser_->press("Enter");
  EXPECT_EQ(number(curve), 0.0);
  EXPECT_EQ(text(button + ".getAttribute('aria-pressed')"), "false");
  browser_->press(" ");
  EXPECT_EQ(number(curve), 1.0);
}

TEST_F(Pages, FitsAPhoneInBothColourSchemes) {
  std::string papers[2];
  for (const bool dark : {false, true}) {
    open({.width = 400, .dark = dark});
    EXPECT_LE(number("document.documentElement.scrollWidth"), 400.0);
    // Words stay in their drawings.
    EXPECT_EQ(
        js("[...document.querySelectorAll('.narrow svg')].filter(s => s.getClientRects().length)"
           ".flatMap(s => [...s.querySelectorAll('text')].filter(t => t.getBBox().x < -1 || "
           "t.getBBox().x + t.getBBox().width > s.viewBox.baseVal.width + 1)"
           ".map(t => t.textContent))"),
        Browser::Json::array());
    papers[dark ? 1 : 0] = text("getComputedStyle(document.body).backgroundColor");
  }
  EXPECT_EQ(papers[0], "rgb(255, 255, 255)");
  EXPECT_NE(papers[0], papers[1]);
}

TEST_F(Pages, WithoutScriptTheDrawingsAreTheSame) {
  open();
  const std::string with = curves();
  open({.script = false});
  // The debugger still evaluates.
  EXPECT_EQ(number("document.querySelectorAll('[role=application], .unseen').length"), 0.0);
  EXPECT_EQ(curves(), with);
}

TEST_F(Pages, AnotherScriptDoesNotRun) {
  expects_complaints_ = true;  // the policy says so in the log
  std::string page = run_.get("report.html");
  page.insert(page.find("<main>"),
              "<script>window.intruder = 1</script><img src=x onerror="
              "\"window.intruder = 2\">");
  run_.put("report.html", page);
  open();
  EXPECT_EQ(text("typeof window.intruder"), "undefined");
  EXPECT_FALSE(browser_->complaints().empty());
  EXPECT_GT(number("document.querySelectorAll('[role=application]').length"), 0.0) << "ours does";
}

}  // namespace
}  // namespace photocoag::testing
