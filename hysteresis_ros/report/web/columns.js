/* Copyright 2026 hysteresis_ros contributors */
/* SPDX-License-Identifier: Apache-2.0 */

/** Return the values of a column that was packed as whole numbers; the largest stands for none. */
function unpack({low, high, bits, data}) {
  const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
  const whole = bits === 32 ? new Uint32Array(bytes.buffer) : new Uint16Array(bytes.buffer);
  const none = 2 ** bits - 1;
  return Array.from(whole, (value) => (value === none ? null
    : low + (value / (none - 1)) * (high - low)));
}

/** Unpack all columns of a recording. */
function unpacked(recording) {
  recording.x.values = unpack(recording.x.values);
  recording.drive.values = unpack(recording.drive.values);
  recording.measured = unpack(recording.measured);
  recording.predictions.forEach((one) => { one.values = unpack(one.values); });
  return recording;
}
