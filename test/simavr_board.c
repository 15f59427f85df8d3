// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// The firmware's machine code in simavr: its serial port is a pseudo-terminal, its encoder, supply
// and stop input do what standard input says, and standard output tells what its gates get.
//
//   simavr_board firmware.elf [SPEED]
//
// It begins with the line `port NAME`. Time passes no faster than SPEED times the wall's; one that
// is given is stated in the chip's greeting, as by the simulated board. Commands, one a line, each
// answered by one line:
//
//   turn EDGES RATE     move the encoder at so many edges a second; EDGES may be negative
//   supply MILLIVOLTS   of the muscle's supply
//   stop 0|1            open the emergency stop's contact
//   index COUNTS|off    where the encoder's index pulse is, within a turn
//   clock MILLISECONDS  change the firmware's clock by so much
//   reset               pull the chip's reset pin
//   hang                an endless loop instead of the next instruction, until a reset
//   history             ms:steps of each change of channel 1 so far
//   state               key=value ...; what they mean is at print_state
//
// simavr is GPL-3: this program is for tests only and no part of what is installed.
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <pty.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <simavr/avr_adc.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_timer.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_hex.h>

#define FREQUENCY 16000000UL
#define SLICE (FREQUENCY / 1000)        // cycles between two looks at terminal and standard input
#define BYTE_CYCLES 1504                // of a byte: simavr counts a parity bit that is not there
#define QUEUE 65536
#define HISTORY 4096
#define TURN 8192                       // counts between two index pulses

// Addresses in the data memory of the ATmega328P.
#define DDRB_ 0x24
#define OCR2A_ 0xB3
#define TCCR1A_ 0x80
#define TCCR2A_ 0xB0

enum { TRACK_A = 2, TRACK_B = 3, INDEX_PIN = 4, STOP_PIN = 7 };

static avr_t *avr;
static avr_irq_t *port_d[8];
static int terminal;
static double speed = 1.0;
static bool states_speed;

static unsigned char queue[QUEUE];
static unsigned queue_in, queue_out;

static long counts, edges_left, index_place = 2731;
static bool index_off;
static unsigned clock_at;               // address of the firmware's milliseconds, 4 bytes
static avr_cycle_count_t edge_cycles, next_edge;
static unsigned supply = 12000;
static int stop_open;

static unsigned pwm[2], third[4], third_writes;
static struct { double ms; unsigned steps; } history[HISTORY];
static unsigned changes;
static unsigned resets, lowest_stack = 0xFFFF;
static void (*core_reset)(struct avr_t *);
static bool was_reset, hung;
static avr_flashaddr_t hung_at;
static unsigned char hung_code[2];

static double milliseconds(void)
{
    return 1000.0 * avr->cycle / FREQUENCY;
}

// Encoder

static bool at_index(void)
{
    return !index_off && (counts - index_place) % TURN == 0;
}

static void set_tracks(void)
{
    const int phase = counts & 3;
    avr_raise_irq(port_d[TRACK_A], phase == 1 || phase == 2);
    avr_raise_irq(port_d[TRACK_B], phase == 2 || phase == 3);
    avr_raise_irq(port_d[INDEX_PIN], at_index());
}

static avr_cycle_count_t on_edge(avr_t *chip, avr_cycle_count_t when, void *unused)
{
    (void)chip;
    (void)unused;
    const int step = edges_left > 0 ? 1 : -1;
    counts += step;
    edges_left -= step;
    set_tracks();
    next_edge = edges_left ? when + edge_cycles : 0;
    return next_edge;
}

static void turn(long edges, double rate)
{
    edges_left = edges;
    edge_cycles = (avr_cycle_count_t)(FREQUENCY / rate);
    avr_cycle_timer_cancel(avr, on_edge, NULL);
    if (edges) {
        avr_cycle_timer_register(avr, edge_cycles, on_edge, NULL);
    }
}

// Serial port

static avr_cycle_count_t on_byte(avr_t *chip, avr_cycle_count_t when, void *unused)
{
    (void)unused;
    if (queue_out != queue_in) {
        avr_raise_irq(avr_io_getirq(chip, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT),
                      queue[queue_out++ % QUEUE]);
    }
    return when + BYTE_CYCLES;
}

static void send(const char *data, size_t length)
{
    if (write(terminal, data, length) != (ssize_t)length) {
        return;         // nobody reads: a real line loses it, too
    }
}

// The greeting, with the speed in it and another CRC.
static void send_greeting(char *line, size_t length)
{
    char *const end = memrchr(line, '*', length);
    if (!end) {
        send(line, length);
        return;
    }
    length = (end - line) + sprintf(end, " speed=%.5f", speed);
    unsigned crc = 0xFFFF;
    for (size_t i = 0; i < length; i++) {
        crc ^= (unsigned)(unsigned char)line[i] << 8;
        for (int bit = 0; bit < 8; bit++) {
            crc = (crc & 0x8000 ? crc << 1 ^ 0x1021 : crc << 1) & 0xFFFF;
        }
    }
    length += sprintf(line + length, "*%04X\n", crc);
    send(line, length);
}

static void on_sent(avr_irq_t *irq, uint32_t value, void *unused)
{
    (void)irq;
    (void)unused;
    static char line[512];
    static size_t length;
    const char byte = value;
    if (!states_speed) {
        send(&byte, 1);
        return;
    }
    line[length++] = byte;
    if (byte == '\n' || length == sizeof line / 2) {
        if (length > 6 && !memcmp(line, "board ", 6)) {
            send_greeting(line, length);
        } else {
            send(line, length);
        }
        length = 0;
    }
}

static void open_terminal(void)
{
    char name[128];
    int far_end;
    struct termios raw;
    memset(&raw, 0, sizeof raw);
    cfmakeraw(&raw);
    raw.c_cflag |= CS8 | CREAD | CLOCAL;
    if (openpty(&terminal, &far_end, name, &raw, NULL) != 0) {
        perror("openpty");
        exit(1);
    }
    fcntl(terminal, F_SETFL, O_NONBLOCK);
    printf("port %s\n", name);      // the far end stays open here: others may come and go
}

static void read_terminal(void)
{
    unsigned char data[256];
    const ssize_t length = read(terminal, data, sizeof data);
    for (ssize_t i = 0; i < length && queue_in - queue_out < QUEUE; i++) {
        queue[queue_in++ % QUEUE] = data[i];
    }
}

// Gates

static bool connected(uint8_t control, uint8_t mode, uint8_t pin)
{
    return (avr->data[control] & mode * 3) == mode * 2 && avr->data[DDRB_] & 1 << pin;
}

static void on_pwm(avr_irq_t *irq, uint32_t value, void *channel)
{
    (void)irq;
    unsigned *const steps = channel;
    if (steps == pwm && *steps != value && changes < HISTORY) {
        history[changes].ms = milliseconds();
        history[changes++].steps = value;
    }
    *steps = value;
}

static void on_third(avr_irq_t *irq, uint32_t value, void *unused)
{
    (void)irq;
    (void)unused;
    third[third_writes++ % 4] = value;
}

// Reset

static void on_reset(avr_t *chip)
{
    if (hung) {
        memcpy(chip->flash + hung_at, hung_code, sizeof hung_code);
        hung = false;
    }
    for (int channel = 0; channel < 2; channel++) {
        on_pwm(NULL, 0, &pwm[channel]);     // the pins are inputs: the gates' resistors pull down
    }
    memset(third, 0, sizeof third);
    resets++;
    was_reset = true;
    core_reset(chip);
}

// Neither pull-ups nor what a reset leaves move a pin that something outside drives.
static void drive_pin(int pin, int value)
{
    static unsigned values;
    values = (values & ~(1U << pin)) | (unsigned)!!value << pin;
    avr_ioport_external_t external = {.name = 'D', .value = values,
        .mask = 1 << TRACK_A | 1 << TRACK_B | 1 << INDEX_PIN | 1 << STOP_PIN};
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL('D'), &external);
    avr_raise_irq(port_d[pin], !!value);
}

// Everything that a reset of simavr forgets, but no real one.
static void wire(void)
{
    was_reset = false;
    drive_pin(TRACK_A, (counts & 3) == 1 || (counts & 3) == 2);
    drive_pin(TRACK_B, (counts & 3) >= 2);
    drive_pin(INDEX_PIN, at_index());
    drive_pin(STOP_PIN, stop_open);
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0), supply * 68 / 1068);
    avr_cycle_timer_register(avr, BYTE_CYCLES, on_byte, NULL);
    turn(edges_left, edges_left ? (double)FREQUENCY / edge_cycles : 1.0);
}

static void hang(void)
{
    hung_at = avr->pc;
    memcpy(hung_code, avr->flash + hung_at, sizeof hung_code);
    avr->flash[hung_at] = 0xFF;         // rjmp .-2
    avr->flash[hung_at + 1] = 0xCF;
    hung = true;
}

static void change_clock(long milliseconds)
{
    uint32_t now;
    memcpy(&now, avr->data + clock_at, sizeof now);
    now += (uint32_t)milliseconds;
    memcpy(avr->data + clock_at, &now, sizeof now);
}

// Commands

static void print_state(double wall)
{
    printf("ms=%.3f speed=%.3f pwm1=%u pwm2=%u pwm3=%u connected=%d counts=%ld edges_left=%ld "
           "resets=%u stack=%u waiting=%u\n",
           milliseconds(), milliseconds() / wall,   // since the start, against the wall's clock
           pwm[0], pwm[1],                          // steps of channels 1 and 2, of 1020
           third[0] + third[1] + third[2] + third[3],   // of channel 3, over its four latest ms
           connected(TCCR1A_, 0x40, 1) && connected(TCCR1A_, 0x10, 2)
           && connected(TCCR2A_, 0x40, 3),          // the three pins are driven by their timers
           counts, edges_left,                      // where the encoder is, and has to go
           resets,                                  // starts after the first
           0x8FF - lowest_stack,                    // bytes that the stack took at most
           queue_in - queue_out);                   // bytes on their way to the chip
}

static void print_history(void)
{
    printf("history");
    for (unsigned i = 0; i < changes; i++) {
        printf(" %.3f:%u", history[i].ms, history[i].steps);
    }
    printf("\n");
}

static void obey(const char *line, double wall)
{
    long edges, milliseconds;
    double rate;
    if (sscanf(line, "turn %ld %lf", &edges, &rate) == 2 && rate > 0) {
        turn(edges, rate);
    } else if (sscanf(line, "supply %u", &supply) == 1) {
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0), supply * 68 / 1068);
    } else if (sscanf(line, "stop %d", &stop_open) == 1) {
        drive_pin(STOP_PIN, stop_open);
    } else if (sscanf(line, "index %ld", &index_place) == 1 || !strncmp(line, "index off", 9)) {
        index_off = !strncmp(line, "index off", 9);
        avr_raise_irq(port_d[INDEX_PIN], at_index());
    } else if (clock_at && sscanf(line, "clock %ld", &milliseconds) == 1) {
        change_clock(milliseconds);
    } else if (!strncmp(line, "reset", 5)) {
        avr_reset(avr);
    } else if (!strncmp(line, "hang", 4)) {
        hang();
    } else if (!strncmp(line, "history", 7)) {
        print_history();
        return;
    } else if (!strncmp(line, "state", 5)) {
        print_state(wall);
        return;
    } else {
        printf("unknown %s", line);
        return;
    }
    printf("done\n");
}

// Standard input, without waiting; false at its end, which is the end of this program.
static bool read_commands(double wall)
{
    static char line[256];
    static unsigned length;
    char byte;
    ssize_t got;
    while ((got = read(STDIN_FILENO, &byte, 1)) == 1) {
        if (length < sizeof line - 2) {
            line[length++] = byte;
        }
        if (byte == '\n') {
            line[length] = '\0';
            obey(line, wall);
            length = 0;
        }
    }
    return got < 0 && errno == EAGAIN;
}

// The wall's clock in ms.
static double wall_clock(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e3 * now.tv_sec + 1e-6 * now.tv_nsec;
}

static bool run_slice(void)
{
    const avr_cycle_count_t end = avr->cycle + SLICE;
    while (avr->cycle < end) {
        const int state = avr_run(avr);
        if (state == cpu_Crashed || state == cpu_Done) {
            fprintf(stderr, "the simulated chip has crashed\n");
            return false;
        }
        const unsigned stack = avr->data[R_SPL] | avr->data[R_SPH] << 8;
        if (stack > 0x100 && stack < lowest_stack) {
            lowest_stack = stack;
        }
        if (was_reset) {
            wire();
        }
    }
    return true;
}

static void make_chip(const char *path)
{
    elf_firmware_t firmware;
    memset(&firmware, 0, sizeof firmware);
    if (elf_read_firmware(path, &firmware) != 0) {
        fprintf(stderr, "%s: no firmware\n", path);
        exit(1);
    }
    avr = avr_make_mcu_by_name("atmega328p");
    if (!avr) {
        fprintf(stderr, "simavr does not know the atmega328p\n");
        exit(1);
    }
    avr_init(avr);
    avr->log = LOG_ERROR;       // it complains of timer 2's mode, which it does not know
    avr->frequency = FREQUENCY;
    avr_load_firmware(avr, &firmware);
    for (unsigned i = 0; i < firmware.symbolcount; i++) {
        if (!strcmp(firmware.symbol[i]->symbol, "milliseconds")) {
            clock_at = firmware.symbol[i]->addr & 0xFFFF;   // data has an offset of 0x800000
        }
    }
    avr->frequency = FREQUENCY;
    core_reset = avr->reset;
    avr->reset = on_reset;
}

static void connect_chip(void)
{
    uint32_t flags = 0;
    // Neither a copy on the console, nor a pause at each look at the port.
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    // Else a pin that is low before the firmware asks for edges interrupts it for ever.
    avr_extint_set_strict_lvl_trig(avr, 0, 0);
    avr_extint_set_strict_lvl_trig(avr, 1, 0);
    for (int pin = 0; pin < 8; pin++) {
        port_d[pin] = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), pin);
    }
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT),
                            on_sent, NULL);
    for (int channel = 0; channel < 2; channel++) {
        avr_irq_register_notify(
            avr_io_getirq(avr, AVR_IOCTL_TIMER_GETIRQ('1'), TIMER_IRQ_OUT_PWM0 + channel),
            on_pwm, &pwm[channel]);
    }
    avr_irq_register_notify(avr_iomem_getirq(avr, OCR2A_, "third", AVR_IOMEM_IRQ_ALL), on_third,
                            NULL);
    wire();
}

int main(int count, char **arguments)
{
    if (count == 3) {
        speed = atof(arguments[2]);
        states_speed = true;
    }
    if (count < 2 || count > 3 || !(speed > 0.0)) {
        fprintf(stderr, "usage: simavr_board firmware.elf [SPEED]\n");
        return 2;
    }
    setvbuf(stdout, NULL, _IOLBF, 0);
    make_chip(arguments[1]);
    open_terminal();
    connect_chip();
    fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK);
    const double start = wall_clock();
    double wall;
    do {
        read_terminal();
        if (!run_slice()) {
            return 1;
        }
        wall = wall_clock() - start;
        const double ahead = milliseconds() / speed - wall;
        if (ahead > 1.0) {
            usleep((useconds_t)(1000.0 * ahead));
        }
    } while (read_commands(wall));
    return 0;
}
