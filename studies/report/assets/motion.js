"use strict";
// The mechanism in motion on a canvas: lines sorted by depth. What is drawn is made once; a frame
// only moves points in arrays that are there.

report.motion = (() => {
  const { data, array, bracket, linear, hermite, colour, number, element, state } = report;
  const scene = data.scene;
  const SECONDS = 12; // that the whole motion takes, unless real time is asked for
  const RAMP = ["#3f6fb5", "#7b5ea7", "#c2457f", "#e8603c", "#f0a30a"]; // little to much tension
  const WIDTHS = { "vertical bars": 2.2, "cross-bars": 4, links: 1.2, net: 0.8, arm: 6, motor: 1.8, "big arm": 5, "small arm": 3 };
  let canvas, context, controls, readout, model, view, playing = false, last = 0, queued = false;

  // Points, lines and colours, made once.
  function prepare() {
    const strands = scene.strands.map((strand) => ({ kind: strand.kind, pairs: array(strand.pairs) }));
    const ropes = scene.tension ? scene.tension.paths.map(array) : [];
    const segments = [];
    strands.forEach((strand, k) => {
      for (let i = 0; i < strand.pairs.length; i += 2) segments.push([strand.pairs[i], strand.pairs[i + 1], k, -1]);
    });
    ropes.forEach((path) => {
      for (let i = 0; i + 1 < path.length; i++) segments.push([path[i], path[i + 1], strands.length, i]);
    });
    const count = segments.length, points = scene.points;
    return {
      strands, kinds: [...strands.map((strand) => strand.kind), ...(ropes.length ? ["ropes"] : [])],
      a: Uint16Array.from(segments, (s) => s[0]), b: Uint16Array.from(segments, (s) => s[1]),
      kind: Uint8Array.from(segments, (s) => s[2]), rope: Int16Array.from(segments, (s) => s[3]),
      order: Uint16Array.from(segments, (s, i) => i), depth: new Float64Array(count),
      points: new Float64Array(3 * points), flat: new Float64Array(3 * points),
      shapes: array(scene.shapes), straight: scene.straight === null ? null : array(scene.straight),
      places: array(scene.parameter), weights: scene.weights === null ? null : array(scene.weights),
      slopes: scene.slopes === null ? null : array(scene.slopes),
      mix: new Float64Array(scene.weights === null ? 0 : array(scene.weights).length / array(scene.parameter).length),
      tensions: new Float64Array(ropes.length ? ropes[0].length - 1 : 0),
      exponents: scene.tension ? array(scene.tension.exponents) : null,
      used: usedPoints(segments), factor: 1, shown: new Set(), colours: [], span: [1, 1, 0, 0],
    };
  }

  const usedPoints = (segments) => Uint16Array.from(new Set(segments.flatMap((s) => [s[0], s[1]])));
  const law = () => scene.laws.find((one) => one.law === state.law) || scene.laws[0];
  const duration = () => { const times = array(law().times); return times[times.length - 1]; };

  function parameterAt(time, one = law()) {
    const out = [0];
    hermite(array(one.times), array(one.values), array(one.rates), time, 1, out);
    return out[0];
  }

  // All points at a value of the parameter, into the array of the model.
  function place(value) {
    const { points, shapes, straight, places, weights, slopes, mix, factor } = model;
    const size = points.length;
    if (weights !== null) {
      hermite(places, weights, slopes, value, mix.length, mix);
      points.fill(0);
      for (let k = 0; k < mix.length; k++) for (let i = 0, at = k * size; i < size; i++, at++) points[i] += mix[k] * shapes[at];
      return points;
    }
    const [row, share] = bracket(places, value);
    for (let i = 0, at = row * size; i < size; i++, at++) {
      let x = (1 - share) * shapes[at] + share * shapes[at + size];
      if (factor !== 1) {
        const s = (1 - share) * straight[at] + share * straight[at + size];
        x = s + factor * (x - s);
      }
      points[i] = x;
    }
    return points;
  }

  function project() {
    const { points, flat } = model;
    const ct = Math.cos(view.turn), st = Math.sin(view.turn), cr = Math.cos(view.rise), sr = Math.sin(view.rise);
    for (let i = 0; i < points.length; i += 3) {
      const x = points[i], y = points[i + 1], z = points[i + 2], back = x * st + y * ct;
      flat[i] = x * ct - y * st;
      flat[i + 1] = back * sr + z * cr;
      flat[i + 2] = z * sr - back * cr;
    }
    return flat;
  }

  // The room that the whole motion needs as it is looked at.
  function fit() {
    let left = Infinity, right = -Infinity, low = Infinity, high = -Infinity;
    const { places, used } = model, centre = 3 * scene.centre;
    for (let k = 0; k <= 12; k++) {
      place(places[0] + (places[places.length - 1] - places[0]) * k / 12);
      const flat = project();
      const ox = centre >= 0 ? flat[centre] : 0, oy = centre >= 0 ? flat[centre + 1] : 0;
      for (const i of used) {
        left = Math.min(left, flat[3 * i] - ox); right = Math.max(right, flat[3 * i] - ox);
        low = Math.min(low, flat[3 * i + 1] - oy); high = Math.max(high, flat[3 * i + 1] - oy);
      }
    }
    if (centre >= 0) { right = Math.max(right, -left); left = -right; high = Math.max(high, -low); low = -high; }
    model.span = [Math.max(right - left, 1e-9), Math.max(high - low, 1e-9), (left + right) / 2, (low + high) / 2];
  }

  function tensionsAt(time, value) {
    const { tensions, exponents } = model, one = law();
    const force = linear(array(one.times), array(one.force), time);
    for (let k = 0; k < tensions.length; k++) tensions[k] = force * Math.exp(exponents[2 * k] + exponents[2 * k + 1] * value);
    return tensions;
  }

  function draw() {
    queued = false;
    const value = parameterAt(state.time);
    place(value);
    const flat = project(), { a, b, kind, rope, order, depth, shown } = model;
    for (let i = 0; i < a.length; i++) depth[i] = flat[3 * a[i] + 2] + flat[3 * b[i] + 2];
    if (!scene.flat) order.sort((i, j) => depth[i] - depth[j]);

    const ratio = devicePixelRatio || 1, width = canvas.width / ratio, height = canvas.height / ratio;
    const [spanX, spanY, midX, midY] = model.span;
    const scale = view.zoom * Math.min((width - 40) / spanX, (height - 40) / spanY);
    const c = 3 * scene.centre, ox = c >= 0 ? flat[c] : midX, oy = c >= 0 ? flat[c + 1] : midY;
    context.setTransform(ratio, 0, 0, ratio, canvas.width / 2, canvas.height / 2);
    context.clearRect(-width / 2, -height / 2, width, height);
    context.lineCap = "round";

    const reach = scene.size || 1;
    const tensions = scene.tension ? tensionsAt(state.time, value) : null;
    for (let n = 0; n < order.length; n++) {
      const i = order[n], k = kind[i];
      if (!shown.has(k)) continue;
      const name = model.kinds[k], p = 3 * a[i], q = 3 * b[i];
      const slack = scene.slack[name] !== undefined && value < scene.slack[name];
      context.globalAlpha = slack ? 0.4 : scene.flat ? 1 : Math.min(1, Math.max(0.35, 0.72 + 0.55 * depth[i] / 2 / reach));
      context.lineWidth = rope[i] >= 0 ? 1.8 : WIDTHS[name] || 2.5;
      context.strokeStyle = rope[i] >= 0 ? shade(tensions[rope[i]]) : model.colours[k];
      context.beginPath();
      context.moveTo((flat[p] - ox) * scale, (oy - flat[p + 1]) * scale);
      context.lineTo((flat[q] - ox) * scale, (oy - flat[q + 1]) * scale);
      context.stroke();
    }
    context.globalAlpha = 1;
    if (scene.flat) joints(flat, ox, oy, scale);
    ruler(scale, width, height);
    tell(value);
  }

  // The root, each joint and the tip of a chain.
  function joints(flat, ox, oy, scale) {
    const ink = colour("--ink");
    model.strands.forEach((strand, k) => {
      const first = 3 * strand.pairs[0], end = 3 * strand.pairs[strand.pairs.length - 1];
      context.fillStyle = k === 0 ? colour("--law-0") : ink;
      const x = (flat[first] - ox) * scale, y = (oy - flat[first + 1]) * scale;
      if (k === 0) context.fillRect(x - 6, y - 6, 12, 12);
      else { context.beginPath(); context.arc(x, y, 4.5, 0, 7); context.fill(); }
      if (k === model.strands.length - 1) {
        context.fillStyle = colour("--law-1");
        context.beginPath();
        context.arc((flat[end] - ox) * scale, (oy - flat[end + 1]) * scale, 6, 0, 7);
        context.fill();
      }
    });
  }

  function ruler(scale, width, height) {
    const rough = 90 / scale, size = 10 ** Math.floor(Math.log10(rough));
    const length = [5, 2, 1].map((m) => m * size).find((m) => m <= rough) || size;
    const x = -width / 2 + 14, y = height / 2 - 12;
    context.strokeStyle = context.fillStyle = colour("--ink");
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(x, y - 4); context.lineTo(x, y); context.lineTo(x + length * scale, y); context.lineTo(x + length * scale, y - 4);
    context.stroke();
    context.font = "12px system-ui, sans-serif";
    context.fillText(`${number(length, 3)} m`, x + 6, y - 6);
  }

  let shades = null, most = 1;
  function shade(tension) {
    const k = Math.round((shades.length - 1) * Math.min(Math.max(tension / most, 0), 1));
    return shades[k];
  }

  function makeShades() {
    most = Math.max(...scene.laws.map((one) => array(one.force).reduce((x, y) => Math.max(x, y), 0)), 1e-12);
    const parts = RAMP.map((hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)));
    shades = Array.from({ length: 64 }, (_, i) => {
      const x = i / 63 * (parts.length - 1), k = Math.min(Math.floor(x), parts.length - 2), s = x - k;
      return `rgb(${parts[k].map((v, j) => Math.round((1 - s) * v + s * parts[k + 1][j])).join(",")})`;
    });
  }

  // The instant in numbers, for everybody and for those who do not see the picture.
  function tell(value) {
    const one = law(), parts = [`t = ${number(state.time, 4)} s`];
    if (!scene.flat) {
      parts.push(`angle ${number(value * 180 / Math.PI, 4)}°`);
      const c = 3 * scene.centre, p = model.points;
      parts.push(`diameter ${number(2 * Math.hypot(p[0] - p[c], p[1] - p[c + 1]), 4)} m`);
    }
    if (one.force !== null) {
      const times = array(one.times);
      parts.push(`force ${number(linear(times, array(one.force), state.time), 4)} N`);
      parts.push(`rope ${number(linear(times, array(one.rope), state.time), 5)} m`);
    }
    readout.textContent = parts.join("  ·  ");
    controls.slider.value = String(state.time / duration());
    controls.slider.setAttribute("aria-valuetext", readout.textContent);
  }

  function request() {
    if (queued) return;
    queued = true;
    requestAnimationFrame(draw);
  }

  function resize() {
    const ratio = devicePixelRatio || 1, width = canvas.clientWidth;
    const height = Math.round(Math.min(Math.max(260, 0.56 * width), 520));
    canvas.style.height = `${height}px`;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    request();
  }

  function recolour() {
    model.colours = model.kinds.map((kind) => colour(`--part-${kind.replaceAll(" ", "-")}`) || colour("--part-other"));
    request();
  }

  // Playing: nothing moves before somebody asks. Who wants little motion gets ten still steps.
  function play() {
    playing = !playing;
    controls.play.textContent = playing ? "Pause" : "Play";
    controls.play.setAttribute("aria-pressed", String(playing));
    if (!playing) return;
    if (state.time >= duration() * (1 - 1e-9)) state.time = 0;
    last = performance.now();
    requestAnimationFrame(step);
  }

  function step(now) {
    if (!playing) return;
    const pace = controls.speed.value === "whole" ? duration() / SECONDS : Number(controls.speed.value);
    const passed = (now - last) / 1000;
    if (!report.calm.matches || passed * pace >= duration() / 10) {
      last = now;
      const time = Math.min(state.time + passed * pace, duration());
      report.seek(time, "motion");
      if (time >= duration()) { play(); return; }
    }
    requestAnimationFrame(step);
  }

  function orbit(turn, rise) {
    view.turn += turn;
    view.rise = Math.min(Math.max(view.rise + rise, -1.57), 1.57);
    fit();
    request();
  }

  function listen() {
    let from = null;
    canvas.addEventListener("pointerdown", (event) => { from = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
    canvas.addEventListener("pointermove", (event) => {
      if (from === null || scene.flat) return;
      orbit((event.clientX - from[0]) * -0.008, (event.clientY - from[1]) * 0.008);
      from = [event.clientX, event.clientY];
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { from = null; });
    canvas.addEventListener("keydown", (event) => {
      const turns = { ArrowLeft: [-0.08, 0], ArrowRight: [0.08, 0], ArrowUp: [0, 0.08], ArrowDown: [0, -0.08] }[event.key];
      if (event.key === " ") play();
      else if (event.key === "+" || event.key === "-") { view.zoom *= event.key === "+" ? 1.15 : 1 / 1.15; request(); }
      else if (turns && !scene.flat) orbit(...turns);
      else return;
      event.preventDefault();
    });
  }

  function option(value, text, chosen) { return element("option", chosen ? { value, selected: "" } : { value }, text); }

  function makeControls(place_) {
    const slider = element("input", { type: "range", min: "0", max: "1", step: "0.0005", value: "0", "aria-label": "instant of the motion",
      oninput: (event) => report.seek(Number(event.target.value) * duration(), "slider") });
    const play_ = element("button", { type: "button", "aria-pressed": "false", onclick: play }, "Play");
    const speed = element("select", {}, option("whole", `whole motion in ${SECONDS} s`, true), option("0.25", "a quarter of real time"), option("1", "real time"), option("4", "4 times real time"), option("16", "16 times real time"));
    const row = element("div", { class: "controls" }, play_, slider, element("label", {}, "speed ", speed));
    const more = element("div", { class: "controls" });
    if (scene.laws.length > 1) {
      const select = element("select", { onchange: (event) => { state.law = Number(event.target.value); report.seek(Math.min(state.time, duration()), "law"); } });
      scene.laws.forEach((one) => select.append(option(String(one.law), data.laws[one.law], one.law === 0)));
      more.append(element("label", {}, "law ", select));
    }
    if (scene.straight !== null) {
      const select = element("select", { onchange: (event) => { model.factor = Number(event.target.value); fit(); request(); } });
      for (const factor of [1, 3, 10, 30, 100]) select.append(option(String(factor), factor === 1 ? "to scale" : `${factor} times`, factor === 1));
      more.append(element("label", {}, "bending ", select));
    }
    if (!scene.flat) {
      for (const [name, turn, rise] of [["Oblique", 30, 28], ["From above", 0, 90], ["From the side", 0, 0]]) {
        more.append(element("button", { type: "button", onclick: () => { view.turn = turn * Math.PI / 180; view.rise = rise * Math.PI / 180; view.zoom = 1; fit(); request(); } }, name));
      }
      model.kinds.forEach((kind, k) => {
        const box = element("input", { type: "checkbox", checked: true, onchange: (event) => { if (event.target.checked) model.shown.add(k); else model.shown.delete(k); request(); } });
        more.append(element("label", {}, box, element("span", { class: `swatch part-${kind.replaceAll(" ", "-")}`, "aria-hidden": "true" }), kind));
      });
    }
    place_.append(row, more);
    return { slider, play: play_, speed };
  }

  // Tension of each segment at the instant, and a scale for its colours.
  let tensionPlot = null;
  function makeTension() {
    const figure = document.getElementById("tension");
    if (!figure || !scene.tension) return;
    const place_ = figure.querySelector(".live");
    if (tensionPlot) tensionPlot.destroy();
    const ink = colour("--ink"), grid = { stroke: colour("--grid"), width: 1 }, font = "12px system-ui, sans-serif";
    const segments = Array.from(model.tensions, (_, k) => k + 1);
    tensionPlot = new uPlot({
      width: Math.max(260, place_.clientWidth), height: 230,
      scales: { x: { time: false }, y: { range: [0, 1.05 * most] } },
      series: [{ label: "segment" }, { label: "tension", stroke: colour("--law-0"), width: 2, points: { show: false }, value: (u, v) => (v === null ? "–" : `${number(v)} N`) }],
      axes: [{ stroke: ink, grid, ticks: grid, font, labelFont: font, label: "segment, from the motor", labelSize: 22, size: 34 }, { stroke: ink, grid, ticks: grid, font, size: 66, values: (u, ticks) => ticks.map((t) => number(t, 4)) }],
    }, [segments, Array.from(tensionsAt(state.time, parameterAt(state.time)))], place_);
  }
  function moveTension() {
    if (tensionPlot) tensionPlot.setData([tensionPlot.data[0], Array.from(tensionsAt(state.time, parameterAt(state.time)))], false);
    if (tensionPlot) tensionPlot.redraw(true, false);
  }

  function start() {
    const stage = document.getElementById("stage");
    if (!stage || !scene) return;
    document.getElementById("motion").classList.add("moving");
    model = prepare();
    model.kinds.forEach((_, k) => model.shown.add(k));
    view = scene.flat ? { turn: 0, rise: Math.PI / 2, zoom: 1 } : { turn: Math.PI / 6, rise: 28 * Math.PI / 180, zoom: 1 };
    canvas = element("canvas", { tabindex: "0", role: "img", "aria-label": `${scene.title}; ${scene.flat ? "" : "arrow keys turn it, plus and minus change its size, "}the space bar plays its motion` });
    context = canvas.getContext("2d");
    readout = element("output", { class: "readout" });
    stage.append(canvas, readout);
    controls = makeControls(stage);
    if (scene.tension) {
      makeShades();
      stage.append(element("div", { class: "scale" }, element("span", {}, "0 N"), element("span", { class: "ramp", "aria-hidden": "true" }), element("span", {}, `${number(most, 4)} N in a rope`)));
    }
    fit();
    listen();
    recolour();
    resize();
    makeTension();
    draw();
    addEventListener("resize", () => { resize(); makeTension(); });
    report.on("time", () => { request(); moveTension(); });
    report.on("colours", () => { recolour(); makeTension(); });
  }

  // For tests: positions at an instant, and the drawing of one frame.
  function positions(time) { return Array.from(place(parameterAt(time))); }
  return { start, positions, draw, play, duration };
})();
