// Supply voltage on A0 through the divider.

#include <util/atomic.h>

#include "adc.h"
#include "config.h" // divider

// mV of the supply per step of the converter, in 1/65536: 5000 mV x 133/33 / 1024 = 19.68 mV
#define STEP ((uint32_t)((DIVIDER_TOP_OHM + DIVIDER_BOTTOM_OHM) * REFERENCE_mV / DIVIDER_BOTTOM_OHM * 64))

volatile uint16_t adc_sum;

// Waits for one conversion (0.2 ms) so that the average starts where the supply is.
void
adc_setup(void)
{
    ADMUX = (1 << REFS0);
    DIDR0 = (1 << ADC0D);
    ADCSRB = 0;
    ADCSRA = (1 << ADEN) | (1 << ADSC) | (1 << ADPS2) | (1 << ADPS1) | (1 << ADPS0);
    while (ADCSRA & (1 << ADSC))
        ;
    adc_sum = ADC << 4;
    ADCSRA |= (1 << ADSC);
}

uint16_t
adc_supply_mV(void)
{
    uint16_t sum;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { sum = adc_sum; }
    // The converter rounds down: on the average the supply is half a step above the reading.
    return ((sum + 8) * (STEP / 16)) >> 16;
}

// The adc_sum that means `mV`.
uint16_t
adc_from_mV(uint16_t mV)
{
    return (((uint32_t)mV << 16) / STEP) << 4;
}
