// Supply voltage on A0 through the divider.

#ifndef ADC_H
#define ADC_H

#include <avr/io.h>
#include <stdint.h>

// Sixteen times the reading, averaged over about 16 ms. Written by the tick interrupt.
extern volatile uint16_t adc_sum;

void adc_setup(void);
uint16_t adc_supply_mV(void);
uint16_t adc_from_mV(uint16_t mV);

// Take the conversion that the last tick started and start the next. Called by the tick interrupt every ms
// (a conversion takes 0.1 ms).
static inline void
adc_tick(void)
{
    uint16_t sum = adc_sum;
    adc_sum = sum + ADC - (sum >> 4);
    ADCSRA |= (1 << ADSC);
}

#endif
