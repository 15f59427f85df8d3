/* Copyright 2026 hysteresis_ros contributors */
/* SPDX-License-Identifier: Apache-2.0 */

/** The residual against one signal: rows as dots, and means with their intervals. */
class Means extends Chart {
  constructor(place, view, signal, domain) {
    super(place, view, signal.text);
    this.signal = signal;
    this.domain = domain;
    this.row = -1;
  }

  draw() {
    const {signal} = this;
    this.clear(200);
    this.area = [28, this.height - 40];
    this.x = linear(signal.range, [this.left, this.right]);
    this.y = linear(this.domain, [this.area[1], this.area[0]]);
    const {unit} = this.view.recording.response;
    this.axes(this.x, this.y, [signal.range, this.domain], this.area,
      [signal.label, `residual [${unit || '1'}]`], signal.ticks);
    const group = this.clipped(`signal-${signal.name}`, ...this.area);
    shape(group, 'line', {class: 'zero', x1: this.left, x2: this.right, y1: this.y(0),
      y2: this.y(0)});
    shape(group, 'path', {class: 'dots faint', d: dots(signal.dots[1], 0, signal.dots[1].length,
      (n) => this.x(signal.dots[0][n]), this.y)});
    const places = signal.centre.map((value, n) => [this.x(value), this.y(signal.mean[n])]);
    shape(group, 'path', {class: 'curve model solid', d: `M${places.map(
      (place) => place.map((value) => value.toFixed(1)).join(' ')).join('L')}`});
    places.forEach(([x, y], n) => {
      if (signal.half[n] !== null) {
        shape(group, 'line', {class: 'interval', x1: x, x2: x,
          y1: this.y(signal.mean[n] - signal.half[n]), y2: this.y(signal.mean[n] + signal.half[n])});
      }
      shape(group, 'circle', {class: 'mean', cx: x, cy: y, r: 3});
    });
    this.cursor = shape(this.svg, 'g', {class: 'cursor'});
  }

  mark() {}

  nearest([px]) {
    const distances = this.signal.centre.map((value) => Math.abs(this.x(value) - px));
    return distances.indexOf(Math.min(...distances));
  }

  spot(n) {
    return [this.x(this.signal.centre[n]), this.y(this.signal.mean[n])];
  }

  show(n) {
    const {signal} = this;
    const {unit} = this.view.recording.response;
    const half = signal.half[n] === null ? '' : `\u00b1 ${number(signal.half[n])}`;
    const [cx, cy] = this.spot(n);
    this.cursor.replaceChildren();
    shape(this.cursor, 'circle', {cx, cy, r: 5});
    return [[signal.label.replace(/ \[.*/, ''), `${number(signal.centre[n])} ${signal.unit}`, ''],
      ['mean residual', `${signed(signal.mean[n])} ${unit}`, half],
      ['rows', String(signal.rows[n]), '']];
  }

  across() {
    return this.area;
  }

  zoomTo() {}

  reset() {}
}

/** Put a chart for each signal in the place of a picture, side by side where there is room. */
function signalCharts(figure, view) {
  const image = figure.querySelector('img');
  const grid = element('div', {class: 'signals', role: 'group', 'aria-label': image.alt});
  image.replaceWith(grid);
  const {signals, signalRange} = view.recording;
  signals.forEach((signal) => new Means(grid, view, signal, signalRange));
}
