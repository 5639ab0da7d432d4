// The rig without the Arduino core.

#include "../motor_rig/rig.h"

int
main(void)
{
    rig_setup();
    for (;;)
        rig_loop();
}
