/* Acknowledges the steps of `rowscan emulate --clock lockstep --ack reply:127.0.0.1:PORT`.
 *
 *     int steps = ack_connect(4000);
 *     while (ack_wait(steps, &number, &time_ns) == 0) {    step `number` is out
 *         work_in_what_has_arrived();                      read what is there on every stream
 *         ack_send(steps, number);                         the next step comes only after that
 *     }
 */
#include <arpa/inet.h>
#include <stdint.h>
#include <stdio.h>
#include <unistd.h>

int ack_connect(uint16_t port)
{
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons(port), .sin_addr = {htonl(INADDR_LOOPBACK)}};
    int steps = socket(AF_INET, SOCK_STREAM, 0);
    return steps >= 0 && connect(steps, (struct sockaddr *)&at, sizeof at) == 0 ? steps : -1;
}

int ack_wait(int steps, unsigned long long *number, unsigned long long *time_ns)
{
    char line[64];
    for (size_t n = 0; n + 1 < sizeof line && read(steps, line + n, 1) == 1; n++)
        if (line[n] == '\n')
            return line[n] = 0, sscanf(line, "STEP %llu %llu", number, time_ns) == 2 ? 0 : -1;
    return -1;
}

int ack_send(int steps, unsigned long long number)
{
    return dprintf(steps, "ACK %llu\n", number) > 0 ? 0 : -1;
}
