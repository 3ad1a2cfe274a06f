"use strict";
// What all parts of the page share: the numbers of the result, the instant that is looked at, and
// the colours of the page.

const report = (() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const decoded = new Map();
  const kinds = { f: Float32Array, d: Float64Array, i: Uint16Array };

  // An array of the page: a letter for its kind, a colon, its bytes in base 64.
  function array(reference) {
    if (!decoded.has(reference)) {
      const text = data.arrays[reference];
      const bytes = Uint8Array.from(atob(text.slice(2)), (c) => c.charCodeAt(0));
      decoded.set(reference, new kinds[text[0]](bytes.buffer));
    }
    return decoded.get(reference);
  }

  // The row below a place in a table, and the share of the way to the next row.
  function bracket(places, at) {
    let low = 0, high = places.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (places[middle] <= at) low = middle; else high = middle;
    }
    const share = (at - places[low]) / (places[high] - places[low]);
    return [low, Math.min(Math.max(share, 0), 1)];
  }

  function linear(places, values, at) {
    const [i, s] = bracket(places, at);
    return (1 - s) * values[i] + s * values[i + 1];
  }

  // The cubic that is meant between two rows; `width` values stand in a row.
  function hermite(places, values, slopes, at, width, out) {
    const [i, s] = bracket(places, at);
    const h = places[i + 1] - places[i];
    const a = (1 + 2 * s) * (1 - s) ** 2, b = s * s * (3 - 2 * s), c = h * s * (1 - s);
    for (let k = 0; k < width; k++) {
      const p = i * width + k, q = p + width;
      out[k] = a * values[p] + b * values[q] + c * ((1 - s) * slopes[p] - s * slopes[q]);
    }
    return out;
  }

  // A colour of the page, as the style of the moment says.
  function colour(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  }

  function number(value, digits = 6) {
    if (value === null || value === undefined || Number.isNaN(value)) return "–";
    const size = Math.abs(value);
    if (size !== 0 && (size < 1e-3 || size >= 1e6)) {
      return value.toExponential(digits - 1).replace(/\.?0+e/, "e");
    }
    return String(Number(value.toPrecision(digits)));
  }

  function element(tag, attributes = {}, ...content) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
      else if (name === "checked" || name === "disabled") made[name] = value;
      else made.setAttribute(name, value);
    }
    made.append(...content);
    return made;
  }

  // Who wants to know of another instant, or of other colours.
  const listeners = { time: [], colours: [] };
  const state = { time: 0, law: 0 };
  function on(what, listener) { listeners[what].push(listener); }
  function tell(what, source) { for (const listener of listeners[what]) listener(source); }
  function seek(time, source) {
    if (!Number.isFinite(time)) return;
    state.time = Math.max(0, time);
    tell("time", source);
  }

  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => tell("colours"));
  const calm = matchMedia("(prefers-reduced-motion: reduce)");
  return { data, array, bracket, linear, hermite, colour, number, element, on, tell, seek, state, calm };
})();
