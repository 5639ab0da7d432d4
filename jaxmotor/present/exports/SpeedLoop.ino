// Holds a speed with the exported motor's own controller, and prints what the encoder says of it.
//
// For an ATmega328P at 16 MHz (Uno, Nano): D9 and D10 to the bridge's two inputs, D7 to its PWM and D6 to its standby
// input, D2 and D3 from the encoder. Timer1 makes the pulses, Timer2 the sampling period.

#include <JaxmotorMotor.h>

static const int32_t SPEED_mrad_s = 20000; // of the output shaft, 1/1000 rad/s

static_assert(MOTOR_PERIOD_us % 1000 == 0 && MOTOR_PERIOD_us < 256000, "the period is a whole number of ms here");

static volatile int32_t encoder_count;
static volatile int32_t latched_count;
static volatile int16_t latched_duty;
static struct motor_speed_loop controller;

// All four edges of both phases. Index: the phases before (upper two bits) and now.
static void
edge()
{
    static const int8_t steps[16] = {0, 1, -1, 0, -1, 0, 0, 1, 1, 0, 0, -1, 0, -1, 1, 0};
    static uint8_t before;
    uint8_t now = PIND >> 2 & 3;
    encoder_count += steps[before << 2 | now];
    before = now;
}

ISR(INT0_vect) { edge(); }
ISR(INT1_vect) { edge(); }

// Both inputs of the bridge are high between pulses, which brakes; a pulse takes one of them low.
static void
set_duty(int16_t duty)
{
    OCR1A = duty < 0 ? -duty : 0;
    OCR1B = duty > 0 ? duty : 0;
}

// Each ms; a sample every MOTOR_PERIOD_us: first the count, then the duty, then what can wait.
ISR(TIMER2_COMPA_vect)
{
    static uint8_t left = 1;
    if (--left)
        return;
    left = MOTOR_PERIOD_us / 1000;
    int32_t count = encoder_count;
    sei(); // edges must not wait for the arithmetic
    int16_t duty = motor_speed_duty(&controller, (count - latched_count) * 256);
    set_duty(duty);
    motor_speed_integrate(&controller);
    cli();
    latched_count = count;
    latched_duty = duty;
}

static void
start_timers()
{
    TCCR1A = _BV(COM1A1) | _BV(COM1A0) | _BV(COM1B1) | _BV(COM1B0) | _BV(WGM11);
    ICR1 = MOTOR_FULL_SCALE;
    set_duty(0);
    TCCR1B = _BV(WGM13) | _BV(CS11); // phase-correct up to ICR1, 2 MHz
    TCCR2A = _BV(WGM21);
    TCCR2B = _BV(CS22); // 250 kHz
    OCR2A = F_CPU / 64 / 1000 - 1;
    TIMSK2 = _BV(OCIE2A);
}

void
setup()
{
    Serial.begin(115200);
    pinMode(2, INPUT_PULLUP);
    pinMode(3, INPUT_PULLUP);
    EICRA = _BV(ISC00) | _BV(ISC10); // any edge
    EIMSK = _BV(INT0) | _BV(INT1);
    motor_speed_reference(&controller, motor_speed_from_mrad_s(SPEED_mrad_s));
    noInterrupts();
    start_timers();
    interrupts();
    pinMode(9, OUTPUT);
    pinMode(10, OUTPUT);
    pinMode(7, OUTPUT);
    pinMode(6, OUTPUT);
    digitalWrite(7, HIGH);
    digitalWrite(6, HIGH); // out of standby: the motor may turn
}

void
loop()
{
    static uint32_t next;
    if ((int32_t)(millis() - next) < 0)
        return;
    next = millis() + 100;
    noInterrupts();
    int32_t count = latched_count;
    int16_t duty = latched_duty;
    interrupts();
    Serial.print(count);
    Serial.print(' ');
    Serial.println(duty);
}
