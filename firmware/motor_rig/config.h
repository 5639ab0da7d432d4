// The rig as it is wired. The only file a builder edits.

#ifndef CONFIG_H
#define CONFIG_H

// Encoder counts, all four edges, per turn of the output shaft, in thousandths: 12 x 51.45 = 617.400
#define COUNTS_PER_REV_MILLI 617400L

// 1 swaps a direction in software, for who would rather not swap two wires
#define MOTOR_REVERSED 0
#define ENCODER_REVERSED 0

// Supply divider on A0 and the board's own 5 V, which is the reference
#define DIVIDER_TOP_OHM 100000L
#define DIVIDER_BOTTOM_OHM 33000L
#define REFERENCE_mV 5000L

// Baud rate after a reset: 115200, 250000, 500000 or 1000000. The host can change it until the next reset.
#define BAUD 115200L

// Limits until the host sends its own. Two lithium cells must not go below 3 V each.
#define SUPPLY_MIN_mV 6000
#define TRAVEL_LIMIT_COUNTS 10000000L
#define TIME_LIMIT_ms 3600000L

// The motor is called stalled when it was driven with at least this duty for so long in all, and did not get farther
// than this from where it was: one line of the encoder, which a shaft that only trembles goes over and back
#define STALL_DUTY 125
#define STALL_ms 1000
#define STALL_COUNTS 4

// The motor stops when no valid line came from the host for so long (at most 250)
#define HOST_SILENT_ms 250

// Resets a hung board within 120 ms. Set 0 on a Nano with the old (57600 baud) bootloader, which does
// not survive such a reset.
#define USE_WATCHDOG 1

#endif
