/* A P loop on a rig behind a wire, after the page on the link (docs/wire.md), in C99 with POSIX sockets.
 *
 *     jackbench serve jack-10t --lockstep --out out/serve      # prints udp://127.0.0.1:PORT
 *     cc -std=c99 p_loop.c -o p_loop && ./p_loop 127.0.0.1 PORT
 *
 * For a machine whose numbers are little-endian. It finds "position" by counting names; a program for all laws and rigs,
 * which reads the hello as JSON, is the link_main.c that `jackbench coefficients EXPERIMENT --out DIR` leaves. */
#define _POSIX_C_SOURCE 200112L
#include <arpa/inet.h>
#include <poll.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

enum { HELLO, RIG, COMMAND, READING, SWITCH, STATE, HEAD = 7, TRIPPED = 2 };
static const double gain = 0.3, step = 0.01, seconds = 1.0; /* 1/m, m, s */
static int line, lockstep;
static char packet[65536];
static volatile sig_atomic_t ended;

static void stop(int number)
{
    ended = number;
}

/* Send a datagram, again where nothing comes, until the answer is there: of a reading that of a sequence number. */
static const char *ask(int kind, const void *body, size_t bytes, int wanted, uint32_t sequence)
{
    char out[64] = "JBRIG\x01";
    out[6] = (char)kind;
    memcpy(out + HEAD, body, bytes);
    for (int i = 0; i < 20; i++) {
        struct pollfd ready = {line, POLLIN, 0};
        if (send(line, out, HEAD + bytes, 0) < 0)
            continue;
        while (poll(&ready, 1, 200) > 0) {
            const ssize_t n = recv(line, packet, sizeof packet - 1, 0);
            uint32_t applied = 0;
            if (n < HEAD || memcmp(packet, "JBRIG\x01", 6) || packet[6] != wanted)
                continue;
            packet[n] = 0;
            if (wanted == READING)
                memcpy(&applied, packet + HEAD + 1, 4);
            if (wanted != READING || !lockstep || applied == sequence)
                return packet + HEAD;
        }
    }
    send(line, "JBRIG\x01\x04", HEAD + 1, 0); /* off, should it hear that: a string ends with a 0 */
    fputs("the rig does not answer\n", stderr);
    exit(1);
}

int main(int words, char **word)
{
    struct sockaddr_in rig = {0};
    rig.sin_family = AF_INET;
    rig.sin_port = htons((uint16_t)(words > 2 ? atoi(word[2]) : 0));
    line = socket(AF_INET, SOCK_DGRAM, 0);
    if (words < 3 || inet_pton(AF_INET, word[1], &rig.sin_addr) != 1 || connect(line, (void *)&rig, sizeof rig))
        return fputs("usage: p_loop HOST PORT\n", stderr), 2;

    const char *hello = ask(HELLO, "", 0, RIG, 0), *period = strstr(hello, "\"period_s\":");
    const char *name = strstr(hello, "\"channels\":"), *position = name ? strstr(name, "\"position\"") : NULL;
    if (!period || !position)
        return fputs("the rig has no position\n", stderr), 1;
    size_t place = 0;
    while ((name = strstr(name + 1, "\"name\":")) && strstr(name, "\"position\"") > name + 8)
        place++;
    const uint32_t samples = (uint32_t)(seconds / atof(period + 11) + 0.5);
    lockstep = strstr(hello, "\"lockstep\"") != NULL;

    struct sigaction ending = {0};
    ending.sa_handler = stop; /* Ctrl-C, a kill, a closed terminal end the loop, and the rig is switched off */
    sigaction(SIGINT, &ending, NULL);
    sigaction(SIGTERM, &ending, NULL);
    sigaction(SIGHUP, &ending, NULL);

    const char *body = ask(SWITCH, "\1", 1, READING, 0);
    double y, start;
    memcpy(&start, body + 13 + 8 * place, 8);
    y = start;
    for (uint32_t k = 1; k <= samples && !(body[0] & TRIPPED) && !ended; k++) {
        const double command = gain * (start + step - y);
        char out[12];
        memcpy(out, &k, 4);
        memcpy(out + 4, &command, 8);
        body = ask(COMMAND, out, 12, READING, k);
        memcpy(&y, body + 13 + 8 * place, 8);
    }
    const int tripped = body[0] & TRIPPED;
    ask(SWITCH, "\0", 1, STATE, 0);
    if (ended)
        return fputs("interrupted\n", stderr), 1;
    printf("moved %.3f of %g mm in %g s", 1e3 * (y - start), 1e3 * step, seconds);
    if (y - start < 0.98 * step)
        printf("; it is on its way, as a gain of %g 1/m is small: raise it to be sooner", gain);
    putchar('\n');
    return tripped != 0;
}
