// Motor rig: experiments on a DC motor, sampled and sent over the serial port. Plain C in the other files;
// config.h is the one to edit.

extern "C" {
#include "rig.h"
}

void
setup()
{
    rig_setup();
}

void
loop()
{
    rig_loop();
}
