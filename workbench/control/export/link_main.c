/* Runs an exported law at the link: greets a rig, finds the law's signals among its channels, switches it on, starts
 * without a bump where it stands, plays a step and prints a line of CSV for each sample.
 *
 *     cc -std=c99 -O2 *.c -lm -o link_main
 *     ./link_main NAME udp://HOST:PORT SIZE SECONDS [TOKEN]
 *
 * SIZE is in the SI unit of the controlled signal; the step comes after a tenth of the SECONDS. Status 0: played to the
 * end; 1: the rig refused, tripped or fell silent; 2: wrong words. Ctrl-C, SIGTERM and SIGHUP switch the rig off.
 * POSIX sockets; Windows has winsock2.h in their place, with WSAStartup, WSAPoll and closesocket. */
#define _POSIX_C_SOURCE 200112L
#include <math.h>
#include <netdb.h>
#include <poll.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include "link_laws.h"

enum { HELLO, RIG, COMMAND, READING, SWITCH, STATE, REFUSAL };
enum { OFF, ON, RESET };
enum { TRIPPED = 2 }; /* of a reading's status */
enum { HEAD = 7, TRIES = 20, ROOM = 65536 };

static const char magic[] = "JBRIG\x01";
static unsigned char packet[ROOM + 1]; /* the last datagram, its body of `length` bytes ended by a 0 */
static size_t length;
static int line, patience = 100; /* ms until what is lost is asked for again */
static double lowest, highest; /* of the command, as the hello says */
static volatile sig_atomic_t stopped;

static struct {
    unsigned status;
    uint32_t sequence;
    uint64_t tick;
    size_t channels;
    double value[ROOM / 8];
} reading;

static void fail(const char *what, ...)
{
    va_list words;
    va_start(words, what);
    fputs("link_main: ", stderr);
    vfprintf(stderr, what, words);
    fputc('\n', stderr);
    va_end(words);
    exit(1);
}

static void stop(int number)
{
    (void)number;
    stopped = 1;
}

/* Little-endian numbers, whatever this machine has. */
static void put(unsigned char *at, uint64_t value, int bytes)
{
    for (int i = 0; i < bytes; i++)
        at[i] = (unsigned char)(value >> 8 * i);
}

static uint64_t number(const unsigned char *at, int bytes)
{
    uint64_t value = 0;
    while (bytes--)
        value = value << 8 | at[bytes];
    return value;
}

static void transmit(int kind, const void *body, size_t bytes)
{
    unsigned char out[512];
    memcpy(out, magic, HEAD - 1);
    out[HEAD - 1] = (unsigned char)kind;
    memcpy(out + HEAD, body, bytes);
    if (send(line, out, HEAD + bytes, 0) < 0)
        return; /* as if it were lost on the way */
}

/* The kind of the next datagram of the link within so many ms; -1 for none. */
static int received(int ms)
{
    struct pollfd ready = {line, POLLIN, 0};
    while (poll(&ready, 1, ms) > 0) {
        const ssize_t bytes = recv(line, packet, ROOM, 0);
        if (bytes >= HEAD && !memcmp(packet, magic, HEAD - 1)) {
            length = (size_t)bytes - HEAD;
            packet[bytes] = 0;
            return packet[HEAD - 1];
        }
    }
    return -1;
}

static const char *text(void)
{
    return (const char *)packet + HEAD;
}

/* Ask until the answer is there; whether it came. */
static int asked(int kind, const void *body, size_t bytes, int answer)
{
    for (int i = 0; i < TRIES; i++) {
        int got;
        transmit(kind, body, bytes);
        while ((got = received(patience)) >= 0) {
            if (got == answer)
                return 1;
            if (got == REFUSAL && kind == HELLO)
                fail("the rig refuses: %s", text());
        }
    }
    return 0;
}

static int switched(int to)
{
    const unsigned char body = (unsigned char)to;
    return asked(SWITCH, &body, 1, STATE);
}

static void switch_off(void)
{
    switched(OFF);
}

/* Keep the reading that came. */
static void take(void)
{
    const unsigned char *body = packet + HEAD;
    if (length < 13)
        return;
    reading.status = body[0];
    reading.sequence = (uint32_t)number(body + 1, 4);
    reading.tick = number(body + 5, 8);
    reading.channels = (length - 13) / 8;
    for (size_t i = 0; i < reading.channels; i++) {
        const uint64_t bits = number(body + 13 + 8 * i, 8);
        memcpy(&reading.value[i], &bits, 8);
    }
}

/* The next reading after what was sent: in lockstep that of this sequence number, in real time the newest. */
static void next_reading(int kind, const void *body, size_t bytes, uint32_t sequence, int lockstep)
{
    for (int i = 0; i < TRIES && !stopped; i++) {
        int got;
        transmit(kind, body, bytes);
        while ((got = received(patience)) >= 0) {
            if (got != READING)
                continue;
            take();
            if (lockstep && reading.sequence != sequence)
                continue;
            while (!lockstep && (got = received(0)) >= 0)
                if (got == READING)
                    take();
            return;
        }
    }
    if (!stopped)
        fail("no reading comes any more");
}

/* JSON, as far as a hello goes: behind a text, and behind any value. */
static const char *past_text(const char *s)
{
    for (s++; *s && *s != '"'; s++)
        if (*s == '\\' && s[1])
            s++;
    return *s ? s + 1 : s;
}

static const char *past_value(const char *s)
{
    int depth = 0;
    do {
        s += strspn(s, " \t\r\n,:");
        depth += *s == '{' || *s == '[';
        depth -= *s == '}' || *s == ']';
        if (*s == '"')
            s = past_text(s);
        else
            s += *s && strchr("{}[]", *s) ? 1 : strcspn(s, "{}[]\",: \t\r\n");
    } while (depth > 0 && *s);
    return s;
}

/* Whether a value is this text. */
static int is(const char *value, const char *word)
{
    const size_t n = strlen(word);
    return *value == '"' && !strncmp(value + 1, word, n) && value[n + 1] == '"';
}

/* The value of a key of an object; an empty text where it has no such key. */
static const char *member(const char *object, const char *key)
{
    const char *s = object + (*object == '{');
    for (;;) {
        s += strspn(s, " \t\r\n,");
        if (*s != '"')
            return "";
        const char *value = past_text(s);
        value += strspn(value, " \t\r\n:");
        if (is(s, key))
            return value;
        s = past_value(value);
    }
}

/* How many objects a list has before the one of this name; all of them where none is. */
static int place(const char *list, const char *name, int *found)
{
    const char *s = list + (*list == '[');
    int k = 0;
    for (*found = 0;; k++) {
        s += strspn(s, " \t\r\n,");
        *found = *s == '{' && is(member(s, "name"), name);
        if (*s != '{' || *found)
            return k;
        s = past_value(s);
    }
}

static void connect_to(const char *at)
{
    char host[256], port[6];
    struct addrinfo wanted = {0}, *found;
    if (sscanf(at, "udp://%255[^:]:%5[0-9]", host, port) != 2) {
        fprintf(stderr, "link_main: %s: write udp://HOST:PORT\n", at);
        exit(2);
    }
    wanted.ai_family = AF_INET;
    wanted.ai_socktype = SOCK_DGRAM;
    if (getaddrinfo(host, port, &wanted, &found))
        fail("%s: no such host", at);
    line = socket(found->ai_family, found->ai_socktype, 0);
    if (line < 0 || connect(line, found->ai_addr, found->ai_addrlen))
        fail("%s: cannot be reached", at);
    freeaddrinfo(found);
}

/* Say hello; whether the rig is in lockstep, and where the law's signals are among its channels. */
static int greet(const struct law *law, const char *token, int *places)
{
    int found;
    if (!asked(HELLO, token, strlen(token), RIG))
        fail("no rig answers there");
    const char *hello = text(), *channels = member(hello, "channels");
    const double period = strtod(member(hello, "period_s"), NULL);
    if (!(fabs(period - law->period) <= 1e-9 * law->period))
        fail("the rig's period is %g s, that of %s is %g s; export it for this rate", period, law->name, law->period);
    const char *commands = member(hello, "commands");
    if (place(commands, "", &found) != 1)
        fail("the rig has not one command");
    lowest = strtod(member(commands + 1, "low"), NULL);
    highest = strtod(member(commands + 1, "high"), NULL);
    for (int i = 0; i < law->signals; i++) {
        places[i] = place(channels, law->signal[i], &found);
        if (!found)
            fail("the rig has no channel %s, which %s measures", law->signal[i], law->name);
    }
    patience += (int)(10 * period * 1000);
    const int lockstep = is(member(hello, "mode"), "lockstep");
    if (is(member(hello, "state"), "tripped") && !switched(RESET))
        fail("the rig cannot be reset");
    return lockstep;
}

/* What the drive does of a command after the last one: the hello's range, and no faster than it can. */
static double limited(double command, double last, double fastest)
{
    const double within = fmin(fmax(command, lowest), highest);
    return last + fmin(fmax(within - last, -fastest), fastest);
}

static void play(const struct law *law, const int *places, int lockstep, double size, double seconds)
{
    const uint64_t samples = (uint64_t)(seconds / law->period + 0.5);
    const unsigned char on = ON;
    unsigned char body[12];
    double y[MOST_SIGNALS], reference[FURTHEST + 1], first = 0.0, sent = 0.0;
    uint32_t sequence = 0;
    next_reading(SWITCH, &on, 1, 0, lockstep);
    printf("tick,reference");
    for (int i = 0; i < law->signals; i++)
        printf(",%s", law->signal[i]);
    puts(",command");
    while (!stopped && reading.tick < samples) {
        if (reading.status & TRIPPED)
            fail("the rig tripped at tick %llu", (unsigned long long)reading.tick);
        for (int i = 0; i < law->signals; i++) {
            if ((size_t)places[i] >= reading.channels)
                fail("a reading has %d channels, the hello had more", (int)reading.channels);
            y[i] = reading.value[places[i]];
        }
        if (sequence == 0) {
            first = y[0];
            law->start(0.0, y); /* the drive of a rig that was off does nothing */
        }
        for (int i = 0; i <= law->ahead; i++) {
            const uint64_t at = reading.tick + (uint64_t)i < samples ? reading.tick + (uint64_t)i : samples - 1;
            reference[i] = at < samples / 10 ? first : first + size;
        }
        const double command = law->step(reference, y);
        sent = limited(command, sent, law->fastest);
        law->realised(sent);
        printf("%llu,%.17g", (unsigned long long)reading.tick, reference[0]);
        for (int i = 0; i < law->signals; i++)
            printf(",%.17g", y[i]);
        printf(",%.17g\n", command);
        uint64_t bits;
        memcpy(&bits, &sent, 8);
        put(body, ++sequence, 4);
        put(body + 4, bits, 8);
        next_reading(COMMAND, body, 12, sequence, lockstep);
    }
}

int main(int words, char **word)
{
    const int laws_known = (int)(sizeof laws / sizeof *laws);
    int k = 0, places[MOST_SIGNALS];
    while (words > 1 && k < laws_known && strcmp(laws[k].name, word[1]))
        k++;
    if (words < 5 || words > 6 || k == laws_known) {
        fputs("usage: link_main NAME udp://HOST:PORT SIZE SECONDS [TOKEN]\nNAME:", stderr);
        for (k = 0; k < laws_known; k++)
            fprintf(stderr, " %s", laws[k].name);
        fputc('\n', stderr);
        return 2;
    }
    struct sigaction ending = {0};
    ending.sa_handler = stop; /* without SA_RESTART: a wait ends, too */
    sigaction(SIGINT, &ending, NULL);
    sigaction(SIGTERM, &ending, NULL);
    sigaction(SIGHUP, &ending, NULL); /* of a terminal that is closed */
    connect_to(word[2]);
    const int lockstep = greet(&laws[k], words > 5 ? word[5] : "", places);
    atexit(switch_off);
    play(&laws[k], places, lockstep, strtod(word[3], NULL), strtod(word[4], NULL));
    return 0;
}
