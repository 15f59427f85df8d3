/* Copyright 2026 hysteresis_ros contributors */
/* SPDX-License-Identifier: Apache-2.0 */

/** The row of controls above the charts; labels with a sample of the line are the legend. */
class Controls {
  constructor(place, view) {
    this.view = view;
    const {trials, regions, predictions} = view.recording;
    const parts = [element('span', {class: 'key measured'}, 'measured')];
    predictions.forEach((one, n) => parts.push(this.toggle(one, n)));
    if (trials.length > 1) {
      parts.push(this.choice('Trial', ['all trials', ...trials.map(
        (one) => `trial ${one.name}: ${one.error}`)], 0, (n) => {
        view.charts.forEach((chart) => { chart.range = null; });
        view.choose(n - 1);
      }));
    }
    if (regions.length) {
      parts.push(this.choice('Shade', ['nothing', ...regions.map(
        (one, n) => `${n + 1}. ${one.name}`)], 1, (n) => {
        view.region = n - 1;
        view.change();
      }));
    }
    const buttons = element('span', {class: 'buttons', role: 'group', 'aria-label': 'Zoom'},
      this.button('+', 'zoom in', () => view.scale(0.5)),
      this.button('\u2212', 'zoom out', () => view.scale(2)),
      this.button('all', 'show the whole recording', () => {
        view.charts.forEach((chart) => { chart.range = null; });
        view.zoom(null);
      }));
    place.append(element('div', {class: 'controls'}, ...parts, buttons));
  }

  toggle(prediction, n) {
    const box = element('input', {type: 'checkbox'});
    box.checked = this.view.shown[n];
    box.addEventListener('change', () => {
      this.view.shown[n] = box.checked;
      this.view.change();
    });
    return element('label', {class: `key ${prediction.role}`}, box, prediction.name);
  }

  choice(name, texts, chosen, act) {
    const select = element('select');
    texts.forEach((text, n) => select.append(element('option', {value: n}, text)));
    select.value = String(chosen);
    select.addEventListener('change', () => act(Number(select.value)));
    return element('label', {}, `${name} `, select);
  }

  button(text, title, act) {
    const button = element('button', {type: 'button', title, 'aria-label': title}, text);
    button.addEventListener('click', act);
    return button;
  }
}

/** A slider along the rows, which reads their values by keyboard and to a screen reader. */
class Reader {
  constructor(place, view) {
    this.view = view;
    this.slider = element('input', {type: 'range', min: 0, step: 1,
      'aria-label': 'Row of the recording'});
    this.output = element('output', {'aria-hidden': 'true'},
      'Point at a chart, or move the slider, for values. Drag across for a part, double-click for '
      + 'all.');
    this.slider.addEventListener('input', () => view.point(Number(this.slider.value)));
    place.append(element('div', {class: 'reader'}, this.slider, this.output));
    view.charts.push(this);
  }

  draw() {
    const [from, to] = this.view.ends;
    const rows = this.view.trials.map((trial) => this.view.inside(trial)).filter(([a, b]) => b > a);
    this.slider.min = rows.length ? rows[0][0] : from;
    this.slider.max = (rows.length ? rows[rows.length - 1][1] : to) - 1;
    this.mark();
  }

  mark() {
    const {row} = this.view;
    if (row < 0) return;
    this.slider.value = String(row);
    const words = this.view.words(row);
    this.slider.setAttribute('aria-valuetext', words);
    this.output.textContent = words;
  }
}
