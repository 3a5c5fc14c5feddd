/*
 * How a fieldbus stack hands its process image to safepair: one call in each bus cycle.
 *
 *     cc -std=c11 -Wall -Wextra -o process_image process_image.c
 *     process_image 127.0.0.1 34980 0 11 0 27 < cycles.txt
 *
 * Arguments: gateway, offset and length of the frame in the outputs (master to device), offset and
 * length in the inputs (device to master). Standard input stands in for the stack: one output
 * image a line, hexadecimal, a line a bus cycle; standard output shows the input image after each.
 */
#define _POSIX_C_SOURCE 200809L

#include <arpa/inet.h>
#include <netinet/in.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

enum { IMAGE_MAX = 1500, FRAME_MAX = 256 };

/* A safety device in the process image of a fieldbus. */
struct device {
    int socket;
    size_t out_at, out_length, in_at, in_length;
    uint8_t last[FRAME_MAX];
    int sent;
};

/* Carries the frame of one bus cycle, as it is: a new one there, an answer back. */
static int device_cycle(struct device *device, const uint8_t *outputs, uint8_t *inputs)
{
    const uint8_t *frame = outputs + device->out_at;
    int is_new = !device->sent || memcmp(frame, device->last, device->out_length) != 0;
    if (is_new) {
        if (send(device->socket, frame, device->out_length, 0) < 0)
            return -1;
        memcpy(device->last, frame, device->out_length);
        device->sent = 1;
    }
    uint8_t answer[FRAME_MAX + 1];
    ssize_t length = recv(device->socket, answer, sizeof answer, 0);
    /* Another length is no frame of this device; no answer leaves the image as it was. */
    if (length >= 0 && (size_t)length == device->in_length)
        memcpy(inputs + device->in_at, answer, device->in_length);
    return 0;
}

static int connect_to(const char *host, const char *port)
{
    struct sockaddr_in address = { .sin_family = AF_INET, .sin_port = htons((uint16_t)atoi(port)) };
    if (inet_pton(AF_INET, host, &address.sin_addr) != 1)
        return -1;
    int handle = socket(AF_INET, SOCK_DGRAM, 0);
    /* A stack with a cycle of its own does not wait. */
    struct timeval wait = { .tv_usec = 100000 };
    if (handle < 0 || setsockopt(handle, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait) < 0)
        return -1;
    return connect(handle, (const struct sockaddr *)&address, sizeof address) < 0 ? -1 : handle;
}

int main(int count, char **arguments)
{
    struct device device = { 0 };
    uint8_t outputs[IMAGE_MAX] = { 0 }, inputs[IMAGE_MAX] = { 0 };
    char line[2 * IMAGE_MAX + 2];
    if (count != 7) {
        fprintf(stderr, "process_image HOST PORT OUT_OFFSET OUT_LENGTH IN_OFFSET IN_LENGTH\n");
        return 2;
    }
    device.out_at = strtoul(arguments[3], NULL, 10);
    device.out_length = strtoul(arguments[4], NULL, 10);
    device.in_at = strtoul(arguments[5], NULL, 10);
    device.in_length = strtoul(arguments[6], NULL, 10);
    if (device.out_length > FRAME_MAX || device.in_length > FRAME_MAX
        || device.out_at > IMAGE_MAX - FRAME_MAX || device.in_at > IMAGE_MAX - FRAME_MAX) {
        fprintf(stderr, "a frame has at most %d octets and lies in an image of %d\n", FRAME_MAX, IMAGE_MAX);
        return 2;
    }
    device.socket = connect_to(arguments[1], arguments[2]);
    if (device.socket < 0) {
        perror(arguments[1]);
        return 1;
    }
    while (fgets(line, sizeof line, stdin) != NULL) {
        for (size_t at = 0; at < IMAGE_MAX && sscanf(line + 2 * at, "%2hhx", &outputs[at]) == 1; at++)
            ;
        if (device_cycle(&device, outputs, inputs) < 0) {
            perror(arguments[1]);
            return 1;
        }
        for (size_t at = 0; at < device.in_at + device.in_length; at++)
            printf("%02x", inputs[at]);
        putchar('\n');
        fflush(stdout);
    }
    close(device.socket);
    return 0;
}
