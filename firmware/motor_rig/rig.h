// The rig's setup and loop, called by the sketch and by bare/main.c alike.

#ifndef RIG_H
#define RIG_H

void rig_setup(void);
void rig_loop(void);

#endif
