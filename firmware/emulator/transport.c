// The line to the host: standard input and output, a pseudo terminal, or a TCP socket on this machine.

#define _GNU_SOURCE // posix_openpt

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "transport.h"

#define BUFFER 4096

volatile sig_atomic_t interrupted;

static enum transport kind;
static int in = -1, out = -1, listener = -1;
static int connected;
static const char *link_path;
static char buffer[BUFFER];
static int filled;

static void
fail(const char *what)
{
    fprintf(stderr, "bench: %s: %s\n", what, strerror(errno));
    exit(1);
}

static void
do_not_block(int fd)
{
    fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
}

static void
open_pty(void)
{
    in = out = posix_openpt(O_RDWR | O_NOCTTY);
    if (in < 0 || grantpt(in) || unlockpt(in))
        fail("cannot make a pseudo terminal");
    const char *name = ptsname(in);
    struct termios raw;
    // Opened and closed once: raw from the start, and hung up until a host opens it.
    int slave = open(name, O_RDWR | O_NOCTTY);
    tcgetattr(slave, &raw);
    cfmakeraw(&raw);
    tcsetattr(slave, TCSANOW, &raw);
    close(slave);
    do_not_block(in);
    if (link_path) {
        unlink(link_path);
        if (symlink(name, link_path))
            fail(link_path);
    }
    fprintf(stderr, "bench: pty %s\n", link_path ? link_path : name);
}

static void
open_socket(int port)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    socklen_t size = sizeof address;
    int yes = 1;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    listener = socket(AF_INET, SOCK_STREAM, 0);
    setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    if (bind(listener, (struct sockaddr *)&address, size) || listen(listener, 1))
        fail("cannot listen");
    getsockname(listener, (struct sockaddr *)&address, &size);
    do_not_block(listener);
    fprintf(stderr, "bench: socket://127.0.0.1:%d\n", ntohs(address.sin_port));
}

void
transport_open(enum transport which, int port, const char *link)
{
    kind = which;
    link_path = link;
    if (kind == PTY) {
        open_pty();
    } else if (kind == SOCKET) {
        open_socket(port);
    } else {
        in = STDIN_FILENO;
        out = dup(STDOUT_FILENO);
        connected = 1;
    }
    // simavr prints to standard output while it loads; nobody asked for that.
    if (!freopen("/dev/null", "w", stdout))
        fail("/dev/null");
}

void
transport_close(void)
{
    transport_flush();
    if (kind == PTY && link_path)
        unlink(link_path);
}

static void
hang_up(void)
{
    connected = 0;
    filled = 0;
    if (kind == SOCKET) {
        close(in);
        in = out = -1;
    }
}

// Look whether a host has come.
static void
greet(void)
{
    if (connected || kind == STDIO)
        return;
    if (kind == PTY) {
        struct pollfd p = {.fd = in, .events = POLLIN};
        poll(&p, 1, 0);
        connected = !(p.revents & POLLHUP);
        return;
    }
    int fd = accept(listener, NULL, NULL);
    if (fd < 0)
        return;
    int yes = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    do_not_block(fd);
    in = out = fd;
    connected = 1;
}

int
transport_connected(void)
{
    greet();
    return connected;
}

void
transport_wait(int timeout_ms)
{
    transport_flush();
    if (!transport_connected() && kind == PTY) {
        // A hung-up terminal is always ready, so look again from time to time.
        poll(NULL, 0, timeout_ms >= 0 && timeout_ms < 5 ? timeout_ms : 5);
        return;
    }
    struct pollfd p = {.fd = connected ? in : listener, .events = POLLIN};
    struct timespec most = {timeout_ms / 1000, timeout_ms % 1000 * 1000000L};
    // A signal that came after the caller looked for one must end the wait, too.
    sigset_t ends, before;
    sigemptyset(&ends);
    sigaddset(&ends, SIGINT);
    sigaddset(&ends, SIGTERM);
    sigprocmask(SIG_BLOCK, &ends, &before);
    if (!interrupted)
        ppoll(&p, 1, timeout_ms < 0 ? NULL : &most, &before);
    sigprocmask(SIG_SETMASK, &before, NULL);
}

int
transport_get(char *bytes, int size)
{
    if (!transport_connected())
        return -1;
    if (kind == STDIO) { // may be a terminal shared with others, so it stays blocking
        struct pollfd p = {.fd = in, .events = POLLIN};
        if (poll(&p, 1, 0) <= 0)
            return 0;
    }
    ssize_t got = read(in, bytes, (size_t)size);
    if (got > 0)
        return (int)got;
    if (got < 0 && (errno == EAGAIN || errno == EINTR))
        return 0;
    if (kind == STDIO)
        connected = 0;
    else
        hang_up();
    return -1;
}

void
transport_flush(void)
{
    for (int done = 0; done < filled && out >= 0 && !interrupted;) {
        ssize_t wrote = write(out, buffer + done, (size_t)(filled - done));
        if (wrote > 0) {
            done += (int)wrote;
        } else if (wrote < 0 && errno == EAGAIN) {
            struct pollfd p = {.fd = out, .events = POLLOUT};
            poll(&p, 1, 100);
            if (p.revents & (POLLHUP | POLLERR))
                break;
        } else if (wrote < 0 && errno != EINTR) {
            break; // the host is gone; reading will notice
        }
    }
    filled = 0;
}

void
transport_put(char byte)
{
    if (kind != STDIO && !connected)
        return;
    buffer[filled++] = byte;
    if (filled == BUFFER)
        transport_flush();
}

double
transport_baud(void)
{
    static const struct {
        speed_t code;
        double baud;
    } rates[] = {{B9600, 9600}, {B19200, 19200}, {B38400, 38400}, {B57600, 57600}, {B115200, 115200},
                 {B230400, 230400}, {B460800, 460800}, {B500000, 500000}, {B1000000, 1000000}};
    struct termios now;
    if (kind != PTY || tcgetattr(in, &now))
        return 0;
    for (unsigned k = 0; k < sizeof rates / sizeof *rates; ++k)
        if (cfgetospeed(&now) == rates[k].code)
            return rates[k].baud;
    return 0;
}
