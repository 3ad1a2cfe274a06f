"use strict";
// The curves: one uPlot for each chart, linked by the instant that is looked at and by the zoom.

report.charts = (() => {
  const { data, array, linear, colour, number, element, state } = report;
  const dashes = [[], [7, 4], [9, 3, 2, 3], [2, 3], [], [7, 4], [9, 3, 2, 3], []];
  const live = new Map(); // charts on the screen, by key
  const hidden = new Set(); // names of laws that are switched off
  let levels = true, axisKey = null, zoom = null;

  const lawColour = (k) => colour(`--law-${k % 8}`);
  const axisOf = (chart) => chart.axes.find((axis) => axis.key === axisKey) || chart.axes[0];

  // A constant's rounding noise is no curve: the range has a least size.
  function range(low, high) {
    if (low === null || high === null) return [0, 1];
    const size = Math.max(Math.abs(low), Math.abs(high));
    if (size < 1e-12) return [-1, 1];
    const middle = (low + high) / 2;
    const half = high - low > 1e-6 * size ? 0.55 * (high - low) : 0.055 * size;
    return [middle - half, middle + half];
  }

  // All curves over the union of their places: uPlot wants one column of places for all.
  function aligned(chart, key) {
    const curves = chart.curves.map((curve) => [array(curve.places[key]), array(curve.values)]);
    const places = union(curves.map(([x]) => x));
    const columns = curves.map(([x, y]) => onto(places, x, y));
    const constants = chart.levels.map((level) => places.map(() => level.value));
    return [places, ...columns, ...constants];
  }

  function union(all) {
    const unique = new Set();
    const merged = [];
    for (const x of all) for (const value of x) if (!unique.has(value)) { unique.add(value); merged.push(value); }
    return merged.sort((a, b) => a - b);
  }

  function onto(places, x, y) {
    const rising = x[x.length - 1] >= x[0];
    const from = rising ? x : Array.from(x).reverse(), values = rising ? y : Array.from(y).reverse();
    const first = from[0], last = from[from.length - 1];
    let i = 0;
    return places.map((at) => {
      if (at < first || at > last) return null;
      while (i < from.length - 2 && from[i + 1] <= at) i++;
      const step = from[i + 1] - from[i];
      const share = step > 0 ? (at - from[i]) / step : 0;
      return share <= 0 ? values[i] : share >= 1 ? values[i + 1] : (1 - share) * values[i] + share * values[i + 1];
    });
  }

  // Curves that go back and forth: places and values of each law of its own.
  function facets(chart, key) {
    return [null, ...chart.curves.map((curve) => [Array.from(array(curve.places[key])), Array.from(array(curve.values))])];
  }

  function axes(chart, axis) {
    const ink = colour("--ink"), grid = { stroke: colour("--grid"), width: 1 };
    const font = "12px system-ui, sans-serif";
    const values = (u, ticks) => ticks.map((tick) => (tick === null ? "" : number(tick, 4)));
    return [
      { stroke: ink, grid, ticks: grid, font, label: axis.label, labelFont: font, labelSize: 22, size: 34, values, space: 60 },
      { stroke: ink, grid, ticks: grid, font, values, size: 66 },
    ];
  }

  function series(chart, axis) {
    const most = Math.max(...chart.curves.map((curve) => array(curve.values).reduce((m, v) => Math.max(m, Math.abs(v)), 0)));
    const shown = (u, value) => (value === null ? "–" : number(Math.abs(value) < 1e-9 * most ? 0 : value));
    const curves = chart.curves.map((curve) => ({
      label: data.laws[curve.law], stroke: lawColour(curve.law), width: curve.law ? 1.5 : 2.2,
      dash: dashes[curve.law % dashes.length], spanGaps: true, value: shown,
      show: !hidden.has(curve.law), points: { show: false },
    }));
    const limits = chart.levels.map((level) => ({
      label: level.name, stroke: colour("--cap"), width: 1.2, dash: [3, 3], value: shown, show: levels,
      points: { show: false },
    }));
    return [{ label: axis.title, value: (u, value) => (value === null ? "–" : `${number(value)} ${axis.unit}`) }, ...curves, ...limits];
  }

  function build(figure) {
    const chart = data.charts.find((one) => one.key === figure.dataset.chart);
    const place = figure.querySelector(".live");
    const old = live.get(chart.key);
    if (old) old.plot.destroy();
    const axis = axisOf(chart);
    figure.classList.add("built"); // shows the place, which then has a width
    const width = Math.max(260, place.clientWidth);
    const plot = chart.path ? pathPlot(chart, axis, place, width) : timePlot(chart, axis, place, width);
    live.set(chart.key, { chart, axis, plot, figure });
    tidy(chart, place);
  }

  // A cap on either side of zero has one entry in the legend.
  function tidy(chart, place) {
    const rows = place.querySelectorAll(".u-legend .u-series"), first = rows.length - chart.levels.length;
    chart.levels.forEach((level, k) => {
      if (chart.levels.findIndex((other) => other.name === level.name) < k && rows[first + k]) rows[first + k].hidden = true;
    });
  }

  function timePlot(chart, axis, place, width) {
    const all = aligned(chart, axis.key);
    const plot = new uPlot({
      width, height: 230, series: series(chart, axis), axes: axes(chart, axis),
      scales: { x: { time: false }, y: { range: (u, low, high) => range(low, high) } },
      cursor: { drag: { x: true, y: false }, y: false },
      legend: { live: true },
      hooks: { setScale: [zoomed], ready: [(u) => mark({ chart, axis, plot: u })] },
    }, all, place);
    plot.over.addEventListener("mousemove", (event) => pointed(plot, event.offsetX));
    plot.over.addEventListener("mouseleave", () => requestAnimationFrame(() => live.forEach(mark)));
    if (zoom && zoom.key === axis.key) plot.setScale("x", zoom);
    return plot;
  }

  function pathPlot(chart, axis, place, width) {
    const line = (u, k) => {
      const path = new Path2D();
      uPlot.orient(u, k, (s, dx, dy, sx, sy, toX, toY, left, top, w, h) => {
        const [x, y] = u.data[k];
        for (let i = 0; i < x.length; i++) {
          const px = toX(x[i], sx, w, left), py = toY(y[i], sy, h, top);
          if (i) path.lineTo(px, py); else path.moveTo(px, py);
        }
      });
      return { stroke: path, fill: null, clip: null, flags: 1 };
    };
    const drawn = series(chart, axis).map((one, k) => k === 0 ? {} : { ...one, paths: line, facets: [{ scale: "x", auto: true }, { scale: "y", auto: true }] });
    const extent = (which) => (u, low, high) => {
      let least = Infinity, most = -Infinity;
      chart.curves.forEach((curve) => {
        for (const v of array(which === "x" ? curve.places[axis.key] : curve.values)) { least = Math.min(least, v); most = Math.max(most, v); }
      });
      return range(least, most);
    };
    return new uPlot({
      mode: 2, width, height: 230, series: drawn, axes: axes(chart, axis),
      scales: { x: { time: false, range: extent("x") }, y: { range: extent("y") } },
      cursor: { show: false }, legend: { live: false }, hooks: { draw: [dots(chart, axis)] },
    }, facets(chart, axis.key), place);
  }

  // Where each law is at the instant that is looked at.
  function dots(chart, axis) {
    return (u) => {
      chart.curves.forEach((curve) => {
        if (hidden.has(curve.law) || curve.places.time === undefined) return;
        const times = array(curve.places.time);
        const x = linear(times, array(curve.places[axis.key]), state.time), y = linear(times, array(curve.values), state.time);
        u.ctx.beginPath();
        u.ctx.fillStyle = lawColour(curve.law);
        u.ctx.arc(u.valToPos(x, "x", true), u.valToPos(y, "y", true), 4 * devicePixelRatio, 0, 7);
        u.ctx.fill();
      });
    };
  }

  // The place on a chart's axis at an instant, for the law that is shown in motion, and back.
  function conversion(one) {
    const curve = one.chart.curves.find((c) => c.law === state.law) || one.chart.curves[0];
    return [curve.places.time === undefined ? null : array(curve.places.time), array(curve.places[one.axis.key])];
  }

  function placeOf(one) {
    const [times, places] = conversion(one);
    if (one.axis.key === "time") return state.time;
    return times === null ? null : linear(times, places, state.time);
  }

  function timeAt(one, place) {
    if (one.axis.key === "time") return place;
    const [times, places] = conversion(one);
    if (times === null) return null;
    if (places[places.length - 1] > places[0]) return linear(places, times, place);
    return linear(Array.from(places).reverse(), Array.from(times).reverse(), place);
  }

  function mark(one) {
    if (one.chart.path) { one.plot.redraw(false, false); return; }
    const place = placeOf(one);
    if (place === null) return;
    one.plot.setCursor({ left: one.plot.valToPos(place, "x"), top: one.plot.over.clientHeight / 2 });
  }

  function pointed(u, left) {
    const one = [...live.values()].find((other) => other.plot === u);
    const time = one && timeAt(one, u.posToVal(left, "x"));
    if (Number.isFinite(time)) report.seek(time, one);
  }

  // What is on the screen follows at once, the rest when there is time.
  let later = 0;
  function follow(source) {
    live.forEach((one) => { if (one !== source && one.figure.classList.contains("seen")) mark(one); });
    clearTimeout(later);
    later = setTimeout(() => live.forEach((one) => { if (one !== source) mark(one); }), 150);
  }

  let zooming = false;
  function zoomed(u, scale) {
    if (zooming || scale !== "x") return;
    const one = [...live.values()].find((other) => other.plot === u);
    if (!one) return;
    zooming = true;
    const { min, max } = u.scales.x;
    const whole = u.data[0];
    zoom = min <= whole[0] && max >= whole[whole.length - 1] ? null : { key: one.axis.key, min, max };
    for (const other of live.values()) {
      if (other !== one && !other.chart.path && other.axis.key === one.axis.key) {
        other.plot.setScale("x", zoom || { min: other.plot.data[0][0], max: other.plot.data[0].at(-1) });
      }
    }
    zooming = false;
  }

  function unzoom() {
    zoom = null;
    zooming = true;
    for (const one of live.values()) {
      if (!one.chart.path) one.plot.setScale("x", { min: one.plot.data[0][0], max: one.plot.data[0].at(-1) });
    }
    zooming = false;
  }

  function rebuild() { for (const one of [...live.values()]) build(one.figure); }

  // A box to tick for each law and for the caps, and a choice of the axis.
  function controls() {
    const bar = document.getElementById("chart-controls");
    if (!bar) return;
    data.laws.forEach((law, k) => {
      if (!data.charts.some((chart) => chart.curves.some((curve) => curve.law === k))) return;
      const box = element("input", { type: "checkbox", checked: true, onchange: (event) => {
        if (event.target.checked) hidden.delete(k); else hidden.add(k);
        rebuild();
      } });
      const swatch = element("span", { class: `swatch law-${k % 8}`, "aria-hidden": "true" });
      bar.append(element("label", {}, box, swatch, law));
    });
    if (data.charts.some((chart) => chart.levels.length)) {
      const box = element("input", { type: "checkbox", checked: true, onchange: (event) => { levels = event.target.checked; rebuild(); } });
      bar.append(element("label", {}, box, element("span", { class: "swatch cap", "aria-hidden": "true" }), "caps and bounds"));
    }
    const choices = new Map();
    data.charts.forEach((chart) => { if (!chart.path && chart.axes.length > 1) chart.axes.forEach((axis) => choices.set(axis.key, axis)); });
    if (choices.size > 1) {
      const select = element("select", { id: "axis", onchange: (event) => { axisKey = event.target.value; zoom = null; rebuild(); } });
      for (const axis of choices.values()) select.append(element("option", { value: axis.key }, axis.title));
      bar.append(element("label", {}, "against ", select));
    }
    bar.append(element("button", { type: "button", onclick: unzoom }, "Whole range"));
    bar.append(element("span", { class: "note" }, "Drag across a chart to zoom. Double-click for the whole range."));
  }

  function start() {
    controls();
    const figures = [...document.querySelectorAll("figure.chart")];
    const watch = new IntersectionObserver((entries) => {
      for (const entry of entries) if (entry.isIntersecting) { watch.unobserve(entry.target); build(entry.target); }
    }, { rootMargin: "300px" });
    figures.forEach((figure) => watch.observe(figure));
    let width = innerWidth;
    addEventListener("resize", () => { if (innerWidth !== width) { width = innerWidth; rebuild(); } });
    const seen = new IntersectionObserver((entries) => {
      for (const entry of entries) entry.target.classList.toggle("seen", entry.isIntersecting);
    });
    figures.forEach((figure) => seen.observe(figure));
    report.on("time", follow);
    report.on("colours", rebuild);
  }

  // All charts at once, as a test wants them.
  function all() { document.querySelectorAll("figure.chart:not(.built)").forEach(build); return live; }
  return { start, all, live, range };
})();
