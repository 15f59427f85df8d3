/* Copyright 2026 hysteresis_ros contributors */
/* SPDX-License-Identifier: Apache-2.0 */

/** What is looked at: trial, zoom, curves, region and row, the same for all charts of a page. */
class View {
  constructor(recording) {
    this.recording = recording;
    this.trial = -1;
    this.region = recording.regions.length ? 0 : -1;
    this.shown = recording.predictions.map(() => true);
    this.range = null;
    this.row = -1;
    this.charts = [];
  }

  /** The trials that are drawn. */
  get trials() {
    const {trials} = this.recording;
    return this.trial < 0 ? trials : [trials[this.trial]];
  }

  /** First row, and the one after the last, of the trials that are drawn. */
  get ends() {
    return [this.trials[0].from, this.trials[this.trials.length - 1].to];
  }

  /** What runs along the recording, from where to where, without zoom. */
  get whole() {
    const {x} = this.recording;
    const [from, to] = this.ends;
    return extent([x.values[from], x.values[to - 1]], 0.01);
  }

  /** The part of it that is drawn. */
  get domain() {
    return this.range || this.whole;
  }

  /** Rows of a trial within the zoom, first and after the last. */
  inside(trial) {
    const {values} = this.recording.x;
    const [low, high] = this.domain;
    return [Math.max(trial.from, search(values, low)),
      Math.min(trial.to, search(values, high, true))];
  }

  /** Draw all charts anew. */
  change() {
    this.charts.forEach((chart) => chart.draw());
  }

  choose(trial) {
    this.trial = trial;
    this.range = null;
    const [from, to] = this.ends;
    if (this.row < from || this.row >= to) this.row = -1;
    this.change();
  }

  /** Show a part of what runs along the recording; null shows all of it. */
  zoom(range) {
    const [low, high] = this.whole;
    const {values} = this.recording.x;
    const [from, to] = this.ends;
    const least = (high - low) / Math.max(to - from, 4);
    if (range && range[1] - range[0] < 0.999 * (high - low)) {
      const width = Math.max(range[1] - range[0], 3 * least);
      const start = Math.min(Math.max((range[0] + range[1] - width) / 2, low), high - width);
      this.range = [start, start + width];
    } else {
      this.range = null;
    }
    if (this.row >= 0 && this.range && (values[this.row] < this.range[0]
        || values[this.row] > this.range[1])) this.row = -1;
    this.change();
  }

  /** Show a part that is wider by a factor around the row pointed at, or the middle. */
  scale(factor) {
    const [low, high] = this.domain;
    const centre = this.row >= 0 ? this.recording.x.values[this.row] : (low + high) / 2;
    this.zoom([centre - factor * (centre - low), centre + factor * (high - centre)]);
  }

  /** Point at a row; -1 at none. */
  point(row) {
    this.row = row;
    this.charts.forEach((chart) => chart.mark());
  }

  /** What is known of a row: lines of [name, value, note]. */
  lines(row) {
    const {x, drive, response, measured, predictions, trials} = this.recording;
    const trial = trials.find((one) => row < one.to);
    const unit = response.unit ? ` ${response.unit}` : '';
    const lines = [[x.label.replace(/ \[.*/, ''),
      number(x.values[row], 4) + (x.unit ? ` ${x.unit}` : ''), `trial ${trial.name}`]];
    lines.push([drive.label.replace(/ \[.*/, ''),
      number(drive.values[row]) + (drive.unit ? ` ${drive.unit}` : ''), '']);
    lines.push(['measured', number(measured[row], 4) + unit, '']);
    predictions.forEach((one, n) => {
      if (!this.shown[n] || one.values[row] === null) return;
      const residual = measured[row] - one.values[row];
      lines.push([one.name, number(one.values[row], 4) + unit, `residual ${signed(residual)}${unit}`]);
    });
    return lines;
  }

  /** The same in a sentence. */
  words(row) {
    return this.lines(row).map(([name, value, note]) => `${name} ${value}${note ? ` (${note})` : ''}`)
      .join(', ');
  }
}

/** Return the place of a value among ascending ones, or that after its equals. */
function search(values, value, after = false) {
  let low = 0;
  let high = values.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] < value || (after && values[middle] === value)) low = middle + 1;
    else high = middle;
  }
  return low;
}
