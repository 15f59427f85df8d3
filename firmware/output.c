// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "output.h"

#include "config.h"
#include "hal.h"
#include "power.h"

static struct output state;
static uint32_t last_set;
static uint32_t last_closed;        // when the stop input was last seen closed
static uint16_t watchdog;

static void apply(uint16_t steps)
{
    state.steps = steps;
    hal_set_pwm(steps);
}

static void set_fault(enum fault fault, bool stands)
{
    if (stands) {
        state.faults |= (uint8_t)fault;
    } else {
        state.faults &= (uint8_t)~fault;
    }
}

void output_start(uint32_t now)
{
    state = (struct output){0};
    last_set = now;
    last_closed = now;
    watchdog = LONGEST_WATCHDOG;
    power_start(now);
    apply(0);
}

void output_set_watchdog(uint32_t milliseconds)
{
    watchdog = milliseconds < LONGEST_WATCHDOG ? (uint16_t)milliseconds : LONGEST_WATCHDOG;
}

// The stop is remembered until `disable`, so that nothing heats up when the button is released.
static void watch_stop(uint32_t now)
{
    if (!hal_stop_is_open()) {
        last_closed = now;
    } else if (now - last_closed >= STOP_DEBOUNCE) {
        state.enabled = false;
        set_fault(FAULT_STOP, true);
        apply(0);
    }
}

static void watch_supply(void)
{
    const bool measured = hal_read_supply(&state.supply);
    const bool low = !measured || state.supply < LOWEST_SUPPLY;
    set_fault(FAULT_SUPPLY, low);
    if (low) {
        apply(0);
    }
}

// Remembered until `disable`, too: a host that asks for more than the wires stand is not to be
// trusted with what they have left.
static void watch_power(uint32_t now)
{
    power_add(state.steps, state.supply, now);
    if (power_is_exceeded()) {
        state.enabled = false;
        set_fault(FAULT_POWER, true);
        apply(0);
    }
}

static void watch_setpoints(uint32_t now)
{
    if (state.enabled && now - last_set > watchdog) {
        set_fault(FAULT_WATCHDOG, true);
        apply(0);
    }
}

void output_watch(uint32_t now)
{
    watch_power(now);
    watch_stop(now);
    watch_supply();
    watch_setpoints(now);
}

enum refusal output_enable(uint32_t now)
{
    if (state.faults & FAULT_STOP) {
        return STOPPED;
    }
    if (state.faults & FAULT_POWER) {
        return TOO_MUCH_POWER;
    }
    if (!state.enabled) {
        apply(0);
        state.enabled = true;
        last_set = now;
    }
    return OBEYED;
}

void output_disable(void)
{
    apply(0);
    state.enabled = false;
    set_fault(FAULT_WATCHDOG, false);
    if (!hal_stop_is_open()) {
        set_fault(FAULT_STOP, false);
    }
    if (!power_is_exceeded()) {
        set_fault(FAULT_POWER, false);
    }
}

enum refusal output_set(uint16_t steps, uint16_t sequence, uint32_t now)
{
    if (steps > (uint32_t)PWM_STEPS * DUTY_LIMIT_PERCENT / 100) {
        return OUT_OF_RANGE;
    }
    if (!state.enabled) {
        return DISABLED;
    }
    if (state.faults & FAULT_SUPPLY) {
        return NO_SUPPLY;
    }
    apply(steps);
    set_fault(FAULT_WATCHDOG, false);
    last_set = now;
    state.accepted = sequence;
    state.has_accepted = true;
    state.obeyed++;
    return OBEYED;
}

const struct output *output_state(void)
{
    return &state;
}
