/* Copyright 2026 hysteresis_ros contributors */
/* SPDX-License-Identifier: Apache-2.0 */

/** Return a number with some digits and no exponent where that can be avoided. */
function number(value, count = 3) {
  if (value === null || !Number.isFinite(value)) return '-';
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e7)) return value.toExponential(2);
  const short = Number(value.toPrecision(count));
  const digits = short === 0 ? 0 : Math.max(0, count - 1 - Math.floor(Math.log10(Math.abs(short))));
  return short.toFixed(digits);
}

/** Return a number with its sign. */
function signed(value) {
  return (value > 0 ? '+' : '') + number(value);
}

/** Return round numbers from low to high, about `count` of them, as texts by value. */
function ticks(low, high, count) {
  const rough = (high - low) / Math.max(count, 1);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= 0.7 * rough);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const found = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step && found.length < 50; n += 1) {
    const value = n * step;
    found.push({value, text: (Math.abs(value) < step / 2 ? 0 : value).toFixed(Math.min(digits, 12))});
  }
  return found;
}

/** Return [low, high] around values with some air; null among them is left out. */
function extent(values, air = 0.06) {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (value === null) continue;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  if (low > high) return [0, 1];
  const margin = high > low ? air * (high - low) : Math.max(1e-9, 0.05 * Math.abs(low)) || 1;
  return [low - margin, high + margin];
}

/** Return the map from a range of values to one of pixels, with its inverse. */
function linear([low, high], [from, to]) {
  const map = (value) => from + ((value - low) / (high - low)) * (to - from);
  map.inverse = (pixel) => low + ((pixel - from) / (to - from)) * (high - low);
  return map;
}
