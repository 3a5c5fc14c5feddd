/* safepair: cells for drive firmware in any language.
 *
 * A producer opens the domain of a running set once, before its cycle starts, publishes what it
 * latched in every cycle, and reads what the channels drive and ask. Publishing and reading
 * allocate nothing, lock nothing and call the system not at all; opening does all three.
 *
 * Each cell has one writer in the whole set: say with `publish` which ones this process writes.
 * One domain belongs to one thread at a time. What every field means is written in shm-schema
 * (encoder.rs, io.rs, inhibit.rs, command.rs, drive.rs, answer.rs).
 */
#ifndef SAFEPAIR_H
#define SAFEPAIR_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#define SAFEPAIR_ASSERT static_assert
#else
#define SAFEPAIR_ASSERT _Static_assert
#endif

/* Results. */
#define SAFEPAIR_OK 0
#define SAFEPAIR_ARGUMENT (-1) /* a null pointer, a text that is no UTF-8, a value out of range */
#define SAFEPAIR_AXIS (-2)     /* an axis that was not opened, or a cell this process does not write */
#define SAFEPAIR_OPEN (-3)     /* no such domain, another layout, or another writer */
#define SAFEPAIR_DEADLINE (-4) /* the domain did not open within two seconds */
#define SAFEPAIR_NOTHING (-5)  /* nobody has written yet, or what stands there is damaged */
#define SAFEPAIR_INTERNAL (-6) /* a defect of this library; nothing was published */

/* Cells to write, to be joined with |. */
#define SAFEPAIR_ENCODER 1u
#define SAFEPAIR_IO 2u
#define SAFEPAIR_READBACK 4u
#define SAFEPAIR_COMMAND 8u

/* Channels. */
#define SAFEPAIR_A 0
#define SAFEPAIR_B 1

/* Kinds of an encoder slot. */
#define SAFEPAIR_SLOT_NONE 0
#define SAFEPAIR_SLOT_RESOLVER 1
#define SAFEPAIR_SLOT_SINE_COSINE 2
#define SAFEPAIR_SLOT_DIGITAL 3
#define SAFEPAIR_SLOT_COUNTER 4
#define SAFEPAIR_SLOT_ENCODERLESS 5

typedef struct safepair_domain safepair_domain;

typedef struct {
    uint8_t kind;
    uint8_t status; /* 0: the acquisition hardware reports no fault */
    int16_t sine;   /* nominal amplitude 16384 */
    int16_t cosine;
    uint16_t reserved;
    int32_t count; /* quarter periods, wraps */
    int32_t reserved_2;
    int64_t digital; /* 1/65536 revolution */
} safepair_slot;

typedef struct {
    safepair_slot slots[2];
    int64_t drive_position; /* 1/65536 revolution */
    int32_t frequency_mhz;
    int32_t torque_ppm;
    uint32_t period_ns;
    uint32_t reserved;
} safepair_encoder;

typedef struct {
    uint64_t samples; /* of 62.5 us, since power-up */
    uint64_t line_1[4]; /* bit 0 is the newest sample */
    uint64_t line_2[4];
    uint64_t ais;
    uint64_t aie;
    uint64_t output_readback[4];
    uint64_t dynamic_readback[2];
} safepair_io;

typedef struct {
    uint8_t path_a; /* 0 or 1 */
    uint8_t path_b;
    uint8_t reserved[6];
    uint64_t edges_a;
    uint64_t edges_b;
} safepair_readback;

typedef struct {
    uint8_t source; /* 0 none, 2 FSoE, 3 PROFIsafe, 4 PROFIsafe parameters */
    uint8_t clear_error;
    uint8_t drive_n0;
    uint8_t drive_enabled;
    uint32_t frame_number;
    uint64_t frame_exchange;
    uint16_t frame_length;
    uint8_t reserved[6];
    uint8_t frame[256];
} safepair_command;

typedef struct {
    uint8_t permit;
    uint8_t reserved[7];
    uint64_t edges;
    uint64_t outputs[3];
} safepair_inhibit;

typedef struct {
    uint8_t brake;
    uint8_t limit_set_point;
    uint8_t brake_open;
    uint8_t outputs;
    uint32_t deceleration_rpm_s;
    int32_t set_point_max_mrpm;
    int32_t set_point_min_mrpm;
} safepair_drive_request;

typedef struct {
    uint32_t frame_number; /* 0: unsolicited */
    uint32_t digest;
    uint32_t number;
    uint16_t frame_length;
    uint8_t reserved[2];
    uint8_t frame[256];
} safepair_answer;

SAFEPAIR_ASSERT(sizeof(safepair_slot) == 24, "layout");
SAFEPAIR_ASSERT(sizeof(safepair_encoder) == 72, "layout");
SAFEPAIR_ASSERT(sizeof(safepair_io) == 136, "layout");
SAFEPAIR_ASSERT(sizeof(safepair_readback) == 24, "layout");
SAFEPAIR_ASSERT(sizeof(safepair_command) == 280, "layout");
SAFEPAIR_ASSERT(sizeof(safepair_inhibit) == 40, "layout");
SAFEPAIR_ASSERT(sizeof(safepair_drive_request) == 16, "layout");
SAFEPAIR_ASSERT(sizeof(safepair_answer) == 272, "layout");

/* Joins the domain of a running set: the values of --domain, --prefix, --nonce and the axes.
 * On success *out is to be closed with safepair_close; else *out is null. */
int safepair_open(const char *domain, const char *prefix, uint32_t nonce, const uint8_t *axes,
                  size_t axes_count, uint32_t publish, safepair_domain **out);
/* Leaves it. Null is allowed. */
void safepair_close(safepair_domain *domain);
/* CLOCK_MONOTONIC, ns. */
uint64_t safepair_now_ns(void);
/* What a result means; never null. */
const char *safepair_text(int result);

/* Publishes one cell. `latched_ns`: when the signals were latched; `cycles`: cycles of the
 * producer since its update before, 1 when none was missed. */
int safepair_publish_encoder(safepair_domain *domain, uint8_t axis, const safepair_encoder *value,
                             uint64_t latched_ns, uint64_t cycles);
int safepair_publish_io(safepair_domain *domain, uint8_t axis, const safepair_io *value,
                        uint64_t latched_ns, uint64_t cycles);
int safepair_publish_readback(safepair_domain *domain, uint8_t axis, const safepair_readback *value,
                              uint64_t latched_ns, uint64_t cycles);
int safepair_publish_command(safepair_domain *domain, uint8_t axis, const safepair_command *value,
                             uint64_t latched_ns, uint64_t cycles);

/* Reads one cell; `written_ns` (may be null) gets the time stamp of its writer. What is older than
 * three cycles is no information: to judge the age is the caller's. */
int safepair_read_inhibit(const safepair_domain *domain, uint8_t axis, int channel,
                          safepair_inhibit *value, uint64_t *written_ns);
int safepair_read_drive_request(const safepair_domain *domain, uint8_t axis,
                                safepair_drive_request *value, uint64_t *written_ns);
int safepair_read_answer(const safepair_domain *domain, uint8_t axis, int channel,
                         safepair_answer *value, uint64_t *written_ns);

#ifdef __cplusplus
}
#endif
#endif
