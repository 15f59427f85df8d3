/* Copyright 2026 hysteresis_ros contributors */
/* SPDX-License-Identifier: Apache-2.0 */

/** A chart: its size, its axes, its tip, and what a pointer does to it. */
class Chart {
  constructor(place, view, text) {
    this.view = view;
    this.box = element('div', {class: 'plot'});
    this.svg = shape(this.box, 'svg', {role: 'img', 'aria-label': text});
    this.tip = element('div', {class: 'tip', 'aria-hidden': 'true'});
    this.tip.hidden = true;
    this.box.append(this.tip);
    place.append(this.box);
    view.charts.push(this);
    this.listen();
    new ResizeObserver(() => {
      if (Math.abs(this.box.clientWidth - this.width) > 1) this.draw();
    }).observe(this.box);
  }

  /** Empty the chart and give it the size of its place. */
  clear(height) {
    this.width = Math.max(this.box.clientWidth, 240);
    this.height = height;
    this.svg.replaceChildren();
    this.svg.setAttribute('viewBox', `0 0 ${this.width} ${height}`);
    this.left = this.width < 520 ? 44 : 58;
    this.right = this.width - 10;
  }

  /** Draw axes around an area; without a label of x its numbers are left out. */
  axes(x, y, domains, [top, bottom], labels, named = null) {
    const group = shape(this.svg, 'g', {class: 'axes'});
    for (const {value, text} of ticks(...domains[1], Math.max(3, (bottom - top) / 45))) {
      shape(group, 'line', {x1: this.left, x2: this.right, y1: y(value), y2: y(value),
        class: 'grid'});
      shape(group, 'text', {x: this.left - 6, y: y(value) + 4, 'text-anchor': 'end'}, text);
    }
    for (const {value, text} of named || ticks(
      ...domains[0], Math.max(3, this.width / 110))) {
      shape(group, 'line', {x1: x(value), x2: x(value), y1: top, y2: bottom, class: 'grid'});
      if (labels[0]) {
        shape(group, 'text', {x: x(value), y: bottom + 16, 'text-anchor': 'middle'}, text);
      }
    }
    shape(group, 'line', {x1: this.left, x2: this.right, y1: bottom, y2: bottom, class: 'axis'});
    shape(group, 'line', {x1: this.left, x2: this.left, y1: top, y2: bottom, class: 'axis'});
    if (labels[0]) {
      shape(group, 'text', {x: this.right, y: bottom + 33, 'text-anchor': 'end'}, labels[0]);
    }
    shape(group, 'text', {x: 2, y: top - 12}, labels[1]);
  }

  /** Return a group that shows nothing outside an area. */
  clipped(name, top, bottom) {
    const id = `clip-${name}`;
    const clip = shape(this.svg, 'clipPath', {id});
    shape(clip, 'rect', {x: this.left, y: top, width: this.right - this.left,
      height: bottom - top});
    return shape(this.svg, 'g', {'clip-path': `url(#${id})`});
  }

  /** Let the pointer read values and, when drawn across, zoom. */
  listen() {
    let start = null;
    const place = (event) => {
      const box = this.svg.getBoundingClientRect();
      return [(event.clientX - box.left) * (this.width / box.width),
        (event.clientY - box.top) * (this.height / box.height)];
    };
    this.svg.addEventListener('pointerdown', (event) => {
      if (event.button === 0) start = place(event);
    });
    this.svg.addEventListener('pointermove', (event) => {
      const now = place(event);
      if (start && event.buttons && Math.abs(now[0] - start[0]) > 6) {
        this.svg.setPointerCapture(event.pointerId);
        this.select(start, now);
      }
      this.hover(now);
    });
    this.svg.addEventListener('pointerup', (event) => {
      const now = place(event);
      this.select(null);
      if (start && Math.abs(now[0] - start[0]) > 6) this.zoomTo(start, now);
      else this.hover(now);
      start = null;
    });
    this.svg.addEventListener('pointercancel', () => {
      start = null;
      this.select(null);
    });
    this.svg.addEventListener('pointerleave', () => {
      this.tip.hidden = true;
    });
    this.svg.addEventListener('dblclick', () => this.reset());
  }

  /** Read the row next to a place. */
  hover(place) {
    const row = this.nearest(place);
    if (row < 0) return;
    this.tip.replaceChildren(...this.show(row).map(([name, value, note]) => element(
      'div', {}, `${name} `, element('b', {}, value), note ? ` ${note}` : '')));
    this.tip.hidden = false;
    const scale = this.box.clientWidth / this.width;
    const [x, y] = this.spot(row).map((value) => value * scale);
    const {offsetWidth, offsetHeight} = this.tip;
    const beside = x + 14 + offsetWidth > this.box.clientWidth ? x - 14 - offsetWidth : x + 14;
    this.tip.style.left = `${Math.max(0, beside)}px`;
    this.tip.style.top = `${Math.max(0, y - offsetHeight - 10)}px`;
  }

  /** Point at a row, and return what is known of it. */
  show(row) {
    this.view.point(row);
    return this.view.lines(row);
  }

  /** Show which part a zoom will take, from one place to another. */
  select(start, now) {
    if (this.selection) this.selection.remove();
    this.selection = null;
    if (!start) return;
    const [top, bottom] = this.across(start, now);
    this.selection = shape(this.svg, 'rect', {class: 'selection', x: Math.min(start[0], now[0]),
      y: top, width: Math.abs(now[0] - start[0]), height: Math.max(bottom - top, 0)});
  }
}
