// The emulated bench: the real firmware in simavr, a motor behind its pins, a host on its serial port.

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "bench.h"
#include "transport.h"

#define PLANT_FILE_MAX 100000
#define COUNTS_PER_S_MAX 1.5e5 // the board takes 101 of its 16 million cycles a second for each

static const char usage[] =
    "usage: bench [--stdio | --pty | --socket PORT] [--mode lockstep|fast|real] [--plant FILE.toml]\n"
    "             [--set TABLE.KEY=VALUE]... [--elf FILE] [--link PATH] [--once] [--stats FILE.json] [--pins FILE.csv]\n"
    "             [--until SECONDS] [--keepalive-until SECONDS] [--hang-at SECONDS]\n"
    "\n"
    "--stdio      commands from standard input, the board's lines to standard output (default)\n"
    "--pty        a pseudo terminal, whose name goes to stderr; --link makes a symbolic link to it\n"
    "--socket     a TCP port of this machine, 0 = any; its address goes to stderr\n"
    "--mode       lockstep (default): the same bytes on every run; fast: no waiting; real: by the wall clock\n"
    "--plant      motor, battery, encoder and hidden effects; README.md has the tables\n"
    "--pins       how long each PWM period drives forward and backward [cycles], a row where that changes\n"
    "--once       end when the host hangs up\n"
    "--until      end at this simulated time\n"
    "--keepalive-until, --hang-at   stop the keepalives, or the processor, at this simulated time\n";

static void
on_signal(int number)
{
    (void)number;
    interrupted = 1;
}

static void
stop(const char *sentence, const char *what)
{
    fprintf(stderr, "bench: ");
    fprintf(stderr, sentence, what);
    fprintf(stderr, "\n");
    exit(2);
}

// The plant file and every --set, as one text.
static char *text;

static void
append(const char *piece)
{
    size_t before = text ? strlen(text) : 0;
    text = realloc(text, before + strlen(piece) + 1);
    if (!text)
        abort();
    strcpy(text + before, piece);
}

static void
append_file(const char *path)
{
    static char content[PLANT_FILE_MAX + 1];
    FILE *file = fopen(path, "r");
    if (!file)
        stop("cannot read the plant file %s", path);
    size_t got = fread(content, 1, sizeof content, file);
    fclose(file);
    if (got > PLANT_FILE_MAX)
        stop("the plant file is larger than the 100 kB that are read%s", "");
    if (memchr(content, 0, got))
        stop("the plant file is not text%s", "");
    content[got] = 0;
    append(content);
    append("\n");
}

// table.key=value becomes "[table]\nkey=value\n"
static void
append_setting(const char *setting)
{
    const char *dot = strchr(setting, '.');
    if (!dot || !strchr(dot, '='))
        stop("--set wants TABLE.KEY=VALUE, not %s", setting);
    char table[128];
    snprintf(table, sizeof table, "[%.*s]\n", (int)(dot - setting), setting);
    append(table);
    append(dot + 1);
    append("\n");
}

static char *
beside_me(const char *name)
{
    static char path[4096];
    ssize_t length = readlink("/proc/self/exe", path, sizeof path - 64);
    path[length > 0 ? length : 0] = 0;
    char *slash = strrchr(path, '/');
    strcpy(slash ? slash + 1 : path, name);
    return path;
}

static enum mode
mode_named(const char *name)
{
    static const char *const names[] = {"lockstep", "fast", "real"};
    for (int k = 0; k < 3; ++k)
        if (!strcmp(name, names[k]))
            return k;
    stop("no mode is called %s: lockstep, fast or real", name);
    return LOCKSTEP;
}

static void
parse(struct options *o, enum transport *transport, int *port, int argc, char **argv)
{
    for (int k = 1; k < argc; ++k) {
        const char *option = argv[k];
        if (!strcmp(option, "--help")) {
            fputs(usage, stdout);
            exit(0);
        }
        if (!strcmp(option, "--stdio") || !strcmp(option, "--pty")) {
            *transport = option[2] == 's' ? STDIO : PTY;
            continue;
        }
        if (!strcmp(option, "--once")) {
            o->once = 1;
            continue;
        }
        const char *value = k + 1 < argc ? argv[++k] : NULL;
        if (!value)
            stop("%s wants a value, or is no option; see bench --help", option);
        if (!strcmp(option, "--socket"))
            *transport = SOCKET, *port = atoi(value);
        else if (!strcmp(option, "--mode"))
            o->mode = mode_named(value);
        else if (!strcmp(option, "--plant"))
            append_file(value);
        else if (!strcmp(option, "--set"))
            append_setting(value);
        else if (!strcmp(option, "--elf"))
            o->elf = value;
        else if (!strcmp(option, "--link"))
            o->link = value;
        else if (!strcmp(option, "--stats"))
            o->stats = value;
        else if (!strcmp(option, "--pins"))
            o->pins = value;
        else if (!strcmp(option, "--until"))
            o->until_s = atof(value);
        else if (!strcmp(option, "--keepalive-until"))
            o->keepalive_until_s = atof(value);
        else if (!strcmp(option, "--hang-at"))
            o->hang_at_s = atof(value);
        else
            stop("%s is no option; see bench --help", option);
    }
}

static void
run(struct bench *bench)
{
    avr_t *avr = bench->avr;
    avr_cycle_count_t next = 0;
    while (!interrupted && board_run(bench)) {
        if (avr->cycle < next)
            continue;
        next = avr->cycle + MS;
        double now = (double)avr->cycle / CLOCK_Hz;
        if (now >= bench->options.until_s || !host_serve(bench))
            return;
        if (now >= bench->options.hang_at_s) {
            bench->options.hang_at_s = 1e30;
            board_hang(bench);
        }
        if (bench->reset_wanted) {
            bench->reset_wanted = 0;
            board_reset(bench);
        }
    }
}

int
main(int argc, char **argv)
{
    static struct bench bench;
    enum transport transport = STDIO;
    int port = 0;
    char error[300];
    bench.options = (struct options){.elf = beside_me("motor_rig.elf"),
                                     .until_s = 1e30, .keepalive_until_s = 1e30, .hang_at_s = 1e30};
    append("");
    parse(&bench.options, &transport, &port, argc, argv);
    bench.options.script = transport == STDIO;
    bench.options.once |= bench.options.script;
    bench.plant = plant_create(text, error, sizeof error);
    if (!bench.plant)
        stop("plant file: %s", error);
    if (plant_fastest(bench.plant) > COUNTS_PER_S_MAX)
        stop("plant file: the motor turns so fast that the encoder gives more counts than the board follows%s", "");

    struct sigaction action = {.sa_handler = on_signal}; // without SA_RESTART: waiting ends too
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    signal(SIGPIPE, SIG_IGN);

    transport_open(transport, port, bench.options.link);
    board_setup(&bench);
    serial_setup(&bench);
    timer1_setup(&bench);
    pins_setup(&bench);
    encoder_setup(&bench);
    watch_setup(&bench);
    host_setup(&bench);
    bench.reset_wanted = 0;
    board_reset(&bench);
    run(&bench);
    transport_close();
    pins_close();
    if (bench.options.stats)
        watch_write(&bench, bench.options.stats, (double)clock() / CLOCKS_PER_SEC);
    plant_destroy(bench.plant);
    return 0;
}
