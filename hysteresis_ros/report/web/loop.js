/* Copyright 2026 hysteresis_ros contributors */
/* SPDX-License-Identifier: Apache-2.0 */

const COLOURS = 9;

/** The loop of drive and response: every measured row in the colour of its residual. */
class Loop extends Chart {
  draw() {
    const {view} = this;
    const {recording} = view;
    this.clear(window.innerWidth < 640 ? 340 : 430);
    this.area = [50, this.height - 40];
    const parts = view.trials.map((trial) => view.inside(trial)).filter(([a, b]) => b > a);
    const {drive, measured, response} = recording;
    const cut = (values) => parts.flatMap(([a, b]) => values.slice(a, b));
    const shown = recording.predictions.filter((_, n) => view.shown[n]);
    const whole = [extent(cut(drive.values)),
      extent([...cut(measured), ...shown.flatMap((one) => cut(one.values))])];
    this.domains = this.range || whole;
    this.x = linear(this.domains[0], [this.left, this.right]);
    this.y = linear(this.domains[1], [this.area[1], this.area[0]]);
    this.axes(this.x, this.y, this.domains, this.area, [drive.label, response.label]);
    const group = this.clipped('loop', ...this.area);
    for (const one of shown) {
      if (recording.continuous) {
        shape(group, 'path', {class: `curve thin ${one.role}`,
          d: parts.map(([a, b]) => this.line(one.values, a, b)).join('')});
      } else {
        // Between settled states nobody knows the way.
        shape(group, 'path', {class: `dots small ${one.role}`, d: parts.map(([a, b]) => dots(
          one.values, a, b, (row) => this.x(drive.values[row]), this.y)).join('')});
      }
    }
    const classes = Array.from({length: COLOURS}, () => '');
    const main = recording.predictions[recording.main].values;
    for (const [a, b] of parts) {
      for (let row = a; row < b; row += 1) {
        if (main[row] === null) continue;
        const share = (measured[row] - main[row]) / recording.limit;
        const place = Math.round(((share + 1) / 2) * (COLOURS - 1));
        classes[Math.min(Math.max(place, 0), COLOURS - 1)]
          += `M${this.x(drive.values[row]).toFixed(1)} ${this.y(measured[row]).toFixed(1)}h0`;
      }
    }
    const few = parts.reduce((sum, [a, b]) => sum + b - a, 0) < 600;
    classes.forEach((d, n) => d && shape(
      group, 'path', {class: `dots colour${n}${few ? ' large' : ''}`, d}));
    this.legend();
    this.cursor = shape(this.svg, 'g', {class: 'cursor'});
    this.mark();
  }

  /** Draw which colour is which residual. */
  legend() {
    const {limit, response, predictions, main} = this.view.recording;
    const size = 15;
    const left = this.right - COLOURS * size - 10 - 7.5 * `${signed(limit)} ${response.unit}`.length;
    const group = shape(this.svg, 'g', {class: 'axes'});
    for (let n = 0; n < COLOURS; n += 1) {
      shape(group, 'rect', {class: `patch colour${n}`, x: left + n * size, y: 4, width: size,
        height: 11});
    }
    shape(group, 'text', {x: left - 5, y: 14, 'text-anchor': 'end'}, number(-limit));
    shape(group, 'text', {x: left + COLOURS * size + 5, y: 14},
      `${signed(limit)} ${response.unit}`);
    if (this.width > 560) {
      shape(group, 'text', {x: 2, y: 14}, `colour: residual, ${predictions[main].name}`);
    }
  }

  /** Return a line through rows. */
  line(values, from, to) {
    const {drive} = this.view.recording;
    let text = '';
    for (let row = from; row < to; row += 1) {
      if (values[row] === null) continue;
      text += `${text ? 'L' : 'M'}${this.x(drive.values[row]).toFixed(1)} ${
        this.y(values[row]).toFixed(1)}`;
    }
    return text;
  }

  mark() {
    if (!this.cursor) return;
    this.cursor.replaceChildren();
    const {row} = this.view;
    if (row < 0) return;
    const [cx, cy] = this.spot(row);
    if (cx < this.left || cx > this.right || cy < this.area[0] || cy > this.area[1]) return;
    shape(this.cursor, 'circle', {cx, cy, r: 6});
  }

  nearest([px, py]) {
    const {drive, measured} = this.view.recording;
    let best = -1;
    let least = Infinity;
    for (const trial of this.view.trials) {
      const [from, to] = this.view.inside(trial);
      for (let row = from; row < to; row += 1) {
        const distance = (this.x(drive.values[row]) - px) ** 2 + (this.y(measured[row]) - py) ** 2;
        if (distance < least) {
          least = distance;
          best = row;
        }
      }
    }
    return best;
  }

  spot(row) {
    const {drive, measured} = this.view.recording;
    return [this.x(drive.values[row]), this.y(measured[row])];
  }

  across(start, now) {
    return [start[1], now[1]].sort((a, b) => a - b);
  }

  zoomTo(start, now) {
    if (Math.abs(now[1] - start[1]) < 6) return;
    const sorted = (a, b) => [a, b].sort((one, other) => one - other);
    this.range = [sorted(this.x.inverse(start[0]), this.x.inverse(now[0])),
      sorted(this.y.inverse(start[1]), this.y.inverse(now[1]))];
    this.draw();
  }

  reset() {
    this.range = null;
    this.draw();
  }
}
