// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// A coverage-guided fuzzer for compilers that bring none, such as gcc with
// -fsanitize-coverage=trace-pc. It takes the options of libFuzzer that make uses, runs the same
// target, and keeps an input that reaches a new pair of basic blocks, or one more often.
//
//   fuzz_decoder [-runs=N] [-max_total_time=S] [-seed=N] [-max_len=N] [-dict=FILE]
//                [-artifact_prefix=PATH] FOLDER...   mutate the files of the folders
//   fuzz_decoder FILE                                run one input, as after a crash
#include <dirent.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define PAIRS 4096              // places for pairs of basic blocks, and about ten times as many
#define MOST_INPUTS 4096
#define MOST_WORDS 256
#define MOST_BYTES 4096
#define DEEPEST 5               // changes are doubled up to this power of two
#define LONGEST_PIECE 32        // bytes that one change inserts or erases
#define RUNS_BETWEEN_LOOKS 256  // at the clock

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned seed);
size_t LLVMFuzzerMutate(uint8_t *data, size_t size, size_t most);
void __sanitizer_cov_trace_pc(void);
const char *__asan_default_options(void);
const char *__ubsan_default_options(void);

struct input { uint8_t *data; size_t size; };

static uint8_t hits[PAIRS], seen[PAIRS];
static uintptr_t before;
static struct input inputs[MOST_INPUTS], words[MOST_WORDS];
static unsigned inputs_count, words_count;
static uint8_t present[MOST_BYTES];
static size_t present_size;
static uint64_t random_state = 1;
static unsigned long runs = ~0UL;
static double longest;
static size_t most_bytes = 512;
static const char *prefix = "";

// Coverage

void __sanitizer_cov_trace_pc(void)
{
    // Relative to this file's code, so that each start finds the same.
    const uintptr_t here = (uintptr_t)__builtin_return_address(0) - (uintptr_t)&LLVMFuzzerMutate;
    hits[(before ^ here ^ here >> 7) % PAIRS]++;
    before = here << 1;
}

// One bit for 1, 2, 3, 4 to 7, 8 to 15, 16 to 31, 32 to 127 and more passes.
static uint8_t bucket(uint8_t count)
{
    static const uint8_t upper[] = {1, 2, 3, 7, 15, 31, 127};
    uint8_t bit = 0;
    while (bit < sizeof upper && count > upper[bit]) {
        bit++;
    }
    return (uint8_t)(1U << bit);
}

// Whether the latest run did something new; what it did is taken note of.
static bool is_new(void)
{
    bool found = false;
    for (size_t i = 0; i < PAIRS; i += sizeof(uint64_t)) {
        uint64_t eight;
        memcpy(&eight, hits + i, sizeof eight);
        for (size_t j = i; eight && j < i + sizeof eight; j++) {
            const uint8_t bit = hits[j] ? bucket(hits[j]) : 0;
            found = found || (bit & ~seen[j]);
            seen[j] |= bit;
        }
    }
    return found;
}

static void run(void)
{
    memset(hits, 0, sizeof hits);
    before = 0;
    // At its exact size, so that a sanitizer sees who reads past its end.
    uint8_t *const copy = malloc(present_size + !present_size);
    memcpy(copy, present, present_size);
    LLVMFuzzerTestOneInput(copy, present_size);
    free(copy);
}

// Changes

static uint64_t below(uint64_t limit)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return limit ? (random_state >> 11) % limit : 0;
}

// The shorter one of two, as it runs faster and says as much.
static const struct input *choose(void)
{
    const struct input *const one = &inputs[below(inputs_count)];
    const struct input *const other = &inputs[below(inputs_count)];
    return one->size < other->size ? one : other;
}

static size_t insert(uint8_t *data, size_t size, size_t most, const uint8_t *piece, size_t length)
{
    if (size + length > most) {
        return size;
    }
    const size_t at = below(size + 1);
    memmove(data + at + length, data + at, size - at);
    memcpy(data + at, piece, length);
    return size + length;
}

// Return the length of a piece of some bytes.
static size_t piece_of(size_t size)
{
    return size ? 1 + below(size < LONGEST_PIECE ? size : LONGEST_PIECE) : 0;
}

static size_t erase(uint8_t *data, size_t size)
{
    const size_t at = below(size), length = piece_of(size - at);
    memmove(data + at, data + at + length, size - at - length);
    return size - length;
}

static size_t change(uint8_t *data, size_t size, size_t most)
{
    uint8_t piece[LONGEST_PIECE];
    const uint64_t how = size ? below(8) : 5;
    if (how == 0) {
        data[below(size)] ^= (uint8_t)(1U << below(8));
    } else if (how == 1) {
        data[below(size)] = (uint8_t)below(256);
    } else if (how == 2) {
        data[below(size)] = (uint8_t)('0' + below(10));
    } else if (how == 3) {
        return erase(data, size);
    } else if (how == 4) {
        const size_t at = below(size), length = piece_of(size - at);
        memcpy(piece, data + at, length);
        return insert(data, size, most, piece, length);
    } else if (how == 5) {
        piece[0] = (uint8_t)below(256);
        return insert(data, size, most, piece, 1);
    } else if (how == 6 && words_count) {
        const struct input word = words[below(words_count)];
        return insert(data, size, most, word.data, word.size);
    } else if (how == 7 && inputs_count) {
        const struct input other = inputs[below(inputs_count)];
        const size_t at = below(other.size);
        return insert(data, size, most, other.data + at, piece_of(other.size - at));
    }
    return size;
}

size_t LLVMFuzzerMutate(uint8_t *data, size_t size, size_t most)
{
    for (uint64_t times = 1ULL << below(DEEPEST); times > 0; times--) {
        size = change(data, size, most);
    }
    return size;
}

// Inputs

static void keep(struct input *list, unsigned *count, unsigned most, const uint8_t *data,
                 size_t size)
{
    if (*count < most) {
        list[*count] = (struct input){malloc(size + !size), size};
        memcpy(list[(*count)++].data, data, size);
    }
}

static bool read_input(const char *path)
{
    FILE *const file = fopen(path, "rb");
    if (!file) {
        return false;
    }
    present_size = fread(present, 1, most_bytes, file);
    fclose(file);
    return true;
}

static void read_folder(const char *path)
{
    DIR *const folder = opendir(path);
    struct dirent *entry;
    while (folder && (entry = readdir(folder))) {
        char name[MOST_BYTES];
        struct stat about;
        snprintf(name, sizeof name, "%s/%s", path, entry->d_name);
        if (stat(name, &about) == 0 && S_ISREG(about.st_mode) && read_input(name)) {
            run();
            is_new();
            keep(inputs, &inputs_count, MOST_INPUTS, present, present_size);
        }
    }
    if (folder) {
        closedir(folder);
    }
}

// A line of a dictionary is a word in quotes, with \xNN for a byte.
static void read_words(const char *path)
{
    FILE *const file = fopen(path, "r");
    char line[MOST_BYTES];
    while (file && fgets(line, sizeof line, file)) {
        uint8_t word[MOST_BYTES];
        size_t length = 0;
        char *at = strchr(line, '"');
        while (at && *++at && *at != '"') {
            unsigned byte = (unsigned char)*at;
            if (sscanf(at, "\\x%2x", &byte) == 1) {
                at += 3;
            }
            word[length++] = (uint8_t)byte;
        }
        if (length) {
            keep(words, &words_count, MOST_WORDS, word, length);
        }
    }
    if (file) {
        fclose(file);
    }
}

// Sanitizers stop as the target does, by a signal at which the input is kept.
const char *__asan_default_options(void)
{
    return "abort_on_error=1";
}

const char *__ubsan_default_options(void)
{
    return "abort_on_error=1";
}

static void write_crash(void)
{
    char name[MOST_BYTES];
    snprintf(name, sizeof name, "%scrash", prefix);
    FILE *const file = fopen(name, "wb");
    if (file) {
        fwrite(present, 1, present_size, file);
        fclose(file);
        fprintf(stderr, "the input is in %s\n", name);
    }
}

static void on_abort(int number)
{
    write_crash();
    signal(number, SIG_DFL);
    raise(number);
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// Return the value of an option, or NULL where the argument is another.
static const char *value(const char *argument, const char *option)
{
    const size_t length = strlen(option);
    return strncmp(argument, option, length) ? NULL : argument + length;
}

static void take(const char *argument)
{
    const char *found;
    if ((found = value(argument, "-runs="))) {
        runs = strtoul(found, NULL, 10);
    } else if ((found = value(argument, "-max_total_time="))) {
        longest = atof(found);
    } else if ((found = value(argument, "-seed="))) {
        random_state = 2 * strtoull(found, NULL, 10) + 1;
    } else if ((found = value(argument, "-max_len="))) {
        most_bytes = strtoul(found, NULL, 10);
        most_bytes = most_bytes < MOST_BYTES ? most_bytes : MOST_BYTES;
    } else if ((found = value(argument, "-artifact_prefix="))) {
        prefix = found;
    } else if ((found = value(argument, "-dict="))) {
        read_words(found);
    }
}

int main(int count, char **arguments)
{
    for (int i = 1; i < count; i++) {
        struct stat about;
        take(arguments[i]);
        if (arguments[i][0] != '-' && stat(arguments[i], &about) == 0 && S_ISREG(about.st_mode)) {
            return read_input(arguments[i]) ? run(), 0 : 1;
        }
    }
    signal(SIGABRT, on_abort);
    for (int i = 1; i < count; i++) {
        if (arguments[i][0] != '-') {
            read_folder(arguments[i]);
        }
    }
    if (!inputs_count) {
        keep(inputs, &inputs_count, MOST_INPUTS, present, 0);
    }
    const double start = seconds();
    unsigned long done = 0;
    while (done < runs && (!longest || done % RUNS_BETWEEN_LOOKS
                           || seconds() - start < longest)) {
        const struct input *const chosen = choose();
        memcpy(present, chosen->data, chosen->size);
        present_size = LLVMFuzzerCustomMutator(present, chosen->size, most_bytes,
                                               (unsigned)below(1U << 31));
        run();
        done++;
        if (is_new()) {
            keep(inputs, &inputs_count, MOST_INPUTS, present, present_size);
        }
    }
    unsigned reached = 0;
    for (size_t i = 0; i < PAIRS; i++) {
        reached += seen[i] != 0;
    }
    printf("inputs: %lu, a second of the processor: %.0f, kept: %u, pairs of blocks: %u of %u\n",
           done, (double)done * CLOCKS_PER_SEC / (double)clock(), inputs_count, reached, PAIRS);
    return 0;
}
