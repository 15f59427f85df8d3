// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// What differs between boards: limits, wiring constants, names. All may be given to make, such as
// `make CONFIG='-DDUTY_LIMIT_PERCENT=40 -DSUPPLY_FULL_SCALE=17350'`.
#ifndef CONFIG_H
#define CONFIG_H

#define FIRMWARE_VERSION "1.0"
#define PROTOCOL_VERSION 1

// Largest duty that is obeyed, in percent; a larger `set` is refused.
#ifndef DUTY_LIMIT_PERCENT
#define DUTY_LIMIT_PERCENT 100
#endif

// The supply in mV at which the converter reads full scale: 1.1 V times (100 k + 6.8 k) / 6.8 k.
// The reference of each chip is up to 10 % off: README.md says how to calibrate.
#ifndef SUPPLY_FULL_SCALE
#define SUPPLY_FULL_SCALE 17276
#endif

// Supply in mV below which the output is off.
#ifndef LOWEST_SUPPLY
#define LOWEST_SUPPLY 4000
#endif

// Largest RMS in mV of the voltage over the wires, and the window in ms over which it is taken.
// `config` may ask for less, not for more, and for another window. As it stands, the RMS is limited
// by `config` alone: no duty exceeds it.
#ifndef RMS_LIMIT
#define RMS_LIMIT SUPPLY_FULL_SCALE
#endif
#ifndef RMS_WINDOW
#define RMS_WINDOW 60000
#endif

// ms without an obeyed `set` that switch the output off. `config` may ask for less, not for more.
#ifndef LONGEST_WATCHDOG
#define LONGEST_WATCHDOG 500
#endif

#define FIRST_PERIOD 100        // ms between two frames of telemetry until `config` says otherwise
#define SHORTEST_PERIOD 20      // ms; the longest frame takes 17 ms at 115200 baud
#define LONGEST_PERIOD 0x3FFFFFFFUL // ms; the clock wraps at 2^32
#define LONGEST_RMS_WINDOW 3600000UL    // ms
#define REMARK_PERIOD 200       // ms between two explanations for people
#define STOP_DEBOUNCE 5         // ms that the stop input has to be open: not a spark's glitch

_Static_assert(DUTY_LIMIT_PERCENT > 0 && DUTY_LIMIT_PERCENT <= 100, "duty limit in percent");
_Static_assert(SUPPLY_FULL_SCALE > LOWEST_SUPPLY && SUPPLY_FULL_SCALE <= 65000L, "supply in mV");
_Static_assert(RMS_LIMIT > 0 && RMS_LIMIT <= 65000L, "RMS limit in mV");
_Static_assert(RMS_WINDOW > 0 && RMS_WINDOW <= LONGEST_RMS_WINDOW, "RMS window in ms");
_Static_assert(LONGEST_WATCHDOG > 0 && LONGEST_WATCHDOG <= 500, "watchdog in ms");

#endif
