/* Copyright 2026 hysteresis_ros contributors */
/* SPDX-License-Identifier: Apache-2.0 */

/** Response and residual over the same axis; the trials are not joined. */
class Lines extends Chart {
  draw() {
    const {view} = this;
    const {recording} = view;
    const tall = window.innerWidth < 640 ? 0.8 : 1;
    this.clear(Math.round(470 * tall));
    this.upper = [28, Math.round(280 * tall)];
    this.lower = [this.upper[1] + 32, this.height - 40];
    this.x = linear(view.domain, [this.left, this.right]);
    const parts = view.trials.map((trial) => view.inside(trial)).filter(([a, b]) => b > a);
    const curves = [{name: 'measured', role: 'measured', values: recording.measured}];
    recording.predictions.forEach((one, n) => view.shown[n] && curves.push(one));
    const below = curves.slice(1).map((one) => ({...one, values: recording.measured.map(
      (value, row) => (one.values[row] === null ? null : value - one.values[row]))}));
    const cut = (all) => all.flatMap(({values}) => parts.flatMap(([a, b]) => values.slice(a, b)));
    const domains = [extent(cut(curves)), extent([...cut(below), recording.noise, -recording.noise])];
    const {label, unit} = recording.response;
    this.area(this.upper, domains[0], curves, parts, ['', label], 'response');
    this.area(this.lower, domains[1], below, parts,
      [recording.x.label, `residual: measured - predicted [${unit || '1'}]`], 'residual');
    this.cursor = shape(this.svg, 'g', {class: 'cursor'});
    this.y = linear(domains[0], [this.upper[1], this.upper[0]]);
    this.yBelow = linear(domains[1], [this.lower[1], this.lower[0]]);
    this.mark();
  }

  /** Draw one of the two areas. */
  area([top, bottom], domain, curves, parts, labels, name) {
    const y = linear(domain, [bottom, top]);
    const group = this.clipped(name, top, bottom);
    this.shade(group, top, bottom);
    this.axes(this.x, y, [this.view.domain, domain], [top, bottom], labels);
    const curvesGroup = this.clipped(`${name}-curves`, top, bottom);
    if (name === 'residual') {
      const {noise} = this.view.recording;
      shape(group, 'rect', {class: 'noise', x: this.left, width: this.right - this.left,
        y: y(noise), height: Math.max(y(-noise) - y(noise), 0.5)});
      shape(curvesGroup, 'line', {class: 'zero', x1: this.left, x2: this.right, y1: y(0), y2: y(0)});
    }
    for (const {from} of this.view.trials.slice(1)) {
      const {values} = this.view.recording.x;
      const at = this.x((values[from] + values[from - 1]) / 2);
      shape(curvesGroup, 'line', {class: 'trial', x1: at, x2: at, y1: top, y2: bottom});
    }
    const rows = parts.reduce((sum, [a, b]) => sum + b - a, 0);
    for (const {role, values} of curves) {
      shape(curvesGroup, 'path', {class: `curve ${role}`,
        d: parts.map(([a, b]) => this.path(values, a, b, y)).join('')});
      if (rows <= this.width / 5) {
        shape(curvesGroup, 'path', {class: `dots ${role}`, d: parts.map(([a, b]) => dots(
          values, a, b, (row) => this.x(this.view.recording.x.values[row]), y)).join('')});
      }
    }
  }

  /** Shade the rows of the region that is chosen. */
  shade(group, top, bottom) {
    const {recording, region} = this.view;
    if (region < 0) return;
    const {values} = recording.x;
    for (const trial of this.view.trials) {
      for (const [first, last] of recording.regions[region].rows) {
        const from = Math.max(first, trial.from);
        const to = Math.min(last, trial.to);
        if (to <= from) continue;
        const left = from > trial.from ? (values[from] + values[from - 1]) / 2 : values[from];
        const right = to < trial.to ? (values[to] + values[to - 1]) / 2 : values[to - 1];
        const width = Math.max(this.x(right) - this.x(left), 1.5);
        shape(group, 'rect', {class: 'region', x: this.x(left), y: top, width,
          height: bottom - top});
      }
    }
  }

  /** Return a curve of rows; of those on one column of pixels the lowest and the highest. */
  path(values, from, to, y) {
    const {x} = this.view.recording;
    let text = '';
    let column = null;
    let low = 0;
    let high = 0;
    let pen = 'M';
    const put = () => {
      if (column === null) return;
      text += `${pen}${column} ${low.toFixed(1)}`;
      if (high !== low) text += `L${column} ${high.toFixed(1)}`;
      pen = 'L';
    };
    for (let row = from; row < to; row += 1) {
      if (values[row] === null) {
        put();
        column = null;
        pen = 'M';
        continue;
      }
      const at = Math.round(2 * this.x(x.values[row])) / 2;
      const height = y(values[row]);
      if (at === column) {
        low = Math.min(low, height);
        high = Math.max(high, height);
      } else {
        put();
        column = at;
        low = height;
        high = height;
      }
    }
    put();
    return text;
  }

  /** Show the row that is pointed at. */
  mark() {
    if (!this.cursor) return;
    this.cursor.replaceChildren();
    const {row, recording} = this.view;
    const [low, high] = this.view.domain;
    if (row < 0 || recording.x.values[row] < low || recording.x.values[row] > high) return;
    const x = this.x(recording.x.values[row]);
    shape(this.cursor, 'line', {x1: x, x2: x, y1: this.upper[0], y2: this.lower[1]});
    shape(this.cursor, 'circle', {cx: x, cy: this.y(recording.measured[row]), r: 4});
    recording.predictions.forEach((one, n) => {
      if (!this.view.shown[n] || one.values[row] === null) return;
      shape(this.cursor, 'circle', {cx: x, cy: this.y(one.values[row]), r: 4, class: one.role});
      shape(this.cursor, 'circle', {cx: x, cy: this.yBelow(
        recording.measured[row] - one.values[row]), r: 4, class: one.role});
    });
  }

  nearest([px]) {
    const {values} = this.view.recording.x;
    const value = this.x.inverse(px);
    const [from, to] = this.view.ends;
    const next = Math.min(Math.max(search(values, value), from), to - 1);
    return next > from && value - values[next - 1] < values[next] - value ? next - 1 : next;
  }

  spot(row) {
    const {recording} = this.view;
    return [this.x(recording.x.values[row]), this.y(recording.measured[row])];
  }

  across() {
    return [this.upper[0], this.lower[1]];
  }

  zoomTo(start, now) {
    const ends = [this.x.inverse(start[0]), this.x.inverse(now[0])].sort((a, b) => a - b);
    this.view.zoom(ends);
  }

  reset() {
    this.view.zoom(null);
  }
}

/** Return a path of dots, lines of no length with round ends. */
function dots(values, from, to, x, y) {
  let text = '';
  for (let row = from; row < to; row += 1) {
    if (values[row] !== null) text += `M${x(row).toFixed(1)} ${y(values[row]).toFixed(1)}h0`;
  }
  return text;
}
