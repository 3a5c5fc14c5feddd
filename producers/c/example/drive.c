/* A drive firmware of a few lines: one axis with a sine/cosine encoder at rest, both evaluators,
 * a hundred cycles of 1 ms. Build and run (docs of the header say what the arguments are):
 *
 *   cc -I producers/c/include producers/c/example/drive.c target/release/libsafepair.a \
 *      -lpthread -ldl -lm -o drive
 *   ./drive DOMAIN PREFIX NONCE AXIS
 */
#define _POSIX_C_SOURCE 200809L
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "safepair.h"

#define CYCLE_NS 1000000u
#define MISSING_EDGES 3

/* One path as its evaluator has it: on while edges come, off at once without permission. */
struct path {
    uint64_t edges;
    int missing;
    int on;
};

static void evaluate(struct path *path, const safepair_domain *domain, uint8_t axis, int channel)
{
    safepair_inhibit driven = {0};
    /* A cell that cannot be read drives nothing. */
    (void)safepair_read_inhibit(domain, axis, channel, &driven, NULL);
    if (driven.edges != path->edges) {
        path->edges = driven.edges;
        path->missing = 0;
        path->on = 1;
    } else if (path->missing < MISSING_EDGES) {
        path->missing++;
    }
    path->on = path->on && path->missing < MISSING_EDGES && driven.permit == 1;
}

static int must(int result, const char *what)
{
    if (result != SAFEPAIR_OK) {
        fprintf(stderr, "%s: %s\n", what, safepair_text(result));
    }
    return result;
}

static int cycle(safepair_domain *domain, uint8_t axis, struct path paths[2], uint64_t now_ns,
                 uint64_t number)
{
    safepair_encoder encoder = {0};
    safepair_io io = {0};
    safepair_readback readback = {0};
    int pair;

    evaluate(&paths[SAFEPAIR_A], domain, axis, SAFEPAIR_A);
    evaluate(&paths[SAFEPAIR_B], domain, axis, SAFEPAIR_B);
    readback.path_a = (uint8_t)paths[SAFEPAIR_A].on;
    readback.path_b = (uint8_t)paths[SAFEPAIR_B].on;
    readback.edges_a = paths[SAFEPAIR_A].edges;
    readback.edges_b = paths[SAFEPAIR_B].edges;

    encoder.slots[0].kind = SAFEPAIR_SLOT_SINE_COSINE;
    encoder.slots[0].cosine = 16384;
    encoder.slots[1] = encoder.slots[0];
    encoder.period_ns = CYCLE_NS;

    io.samples = number * (CYCLE_NS / 62500u);
    for (pair = 0; pair < 4; pair++) {
        io.line_1[pair] = UINT64_MAX;
        io.line_2[pair] = UINT64_MAX;
    }

    return must(safepair_publish_readback(domain, axis, &readback, now_ns, 1), "readback") ||
           must(safepair_publish_encoder(domain, axis, &encoder, now_ns, 1), "encoder") ||
           must(safepair_publish_io(domain, axis, &io, now_ns, 1), "io");
}

int main(int count, char **words)
{
    struct path paths[2] = {{0}};
    safepair_domain *domain = NULL;
    struct timespec pause = {0, CYCLE_NS};
    uint64_t number;
    uint8_t axis;

    if (count != 5) {
        fprintf(stderr, "drive: expected DOMAIN PREFIX NONCE AXIS\n");
        return 2;
    }
    axis = (uint8_t)strtoul(words[4], NULL, 10);
    if (must(safepair_open(words[1], words[2], (uint32_t)strtoul(words[3], NULL, 10), &axis, 1,
                           SAFEPAIR_ENCODER | SAFEPAIR_IO | SAFEPAIR_READBACK, &domain), "open")) {
        return 3;
    }
    for (number = 1; number <= 100; number++) {
        if (cycle(domain, axis, paths, safepair_now_ns(), number)) {
            return 1;
        }
        nanosleep(&pause, NULL);
    }
    printf("paths %d %d edges %" PRIu64 " %" PRIu64 "\n", paths[0].on, paths[1].on, paths[0].edges,
           paths[1].edges);
    safepair_close(domain);
    return 0;
}
