// Why the board started.

#ifndef RESET_H
#define RESET_H

const char *reset_cause(void);

#endif
