// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// The hardware on a computer: variables that a test sets and reads.
#include "../hal.h"

#include <string.h>

#include "../board.h"
#include "host.h"

#define BUFFER 65536
#define PASSES 4                // of the loop in each ms: enough for all bytes of one

static uint32_t now, fed, received_in, received_out, sent_length;
static uint8_t received[BUFFER], sent[BUFFER];
static struct quadrature tracks;
static uint16_t supply = 12000, pwm, boot;
static bool stop_open, jammed;

void hal_start(void)
{
    boot++;
    now = fed = received_in = received_out = sent_length = pwm = 0;
    tracks = (struct quadrature){.before = tracks.before};
}

uint32_t hal_time(void)
{
    return now;
}

bool hal_read(uint8_t *byte)
{
    if (received_out == received_in) {
        return false;
    }
    *byte = received[received_out++ % BUFFER];
    return true;
}

bool hal_write(const char *data, uint8_t length)
{
    if (jammed || sent_length + length > BUFFER) {
        return false;
    }
    memcpy(sent + sent_length, data, length);
    sent_length += length;
    return true;
}

void hal_set_pwm(uint16_t steps)
{
    pwm = steps;
}

void hal_read_quadrature(struct quadrature *copy)
{
    *copy = tracks;
}

bool hal_read_supply(uint16_t *millivolts)
{
    *millivolts = supply;
    return true;
}

bool hal_stop_is_open(void)
{
    return stop_open;
}

uint16_t hal_boot(void)
{
    return boot;
}

const FLASH char *hal_reset_cause(void)
{
    return TEXT("power");
}

void hal_feed_watchdog(void)
{
    fed++;
}

void host_start(void)
{
    hal_start();
    board_start();
}

void host_step(void)
{
    board_step();
}

void host_advance(uint32_t milliseconds)
{
    while (milliseconds-- > 0) {
        now++;
        for (uint8_t i = 0; i < PASSES; i++) {
            board_step();
        }
    }
}

void host_leap(uint32_t milliseconds)
{
    now += milliseconds;
}

void host_receive(const uint8_t *data, uint32_t length)
{
    for (uint32_t i = 0; i < length && received_in - received_out < BUFFER; i++) {
        received[received_in++ % BUFFER] = data[i];
    }
}

uint32_t host_transmit(uint8_t *data, uint32_t most)
{
    const uint32_t length = sent_length < most ? sent_length : most;
    memcpy(data, sent, length);
    sent_length -= length;
    memmove(sent, sent + length, sent_length);
    return length;
}

void host_tracks(bool a, bool b)
{
    quadrature_edge(&tracks, (uint8_t)(a << 2 | b << 3));
}

void host_index(void)
{
    quadrature_index(&tracks);
}

void host_set_supply(uint16_t millivolts)
{
    supply = millivolts;
}

void host_open_stop(bool open)
{
    stop_open = open;
}

void host_jam_port(bool is_jammed)
{
    jammed = is_jammed;
}

uint16_t host_pwm(void)
{
    return pwm;
}

uint32_t host_fed(void)
{
    return fed;
}
