// The line to the host: standard input and output, a pseudo terminal, or a TCP socket on this machine.

#ifndef TRANSPORT_H
#define TRANSPORT_H

#include <signal.h>

// Asked to end, by a signal; whoever waits looks at it.
extern volatile sig_atomic_t interrupted;

enum transport { STDIO, PTY, SOCKET };

// Opens it and says on stderr where it is. Exits with a sentence when it cannot.
void transport_open(enum transport kind, int port, const char *link);
void transport_close(void);

// Whether a host is there. With a pty or socket it may come and go.
int transport_connected(void);

// Wait until the host comes, sends, or `timeout_ms` (-1: for ever) has passed.
void transport_wait(int timeout_ms);

// What the host sent, without waiting. 0: nothing; -1: it is gone, or standard input has ended.
int transport_get(char *bytes, int size);

// Send. A slow reader stops the caller, and with it the board's time.
void transport_put(char byte);
void transport_flush(void);

// The rate that the host has set, 0 where that means nothing.
double transport_baud(void);

#endif
