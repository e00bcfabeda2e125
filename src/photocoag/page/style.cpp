// The page's style: one column of text, figures side by side where there is room, tables that fit a
// phone, paper in light colours with everything unfolded. Colours are the drawings' (figure_css)
// and the few below; red is for the limit and alarms only.
#include "photocoag/page/page.hpp"

namespace photocoag {

std::string_view page_css() noexcept {
  return R"css(
:root{--quiet:#59636d;--line:#d9dde1;--panel:#f4f6f7;color-scheme:light dark}
@media screen and (prefers-color-scheme:dark){
:root{--quiet:#9aa5b0;--line:#303840;--panel:#1b2025}
}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%;text-size-adjust:100%}
body{margin:0;background:var(--paper);color:var(--ink);font:16px/1.5 system-ui,-apple-system,
"Segoe UI",Roboto,"Noto Sans","Liberation Sans",Arial,sans-serif;
font-variant-numeric:tabular-nums lining-nums}
main{max-width:1136px;margin:0 auto;padding:24px 32px 32px}
h1,h2,h3,p,dl,dd,dt,figure,table{margin:0;padding:0}
.kicker{color:var(--quiet);font-size:.875rem;letter-spacing:.02em}
h1{display:flex;gap:12px;font-size:1.5rem;line-height:1.3;
font-weight:600;margin:10px 0 8px;text-wrap:pretty}
.verdict{flex:1}
.badge{flex:none;align-self:start;width:1.3em;height:1.3em;line-height:1.2em;border:1.5px solid
currentColor;border-radius:4px;text-align:center;font-size:1em}
.badge.alarm{background:var(--limit);border-color:var(--limit);color:var(--paper)}
.run{color:var(--quiet);font-size:.9375rem}
.path,.hash{overflow-wrap:anywhere}
.notice{margin-top:14px;padding:8px 12px;border-left:3px solid var(--neutral);
background:var(--panel);font-size:.9375rem}
.warning{margin-top:10px;padding:8px 12px;border-left:3px solid var(--limit);
background:var(--panel);font-size:.9375rem}
.tiles{display:grid;grid-template-columns:repeat(4,1fr);gap:12px 24px;margin:26px 0 0;
padding:14px 0;border:solid var(--line);border-width:1px 0}
.tiles dt{color:var(--quiet);font-size:.875rem}
.tiles dd{font-size:1.625rem;line-height:1.25;font-weight:600;letter-spacing:-.01em}
.tiles small{display:block;font-size:.875rem;font-weight:400;color:var(--quiet);
letter-spacing:0;margin-top:2px;line-height:1.35}
section{margin-top:36px}
h2{font-size:1.1875rem;line-height:1.3;font-weight:600;margin-bottom:12px}
h3{font-size:.9375rem;font-weight:600;color:var(--quiet);margin-bottom:8px}
.columns{display:grid;gap:28px 40px}
.columns.count-2{grid-template-columns:repeat(2,minmax(0,1fr))}
.columns.count-1 .stack{grid-template-columns:repeat(2,minmax(0,1fr))}
.stack{display:grid;gap:22px 40px}
.hint+.columns,.hint+.stack,.hint+.scroll{margin-top:14px}
.narrow{display:none}
.tables{display:grid;grid-template-columns:repeat(3,minmax(0,1fr));gap:24px 40px}
table{border-collapse:collapse;font-size:.9375rem;line-height:1.4}
.keys{width:100%;margin-bottom:24px}
caption{text-align:left;font-weight:600;padding-bottom:4px}
.keys th,.keys td{border-top:1px solid var(--line);padding:5px 0;vertical-align:baseline}
.keys th{text-align:left;font-weight:400;padding-right:12px}
.keys th small{display:block;color:var(--quiet);font-size:.8125rem;line-height:1.3}
.keys td{text-align:right;white-space:nowrap;font-weight:500}
.keys th[colspan]{overflow-wrap:anywhere;padding-right:0}
.keys .alarm th,.keys .alarm td{color:var(--limit);font-weight:600}
.scroll{overflow-x:auto;max-width:100%}
.data{font-size:.875rem}
.data th,.data td{border-top:1px solid var(--line);padding:4px 0 4px 18px;text-align:right;
white-space:nowrap;font-weight:400}
.data thead th{white-space:pre;border-top:0;color:var(--quiet);font-size:.8125rem;line-height:1.25;
vertical-align:bottom}
.data tr>:first-child{padding-left:0;text-align:left}
.data tbody tr>:first-child{position:sticky;left:0;background:var(--paper)}
section>p{font-size:.9375rem}
pre{margin:0;font:.8125rem/1.5 ui-monospace,SFMono-Regular,Menlo,Consolas,"DejaVu Sans Mono",
monospace;white-space:pre-wrap;overflow-wrap:anywhere;background:var(--panel);padding:12px 14px;
border-radius:4px}
code{font-family:ui-monospace,SFMono-Regular,Menlo,Consolas,"DejaVu Sans Mono",monospace;
font-size:.93em}
pre code{font-size:inherit}
.config{white-space:pre;overflow-wrap:normal;overflow-x:auto}
.command{margin:12px 0}
.facts{font-size:.9375rem;margin-bottom:20px}
.facts div{display:grid;grid-template-columns:12rem 1fr;gap:0 16px;padding:4px 0;
border-top:1px solid var(--line)}
.facts dt{color:var(--quiet)}
.hash{font:.8125rem/1.6 ui-monospace,SFMono-Regular,Menlo,Consolas,"DejaVu Sans Mono",monospace}
details{border-top:1px solid var(--line);padding:10px 0}
summary{cursor:pointer;font-weight:600}
details[open]>summary{margin-bottom:10px}
.unseen{position:absolute;width:1px;height:1px;overflow:hidden;clip-path:inset(50%)}
svg[tabindex]{touch-action:pan-y;user-select:none;-webkit-user-select:none;cursor:crosshair}
[data-key][role]{cursor:pointer}
:focus-visible{outline:2px solid var(--series-1);outline-offset:2px}
.hint{color:var(--quiet);font-size:.875rem;margin-top:10px}
footer{margin-top:32px;padding-top:12px;border-top:1px solid var(--line);color:var(--quiet);
font-size:.875rem}
@media screen and (max-width:960px){
.columns.count-2,.columns.count-1 .stack{grid-template-columns:minmax(0,1fr)}
.stack{max-width:680px}
.tables{grid-template-columns:repeat(2,minmax(0,1fr))}
}
@media screen and (max-width:640px){
main{padding:16px 16px 24px}
h1{font-size:1.25rem}
.wide{display:none}
.narrow{display:block;max-width:420px}
.tiles{grid-template-columns:repeat(2,minmax(0,1fr));gap:14px 16px}
.tiles dd{font-size:1.375rem}
.tables{grid-template-columns:minmax(0,1fr);gap:0}
.facts div{grid-template-columns:minmax(0,1fr)}
}
@media print{
@page{size:A4;margin:15mm 14mm}
:root{color-scheme:light;--paper:#fff;--ink:#000}
body{font-size:10pt;background:none}
main{max-width:none;padding:0}
h1{font-size:15pt}
h2{font-size:12pt;break-after:avoid}
h3{break-after:avoid}
section{margin-top:18pt}
figure,.keys,.tiles,.data tr{break-inside:avoid}
.wide{display:none}
.narrow{display:block}
.columns,.stack{gap:10pt 18pt}
.tables{gap:0 18pt}
.keys,.facts,.run,.notice,.warning,section>p,.hint,footer{font-size:9pt}
.keys{margin-bottom:12pt}
.keys th,.keys td{padding:2pt 0}
.keys th small,.tiles small,.tiles dt{font-size:7.5pt}
.tiles{margin-top:12pt;padding:8pt 0}
.tiles dd{font-size:15pt}
.data{font-size:7pt}
.data thead th{white-space:pre;font-size:6.5pt}
.data th,.data td{padding-left:7pt}
.scroll{overflow:visible;break-inside:avoid}
.config{white-space:pre-wrap;overflow-wrap:anywhere}
pre{font-size:7.5pt;padding:0;background:none}
.notice,.warning,.badge.alarm{print-color-adjust:exact;-webkit-print-color-adjust:exact}
details::details-content{content-visibility:visible;display:block;block-size:auto}
}
)css";
}

}  // namespace photocoag
