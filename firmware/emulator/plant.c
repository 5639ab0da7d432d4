// The plant: battery, bridge, motor, shaft and encoder, integrated at 10 us, with any effects in it.
//
//   L i' = v - R i - Kt w                         winding; v from the bridge
//   J w' = Kt i - b w - Kt/R0 (f(w, theta, t) + sgn(w) friction(w)) - spring
//
// f and friction are in volts: the voltage at the winding that overcomes them. Runge-Kutta of fourth order
// between the instants at which something switches: a bridge edge, the shaft stopping, a diode turning off.

#include <math.h>
#include <stddef.h>

#include "plant.h"
#include "plant_motion.h"
#include "plant_sensor.h"
#include "plant_steps.h"

// `way`: the direction of motion, which friction opposes; 0 = the rotor is held.
static struct state
rate(const struct plant *p, const struct state *s, double way)
{
    struct state d = {0};
    if (!current_is_static(p))
        d.current = current_rate(p, s);
    if (way != 0) {
        double rub = p->rubs ? way * p->per_volt * friction(p, s->speed) : 0;
        d.speed = (torque(p, s) - rub) * p->per_inertia;
        d.angle = s->speed;
    }
    if (p->two_masses) {
        d.load_speed = spring_torque(p, s) / p->load_inertia;
        d.load_angle = s->load_speed;
    }
    return d;
}

static struct state
moved(const struct plant *p, const struct state *s, const struct state *d, double h)
{
    struct state to = {s->current + h * d->current, s->speed + h * d->speed, s->angle + h * d->angle,
                       s->load_speed, s->load_angle};
    if (p->two_masses) {
        to.load_speed += h * d->load_speed;
        to.load_angle += h * d->load_angle;
    }
    return to;
}

static struct state
runge_kutta(const struct plant *p, double h, double way)
{
    const struct state *s = &p->now;
    struct state a = rate(p, s, way), at = moved(p, s, &a, h / 2);
    struct state b = rate(p, &at, way);
    at = moved(p, s, &b, h / 2);
    struct state c = rate(p, &at, way);
    at = moved(p, s, &c, h);
    struct state d = rate(p, &at, way);
    struct state sum = {
        a.current + 2 * (b.current + c.current) + d.current,
        a.speed + 2 * (b.speed + c.speed) + d.speed,
        a.angle + 2 * (b.angle + c.angle) + d.angle,
        0,
        0,
    };
    if (p->two_masses) {
        sum.load_speed = a.load_speed + 2 * (b.load_speed + c.load_speed) + d.load_speed;
        sum.load_angle = a.load_angle + 2 * (b.load_angle + c.load_angle) + d.load_angle;
    }
    return moved(p, s, &sum, h / 6);
}

// Friction at rest holds against any torque up to its static size.
static int
held(const struct plant *p)
{
    return p->time >= p->set.wiring.jammed_at_s
        || (p->rubs && fabs(torque(p, &p->now)) <= p->per_volt * friction(p, 0));
}

static double
member(const struct state *s, size_t which)
{
    return *(const double *)((const char *)s + which);
}

// The part of h after which a member of the state, which h takes past zero, is zero; `next` is the state then.
static double
shortened(const struct plant *p, double h, double way, size_t which, struct state *next)
{
    double from = member(&p->now, which);
    for (int k = 0; k < 3; ++k) { // three secants from the start
        double to = member(next, which);
        if (to == from)
            break;
        double share = from / (from - to);
        if (share > 1 - 1e-9 && share < 1 + 1e-9)
            break;
        h *= share;
        *next = runge_kutta(p, h, way);
    }
    return h;
}

// Move by h. Returns the part of h that was used: less when the shaft stopped or a diode turned off.
static double
piece(struct plant *p, double h)
{
    if (p->now.speed == 0)
        p->stuck = held(p);
    double way = p->stuck ? 0 : p->now.speed != 0 ? sign(p->now.speed) : sign(torque(p, &p->now));
    if (way == 0 && !p->stuck)
        way = 1; // balanced without friction: either will do
    p->flows = sign(p->now.current);
    struct state next = runge_kutta(p, h, way);

    if (p->hold == OPEN && p->flows != 0 && next.current * p->flows <= 0) {
        h = shortened(p, h, way, offsetof(struct state, current), &next);
        next.current = 0;
    }
    int stops = p->rubs && !p->stuck && p->now.speed != 0 && next.speed * p->now.speed <= 0;
    if (stops) {
        h = shortened(p, h, way, offsetof(struct state, speed), &next);
        next.speed = 0;
    }
    p->now = next;
    if (current_is_static(p))
        p->now.current = static_current(p, p->now.speed);
    p->now.current = settled(current_cap(p, p->now.current));
    p->now.speed = settled(p->now.speed);
    p->now.load_speed = settled(p->now.load_speed);
    return h;
}

// ---- slow things, once per step

static double
wandering(struct plant *p)
{
    const double step = WANDER_STEP;
    while (p->time >= p->wander_at) {
        double keep = maths_exp(-step / p->set.wandering_torque.time_constant_s);
        double spread = p->set.wandering_torque.volts_V * sqrt(1 - keep * keep);
        p->wander_from = p->wander_to;
        p->wander_to = keep * p->wander_to + spread * random_normal(&p->random);
        p->wander_at += step;
    }
    double share = 1 - (p->wander_at - p->time) / step;
    return p->wander_from + share * (p->wander_to - p->wander_from);
}

static void
before_step(struct plant *p, double h)
{
    const struct parameters *set = &p->set;
    p->battery = open_circuit(p);
    p->hot = resistance_now(p);
    p->pulse_volts = p->hold == PULSE ? winding_volts(p, 0) : 0;
    p->steady = set->load_torque.on ? set->load_torque.volts_V : 0;
    if (set->late_load.on && p->time >= set->late_load.start_s)
        p->steady += set->late_load.volts_V;
    if (set->outside_torque.on) {
        double turns = set->outside_torque.frequency_Hz * (p->time + h / 2);
        p->steady += set->outside_torque.volts_V * maths_sin(2 * PI * turns + set->outside_torque.phase_rad);
    }
    if (set->wandering_torque.on)
        p->steady += wandering(p);
    if (p->time >= set->wiring.jammed_at_s)
        p->now.speed = 0;
}

static void
after_step(struct plant *p, double h)
{
    const struct parameters *set = &p->set;
    double through = p->hold == OPEN ? 0 : p->duty * p->now.current;
    double drawn = p->hold == PULSE ? through : fabs(through);
    p->smoothed = settled(p->smoothed + (drawn - p->smoothed) * h / (set->battery.smoothing_s + h));
    p->drawn += drawn * h;
    if (set->winding_heating.on) {
        double full = set->battery.volts_V * set->battery.volts_V / p->resistance;
        double heat = p->now.current * p->now.current * resistance_now(p) / full;
        double target = set->winding_heating.rise_ratio * heat;
        p->rise = settled(p->rise + (target - p->rise) * h / set->winding_heating.time_constant_s);
    }
    if (set->missed_counts.on && fabs(p->now.speed) > set->missed_counts.speed_rad_s)
        p->missed += set->missed_counts.ratio * p->now.speed * h;
    if (set->sensor_lag.on)
        p->lagged += (shown(p) - p->lagged) * (1 - maths_exp(-h / set->sensor_lag.time_constant_s));
}

static void
step(struct plant *p, double h)
{
    double began = p->time, from = position(p);
    if (p->diverged) {
        p->time = began + h;
        return;
    }
    before_step(p, h);
    double left = h;
    for (int k = 0; k < 8 && left > 1e-4 * h; ++k)
        left -= piece(p, left);
    p->time = began + h;
    after_step(p, h);
    add_edges(p, from, position(p), began, h);
}

// ---- bridge events

static void
push(struct plant *p, double at, int hold, double duty)
{
    p->events[p->events_head] = (struct event){at, hold, duty};
    p->events_head = (p->events_head + 1) % EVENTS_MAX;
}

void
plant_advance(struct plant *p, double end)
{
    // A stiff winding gets shorter steps: Runge-Kutta needs them below 2.7 L/R.
    double longest = p->set.bench.step_s, tau = p->inductance / p->resistance;
    if (tau > 0 && tau < longest)
        longest = tau;
    while (p->events_tail != p->events_head || p->time < end) {
        const struct event *event = &p->events[p->events_tail];
        int switches = p->events_tail != p->events_head && event->at <= end + 1e-12;
        double until = switches ? event->at : end;
        int steps = (int)ceil((until - p->time) / longest - 1e-9);
        double began = p->time;
        for (int k = 1; k <= steps; ++k) {
            step(p, (until - began) / steps);
            p->time = began + (until - began) * k / steps;
        }
        if (!switches)
            break;
        p->hold = event->hold;
        p->duty = event->duty;
        p->events_tail = (p->events_tail + 1) % EVENTS_MAX;
    }
}

void
plant_queue(struct plant *p, double at, double duty, int drive, double seconds)
{
    if (p->set.transport_delay.on)
        at += p->set.transport_delay.delay_s;
    if (p->set.coast_drive.on && drive == DRIVE_BRAKE)
        drive = DRIVE_COAST;
    if (p->set.wiring.motor_swapped > 0)
        duty = -duty;
    duty = shaped(p, duty);
    if (drive == DRIVE_OFF) {
        push(p, at, OPEN, 0);
    } else if (p->set.bench.pwm_edges > 0) {
        int between = drive == DRIVE_COAST ? OPEN : PULSE;
        double quiet = (1 - fabs(duty)) / 2 * seconds;
        if (quiet > 0)
            push(p, at, between, 0);
        if (duty != 0) {
            push(p, at + quiet, PULSE, sign(duty));
            if (quiet > 0)
                push(p, at + seconds - quiet, between, 0);
        }
    } else if (drive == DRIVE_COAST && duty == 0) {
        push(p, at, OPEN, 0);
    } else {
        push(p, at, drive == DRIVE_COAST ? MEAN_COAST : MEAN, duty);
    }
}

void
plant_hold(struct plant *p, double duty, int drive, double seconds)
{
    p->edges_count = 0;
    p->hold_began = p->time;
    plant_queue(p, p->time, duty, drive, seconds);
    plant_advance(p, p->hold_began + seconds);
}
