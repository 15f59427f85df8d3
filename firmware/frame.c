// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "frame.h"

#include "crc16.h"

#define CRC_DIGITS 4
#define MOST_SEQUENCE_DIGITS 5

static bool is_letter(char c)
{
    return c >= 'a' && c <= 'z';
}

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static bool is_value(char c)
{
    return c > ' ' && c <= '~' && c != '*';
}

// Take "key=value" off the front of the fields; false where there is none.
static bool take_field(struct text *fields, struct text *key, struct text *value)
{
    const char *at = fields->start;
    const char *const end = at + fields->length;
    if (at == end || *at != ' ') {
        return false;
    }
    key->start = ++at;
    while (at < end && (is_letter(*at) || *at == '_')) {
        at++;
    }
    key->length = (uint8_t)(at - key->start);
    if (key->length == 0 || at == end || *at != '=') {
        return false;
    }
    value->start = ++at;
    while (at < end && is_value(*at)) {
        at++;
    }
    value->length = (uint8_t)(at - value->start);
    *fields = (struct text){at, (uint8_t)(end - at)};
    return value->length > 0;
}

static bool fields_are_well_formed(struct text fields)
{
    struct text key, value;
    while (fields.length > 0) {
        if (!take_field(&fields, &key, &value)) {
            return false;
        }
    }
    return true;
}

static bool a_key_comes_twice(struct text fields)
{
    struct text key, other, value;
    while (take_field(&fields, &key, &value)) {
        struct text later = fields;
        while (take_field(&later, &other, &value)) {
            if (text_equal(key, other)) {
                return true;
            }
        }
    }
    return false;
}

// Split "kind sequence fields"; the sequence number may still be too large.
static bool split(struct text body, struct frame *frame, uint32_t *sequence)
{
    const char *at = body.start;
    const char *const end = at + body.length;
    while (at < end && is_letter(*at)) {
        at++;
    }
    frame->kind = (struct text){body.start, (uint8_t)(at - body.start)};
    if (frame->kind.length == 0 || at == end || *at != ' ') {
        return false;
    }
    const char *const digits = ++at;
    while (at < end && is_digit(*at) && at - digits < MOST_SEQUENCE_DIGITS) {
        *sequence = *sequence * 10 + (uint8_t)(*at++ - '0');
    }
    frame->fields = (struct text){at, (uint8_t)(end - at)};
    return at > digits && fields_are_well_formed(frame->fields);
}

static bool read_crc(struct text digits, uint16_t *crc)
{
    if (digits.length != CRC_DIGITS) {
        return false;
    }
    *crc = 0;
    for (uint8_t i = 0; i < CRC_DIGITS; i++) {
        const char c = digits.start[i];
        if (!is_digit(c) && !(c >= 'A' && c <= 'F')) {
            return false;
        }
        *crc = (uint16_t)(*crc << 4 | (is_digit(c) ? c - '0' : c - 'A' + 10));
    }
    return true;
}

enum line frame_parse(struct text line, struct frame *frame)
{
    frame->has_crc = false;
    if (line.length > 0 && line.start[line.length - 1] == '\r') {
        line.length--;
    }
    if (line.length == 0) {
        return LINE_NONE;
    }
    if (line.start[0] == '#') {
        return LINE_REMARK;
    }
    struct text body = {line.start, 0};
    while (body.length < line.length && line.start[body.length] != '*') {
        body.length++;
    }
    uint32_t sequence = 0;
    uint16_t said;
    const bool well_formed = split(body, frame, &sequence);
    frame->crc = crc16(body.start, body.length);
    if (body.length == line.length) {
        frame->has_crc = well_formed;
        return LINE_WITHOUT_CRC;
    }
    const struct text digits = {body.start + body.length + 1,
                                (uint8_t)(line.length - body.length - 1)};
    if (!read_crc(digits, &said) || said != frame->crc) {
        frame->has_crc = well_formed;
        return LINE_WRONG_CRC;
    }
    if (!well_formed) {
        return LINE_WRONG_FORM;
    }
    if (sequence > UINT16_MAX || a_key_comes_twice(frame->fields)) {
        return LINE_WRONG_FIELDS;
    }
    frame->sequence = (uint16_t)sequence;
    return LINE_FRAME;
}

bool frame_value(const struct frame *frame, const FLASH char *key, struct text *value)
{
    struct text fields = frame->fields;
    struct text name;
    while (take_field(&fields, &name, value)) {
        if (text_is(name, key)) {
            return true;
        }
    }
    return false;
}
