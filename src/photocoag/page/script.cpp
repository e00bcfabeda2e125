// The page's script: zoom, a cursor shared by all figures over the same quantity, hiding of series.
// It reads the data-… attributes that svg.cpp writes, and redraws curves and ticks as svg.cpp draws
// them. It fetches nothing and stores nothing.
#include "photocoag/page/page.hpp"

namespace photocoag {

std::string_view page_script() noexcept {
  return R"js('use strict';
const all = (root, what) => [...root.querySelectorAll(what)];
const list = text => text.split(' ').map(Number);
const show = v => isFinite(v) ? String(+v.toPrecision(5)).replace('-', '−') : '–';
const px = v => +v.toFixed(1);
const set = (e, values) => { for (const n in values) e.setAttribute(n, values[n]); };
const hide = (e, hidden) => hidden ? set(e, {display: 'none'}) : e.removeAttribute('display');
const said = document.body.appendChild(document.createElement('output'));
said.className = 'unseen';
let cursor = {};

function read(box) {
 const drawings = all(box, 'svg[data-view]'), [first] = drawings;
 if (!box.querySelector('[data-y]')) return [];
 const [a, b] = list(first.dataset.view);
 const f = {a, b, from: a, to: b, label: first.dataset.x, off: new Set(), samples: []};
 let xs;
 f.curves = all(first, '[data-m]').map(({dataset: d}) => {
  if (d.x) xs = list(d.x);
  if (xs.length > f.samples.length) f.samples = xs;
  return {xs, ys: list(d.y), zs: d.z && list(d.z), mark: d.m, key: d.k,
   ink: d.k.split(' ')[0], hold: /steps|bars/.test(d.m), 
   name: d.n || first.querySelector(`[data-key="${d.k}"]`)?.textContent.trim() || ''};
 });
 f.views = drawings.map(svg => {
  const [, , left, right] = list(svg.dataset.view), curves = [...f.curves];
  return {svg, left, right, panels: all(svg, '[data-panel]').map(g => {
   const [top, bottom, lo, hi, log] = list(g.dataset.panel);
   const lines = all(g, '[data-m]').map(e => [e, e.getAttribute('d'), curves.shift()]);
   const marks = g.appendChild(document.createElementNS(svg.namespaceURI, 'g'));
   set(marks, {'pointer-events': 'none'});
   const title = g.querySelector('.pc-text-title').textContent;
   return {top, bottom, lo, hi, log, lines, marks, title, levels: all(g, '[data-level]'),
    axes: all(g, '[data-axis]').map(e => [e, e.innerHTML])};
  })};
 });
 return [f];
}
const figures = all(document, 'figure').flatMap(read);

// The points in view; lines are cut at its edges.
function cut({xs, mark, hold}, ys, from, to) {
 const out = [], edge = (k, x) => {
  if (k && mark != 'dots' && xs[k - 1] < x && xs[k] > x) 
   out.push([x, hold ? ys[k] : ys[k - 1] + (ys[k] - ys[k - 1]) * (x - xs[k - 1]) / (xs[k] - xs[k - 1])]);
 };
 xs.forEach((x, k) => {
  edge(k, from);
  if (x >= from && x <= to) out.push([x, ys[k]]);
  edge(k, to);
 });
 return out;
}

function shape(mark, low, high, X, Y, base) {
 let d = '', part = [], before;
 const flush = () => {
  if (part.length) d += 'M' + part.map(k => X(low[k][0]) + ' ' + Y(low[k][1])).join('L') + 'L' +
   part.reverse().map(k => X(high[k][0]) + ' ' + Y(high[k][1])).join('L') + 'Z';
  part = [];
 };
 low.forEach(([x, y], k) => {
  if (mark == 'band') return isNaN(y + high[k][1]) ? flush() : part.push(k);
  if (isNaN(y)) return before = undefined;
  if (mark == 'dots') return d += `M${X(x)} ${Y(y)}h0`;
  const start = before === undefined;
  if (start) d += `M${X(x)} ${mark == 'bars' ? base : Y(y)}`;
  else d += (mark == 'line' ? '' : `L${X(before)} ${Y(y)}`) + `L${X(x)} ${Y(y)}`;
  before = x;
 });
 flush();
 return mark == 'bars' ? d + `V${base}Z` : d;
}

function axis(up, lo, hi, at, v, p) {
 const wanted = up ? (p.bottom - p.top) / 28 : (v.right - v.left) / 62;
 const rough = (hi - lo) / Math.max(wanted, 2), unit = 10 ** Math.floor(Math.log10(rough));
 const step = unit * [1, 2, 5, 10].find(k => k * unit >= rough);
 const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
 let grid = '', short = '', words = '';
 for (let k = Math.ceil(lo / step - 1e-9); k * step <= hi + 1e-9 * step; ++k) {
  const z = at(k * step);
  grid += up ? `M${v.left} ${z}H${v.right}` : `M${z} ${p.top}V${p.bottom}`;
  short += up ? `M${v.left} ${z}h-4.5` : `M${z} ${p.bottom}v4.5`;
  words += `<text class="pc-text-tick" text-anchor="${up ? 'end' : 'middle'}" x="${
   up ? v.left - 8 : z}" y="${up ? z + 4 : p.bottom + 18}">${(k * step).toFixed(digits).replace('-', '−')}</text>`;
 }
 return `<path class="pc-line-grid" d="${grid}"/><path class="pc-line-axis" d="${short}"/>` + words;
}

function draw(f) {
 const zoomed = f.from > f.a || f.to < f.b;
 for (const v of f.views) for (const p of v.panels) {
  const parts = p.lines.map(([, , c]) => [c.ys, c.zs || []].map(ys => ys.length ? cut(c, ys, f.from, f.to) : []));
  let {lo, hi} = p;
  const seen = parts.filter((_, k) => !f.off.has(p.lines[k][2].key)).flat(2).map(q => q[1]).filter(isFinite);
  if (zoomed && !p.log && seen.length) {
   const [low, high] = [Math.min, Math.max].map(least => seen.reduce((a, b) => least(a, b)));
   const room = 0.06 * Math.max(high - low, 1e-3 * Math.abs(high), 1e-12);
   [lo, hi] = [low - room, high + room];
  }
  const place = (y, a, b) => {
   const share = p.log ? Math.log(Math.max(y, a) / a) / Math.log(b / a) : (y - a) / (b - a);
   return px(p.bottom - Math.min(Math.max(share, 0), 1) * (p.bottom - p.top));
  };
  const X = v.X = x => px(v.left + (x - f.from) / (f.to - f.from) * (v.right - v.left));
  const Y = y => place(y, lo, hi);
  p.lines.forEach(([e, drawn, c], k) => {
   set(e, {d: zoomed ? shape(c.mark, ...parts[k], X, Y, p.bottom) : drawn});
   hide(e, f.off.has(c.key));
  });
  for (const [e, drawn] of p.axes) {
   const up = e.dataset.axis == 'y';
   e.innerHTML = !zoomed || up && p.log ? drawn : up ? axis(up, lo, hi, Y, v, p) : axis(up, f.from, f.to, X, v, p);
  }
  for (const e of p.levels) {
   const y = +e.dataset.level;
   set(e, {transform: `translate(0 ${Y(y) - place(y, p.lo, p.hi)})`});
   hide(e, y < lo || y > hi);
  }
 }
 mark(f);
}

// A step's value is that of its end; a dot counts where it is; else the nearest sample.
function value({xs, mark, hold}, ys, x, reach) {
 let k = xs.findIndex(v => v >= x);
 if (k < 0) k = xs.length - 1;
 if (!hold && k && x - xs[k - 1] < xs[k] - x) --k;
 return mark == 'dots' && Math.abs(xs[k] - x) > reach ? NaN : ys[k];
}

// The cursor in one figure; returns what it reads.
function mark(f) {
 const x = cursor.label == f.label ? cursor.x : NaN, [name, unit = ''] = f.label.split(/ in |, (?=\S+$)/);
 const head = `${name} ${show(x)} ${unit}`, words = [head];
 for (const v of f.views) for (const p of v.panels) {
  p.marks.innerHTML = '';
  if (!(x >= f.from && x <= f.to) || !v.svg.getClientRects().length) continue;
  const rows = p.lines.map(l => l[2]).filter(c => (c.name || !p.lines[1]) && !f.off.has(c.key)).map(c => {
   const at = ys => value(c, ys, x, (f.to - f.from) / 200);
   return [c.ink, `${c.name} ${show(at(c.ys))}${c.zs ? ' to ' + show(at(c.zs)) : ''}`];
  });
  words.push(p.title + ': ' + rows.map(row => row[1]).join(', '));
  const high = Math.min(15, (p.bottom - p.top) / (rows.length + 1)), at = v.X(x);
  p.marks.innerHTML = `<path class="pc-line-axis" d="M${at} ${p.top}V${p.bottom}"/><g><rect x="-4" y="-1" rx="3"
   class="pc-paper pc-line-grid" height="${high * (rows.length + 1) + 4}"/>${[['ink', head], ...rows].map(([ink], k) =>
   `<text class="pc-text-legend" style="font-size:${Math.min(12, high * 0.85)}px" y="${high * (k + 0.8)}"
   ><tspan class="pc-text-${ink}">${k ? '● ' : ''}</tspan></text>`).join('')}</g>`;
  const box = p.marks.lastChild, texts = all(box, 'text');
  texts.forEach((t, k) => t.append(k ? rows[k - 1][1] : head));
  const wide = Math.max(...texts.map(t => t.getComputedTextLength())) + 8;
  set(box.firstChild, {width: wide});
  set(box, {transform: `translate(${Math.max(at > (v.left + v.right) / 2 ? at - wide - 2 : at + 12, 6)} ${p.top + 2})`});
 }
 return words.join('; ');
}

function move(f, x) {
 cursor = {label: f.label, x};
 figures.forEach(mark);
}
function zoom(f, from, to) {
 if (to - from > (f.b - f.a) * 1e-5) for (const o of figures) if (o.label == f.label && o.a == f.a && o.b == f.b) {
  [o.from, o.to] = [Math.max(from, f.a), Math.min(to, f.b)];
  draw(o);
 }
}
function scale(f, factor, x) {
 const at = x >= f.from && x <= f.to ? x : (f.from + f.to) / 2;
 zoom(f, at - (at - f.from) * factor, at + (f.to - at) * factor);
}
function toggle(f, key) {
 f.off.delete(key) || f.off.add(key);
 for (const {svg} of f.views) for (const e of all(svg, '[data-key]')) if (e.dataset.key == key)
  set(e, {'aria-pressed': !f.off.has(key), opacity: f.off.has(key) ? 0.4 : 1});
 draw(f);
}

function listen(f, v) {
 const {svg} = v, on = (name, act) => svg.addEventListener(name, act, {passive: false});
 const key = e => e.target.closest('[data-key]')?.dataset.key;
 const at = e => {
  const box = svg.getBoundingClientRect(), x = (e.clientX - box.left) / box.width * svg.viewBox.baseVal.width;
  return f.from + (Math.min(Math.max(x, v.left), v.right) - v.left) / (v.right - v.left) * (f.to - f.from);
 };
 const nearest = x => f.samples.reduce((a, b) => Math.abs(b - x) < Math.abs(a - x) ? b : a);
 let start;
 on('pointermove', e => {
  if (start === undefined) return move(f, nearest(at(e)));
  for (const p of v.panels) p.marks.innerHTML =
   `<path class="pc-area-neutral" d="M${v.X(start)} ${p.top}H${v.X(at(e))}V${p.bottom}H${v.X(start)}Z"/>`;
 });
 on('pointerleave', () => start === undefined && document.activeElement != svg && move(f, NaN));
 on('pointerdown', e => {
  if (e.button || key(e)) return;
  start = at(e);
  svg.setPointerCapture(e.pointerId);
 });
 on('pointerup', e => {
  if (start === undefined) return;
  const [a, b] = [start, at(e)].sort((p, q) => p - q);
  start = undefined;
  v.X(b) - v.X(a) > 5 ? zoom(f, a, b) : move(f, nearest(b));
 });
 on('pointercancel', () => start = undefined);
 on('dblclick', () => zoom(f, f.a, f.b));
 on('wheel', e => {
  if (!e.ctrlKey && document.activeElement != svg) return;
  e.preventDefault();
  scale(f, e.deltaY < 0 ? 0.8 : 1.25, at(e));
 });
 on('click', e => key(e) && toggle(f, key(e)));
 on('keydown', e => {
  const step = {ArrowLeft: -1, ArrowRight: 1, Home: -Infinity, End: Infinity}[e.key];
  if (key(e) && (e.key == 'Enter' || e.key == ' ')) toggle(f, key(e));
  else if (e.key == 'Escape') zoom(f, f.a, f.b);
  else if (e.key == '+' || e.key == '=') scale(f, 0.5, cursor.x);
  else if (e.key == '-') scale(f, 2, cursor.x);
  else if (step) {
   const inside = f.samples.filter(x => x >= f.from && x <= f.to);
   const now = cursor.label == f.label ? inside.indexOf(nearest(cursor.x)) : -1;
   move(f, inside[Math.min(Math.max(now + step * (e.shiftKey ? 10 : 1), 0), inside.length - 1)]);
   said.textContent = mark(f);
  } else return;
  e.preventDefault();
 });
 set(svg, {tabindex: 0, role: 'application', 'aria-label': svg.getAttribute('aria-label') +
  ' Arrow keys read values, plus and minus zoom, Escape resets.'});
 for (const e of all(svg, '[data-key]')) set(e, {role: 'button', tabindex: 0, 'aria-pressed': true});
}
for (const f of figures) {
 draw(f);
 f.views.forEach(v => listen(f, v));
}
document.querySelector('svg[tabindex]')?.closest('section')?.querySelector('h2')?.insertAdjacentHTML('afterend',
 '<p class="hint">Drag, wheel, + or − to zoom; Esc resets; arrow keys read values; a click on a name hides its curve.</p>');
)js";
}

}  // namespace photocoag
