// Lines from the host, each answered by A or N. docs/protocol.md lists them.

#ifndef COMMANDS_H
#define COMMANDS_H

void commands_poll(void);

#endif
