// HTML that is safe by default, and pages that nothing can add a script to.
#include "photocoag/page/html.hpp"

#include <gtest/gtest.h>

#include "photocoag/core/base64.hpp"
#include "photocoag/core/sha256.hpp"
#include "photocoag/page/page.hpp"
#include "report/run_folder.hpp"

namespace photocoag {
namespace {

TEST(HtmlBuilder, EscapesTextAndAttributes) {
  const std::string evil = "<b>\"&'\x01";
  EXPECT_EQ(element("p.a.b", evil, {{"title", evil}}).str(),
            "<p class=\"a b\" title=\"&lt;b&gt;&quot;&amp;&#39;\uFFFD\">"
            "&lt;b&gt;&quot;&amp;&#39;\uFFFD</p>\n");
  EXPECT_EQ(element("li", {"a < b ", element("code", "x&y"), Html::raw("<br>")}).str(),
            "<li>a &lt; b <code>x&amp;y</code><br></li>\n");
}

TEST(HtmlBuilder, ATableNamesItsRowsAndColumns) {
  const std::string html =
      table({.head = {"run", "peak\nK"}, .rows = {{"<a>", "1"}, {"b", "2"}}}, "All \"runs\"").str();
  EXPECT_EQ(testing::xml_problem(html), "");
  EXPECT_NE(html.find("aria-label=\"All &quot;runs&quot;\""), std::string::npos);
  EXPECT_NE(html.find("<th scope=\"row\">&lt;a&gt;</th><td>1</td>"), std::string::npos);
  EXPECT_EQ(testing::count_of(html, "scope=\"col\""), 2U);
}

// The policy names the script by its hash: nothing else runs, should anything ever slip through.
TEST(Page, ItsPolicyAllowsItsOwnScriptAlone) {
  const std::string html = page({.title = "T", .kicker = "k", .headline = {}, .line = "l"}, "body");
  EXPECT_EQ(testing::count_of(html, "<script"), 1U);
  const std::size_t begin = html.find("<script>") + 8;
  const std::string script = html.substr(begin, html.find("</script>") - begin);
  EXPECT_EQ(script, page_script());
  const std::string digits = sha256_hex(script);
  std::vector<unsigned char> bytes;
  for (std::size_t k = 0; k < digits.size(); k += 2)
    bytes.push_back(static_cast<unsigned char>(std::stoi(digits.substr(k, 2), nullptr, 16)));
  EXPECT_NE(html.find("default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-" +
                      base64(bytes) + "'\""),
            std::string::npos);
}

TEST(Page, ItsScriptIsSmallAndAsksForNothing) {
  const std::string script(page_script());
  EXPECT_LT(script.size(), 11'000U);
  for (const char* part :
       {"fetch", "XMLHttp", "import", "http", "eval", "Function(", "storage", "cookie", "</script"})
    EXPECT_EQ(script.find(part), std::string::npos) << part;
}

}  // namespace
}  // namespace photocoag
