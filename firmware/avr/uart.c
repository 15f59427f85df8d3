// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// The serial port, 115200 baud 8N1, with a buffer each way.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#include "../hal.h"
#include "parts.h"

#define BAUD 115200UL
#define RECEIVED 128            // bytes, a power of two: 11 ms

static volatile uint8_t received[RECEIVED];
static volatile uint8_t received_in, received_out;
// As many as an index of 8 bits can tell apart, so that it wraps by itself.
static volatile uint8_t sent[256];
static volatile uint8_t sent_in, sent_out;

ISR(USART_RX_vect)
{
    const uint8_t byte = UDR0;
    const uint8_t next = (received_in + 1) & (RECEIVED - 1);
    if (next != received_out) {     // full: the byte is lost, and the CRC tells
        received[received_in] = byte;
        received_in = next;
    }
}

ISR(USART_UDRE_vect)
{
    if (sent_out == sent_in) {
        UCSR0B &= (uint8_t)~_BV(UDRIE0);
    } else {
        UDR0 = sent[sent_out++];
    }
}

void uart_start(void)
{
    UCSR0A = _BV(U2X0);
    UBRR0 = (F_CPU + 4 * BAUD) / (8 * BAUD) - 1;
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);
}

bool hal_read(uint8_t *byte)
{
    const uint8_t out = received_out;
    if (out == received_in) {
        return false;
    }
    *byte = received[out];
    received_out = (out + 1) & (RECEIVED - 1);
    return true;
}

bool hal_write(const char *data, uint8_t length)
{
    const uint8_t room = (uint8_t)(sent_out - sent_in - 1);
    if (length > room) {
        return false;
    }
    uint8_t in = sent_in;
    for (uint8_t i = 0; i < length; i++) {
        sent[in++] = (uint8_t)data[i];
    }
    sent_in = in;
    ATOMIC_BLOCK(ATOMIC_FORCEON) {      // the interrupt clears this bit
        UCSR0B |= _BV(UDRIE0);
    }
    return true;
}
