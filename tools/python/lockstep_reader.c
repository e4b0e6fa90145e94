/* An event-driven controller without an interpreter: it waits in poll(), and decides on every message in the order it hears them.
 *
 *     lockstep_reader LOG [can=PORT] [out=PORT] NAME=PORT ...
 *
 * All on 127.0.0.1. Names that begin with `lms` are CoLa A scanners; anything else sends lines. To `out` a line goes for every scan of `lms1`. */
#include <arpa/inet.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define MOST 8
#define ROOM (1 << 20)

static struct { char name[16]; char *buffer; size_t held; char end; } stream[MOST];
static struct pollfd polled[MOST];

static int dial(int port) {
    struct sockaddr_in to = { .sin_family = AF_INET, .sin_port = htons((uint16_t)port), .sin_addr.s_addr = htonl(INADDR_LOOPBACK) };
    int at = socket(AF_INET, SOCK_STREAM, 0);
    return at >= 0 && connect(at, (struct sockaddr *)&to, sizeof to) == 0 ? at : -1;
}

static uint32_t checksum(const char *text, size_t length) {
    uint32_t sum = 2166136261u;
    while (length--) sum = (sum ^ (unsigned char)*text++) * 16777619u;
    return sum;
}

int main(int count, char **words) {
    int streams = 0, out = -1;
    if (count < 3) return 2;
    FILE *log = fopen(words[1], "w");
    if (!log) return 2;
    for (int n = 2; n < count; n++) {
        char *port = strchr(words[n], '=');
        if (!port || streams == MOST) return 2;
        *port++ = 0;
        int at = dial(atoi(port));
        if (at < 0) return 2;
        if (!strcmp(words[n], "out")) { out = at; continue; }
        int scans = !strncmp(words[n], "lms", 3);
        snprintf(stream[streams].name, sizeof stream[streams].name, "%s", words[n]);
        stream[streams].buffer = malloc(ROOM);
        stream[streams].end = scans ? 3 : '\n';
        if (scans && write(at, "\x02sEN LMDscandata 1\x03", 19) != 19) return 2;
        polled[streams++] = (struct pollfd){ .fd = at, .events = POLLIN };
    }
    while (poll(polled, (nfds_t)streams, -1) > 0) {
        for (int n = 0; n < streams; n++) {
            if (!polled[n].revents) continue;
            char *buffer = stream[n].buffer, *from = buffer, *end;
            ssize_t got = read(polled[n].fd, buffer + stream[n].held, ROOM - stream[n].held);
            if (got <= 0) return 0;
            stream[n].held += (size_t)got;
            while ((end = memchr(from, stream[n].end, stream[n].held - (size_t)(from - buffer)))) {
                size_t length = (size_t)(end - from);
                if (stream[n].end != 3 || (length > 100 && !memcmp(from, "\x02sSN", 4))) {
                    uint32_t sum = checksum(from, length);
                    fprintf(log, "%s %zu %08x\n", stream[n].name, length, sum);
                    fflush(log);
                    if (out >= 0 && !strcmp(stream[n].name, "lms1") && dprintf(out, "%08x\n", sum) < 0) return 0;
                }
                from = end + 1;
            }
            stream[n].held -= (size_t)(from - buffer);
            memmove(buffer, from, stream[n].held);
        }
    }
    return 0;
}
